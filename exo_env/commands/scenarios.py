"""The command `scenarios`: the paper's four scenarios, or one's own, as tables, figures and numbers."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

from tqdm import tqdm
from tyro.conf import arg

from dms_core import SolverOptions
from dms_core.command_line import FAILED_RUN, FolderOut, moves
from dms_core.errors import InputError, Stopped
from dms_core.figures import require_matplotlib
from dms_core.files.output_file import write_csv, write_json
from dms_core.files.outputs import Outputs
from dms_core.model.control.ziegler_nichols import Gains
from dms_core.simulation.options import MethodName
from exo_env.commands.tune import draw_steps
from exo_env.ecosystem import exoskeleton as devices
from exo_env.ecosystem import subject as subjects
from exo_env.ecosystem.ecosystem import Ecosystem
from exo_env.ecosystem.exoskeleton import Exoskeleton
from exo_env.paper.scenarios import FILES, Exercise, Scenario, ScenarioRun, load_scenarios, run
from exo_env.paper.statements import ORDERINGS, judged
from exo_env.paper.summary import columns, summary
from exo_env.paper.tuning import StepExperiment

BAR = "{desc} {percentage:3.0f}% |{bar}| {n:.3g} of {total:.3g} s simulated, {elapsed} passed, {remaining} left"


def scenarios(
    out: FolderOut,
    exoskeleton: Annotated[str, arg(metavar="NAME|FILE.yaml")] = devices.DEFAULT,
    subject: Annotated[str, arg(metavar="NAME|FILE.yaml")] = subjects.DEFAULT,
    exercise: Annotated[Path | None, arg(metavar="FILE.yaml")] = None,
    scenarios: Annotated[tuple[Path, ...], arg(metavar="FILE.yaml ...")] = (),
    rtol: float = SolverOptions.rtol,
    method: MethodName = SolverOptions.method,
    overwrite: bool = False,
) -> int:
    """Simulate scenarios: figures, one table a scenario, and scenarios.json.

    Args:
        out: folder for the results; made where it is missing.
        exoskeleton: device, by name or YAML file; configs/exoskeletons/elbow.yaml shows every key.
        subject: anatomy, by name or YAML file; configs/subject/arm26.yaml shows every key.
        exercise: movement, as in configs/scenarios/exercise.yaml; without it, the paper's.
        scenarios: scenarios, as in configs/scenarios/1_healthy.yaml; without them, the paper's four. The names of their
            files without the ending name the tables.
        rtol: relative tolerance of the error per step.
        method: method of integration: bdf2, sdirk2 or radau5.
        overwrite: replace files in the folder that others wrote or changed.
    """
    require_matplotlib()
    theirs, names, declared = _declared(exercise, scenarios)
    of_the_paper = exercise is None and not scenarios
    shipped = (exoskeleton, subject) == (devices.DEFAULT, subjects.DEFAULT)
    inputs = [exoskeleton, subject, exercise, *scenarios]
    with Outputs("scenarios", folder=out, inputs=inputs, overwrite=overwrite) as outputs:
        ecosystem = Ecosystem(device=Exoskeleton.named(exoskeleton), subject=subject)
        runs = _simulated(names, declared, theirs, ecosystem, SolverOptions(rtol=rtol, method=method))
        summaries = [summary(r) for r in runs]
        orderings = judged(summaries, shipped=shipped) if of_the_paper else []
        for name, r in zip(names, runs, strict=True):
            write_csv(out / f"{name}.csv", columns(r))
        named = [{"name": name, **s} for name, s in zip(names, summaries, strict=True)]
        write_json(out / "scenarios.json", {"scenarios": named, "orderings": orderings})
        titles = [s.title for s in declared]
        labels = [f"{k if of_the_paper else names[k - 1]}: {title}" for k, title in enumerate(titles, 1)]
        left_out = _draw(out, runs, labels, ecosystem)
    statements = [*_statements(orderings, of_the_paper), *left_out, *_flags(names, runs)]
    print("\n".join([*_table(named), "", *statements, f"written: {outputs.where(out)}"]))
    return FAILED_RUN if outputs.failed else 0


def _flags(names: Sequence[str], runs: Sequence[ScenarioRun]) -> list[str]:
    """A line for each range that something left, such as a rope that pushes."""
    return [
        f"  note   {name}: {flag.sentence}" for name, r in zip(names, runs, strict=True) for flag in r.trajectory.flags
    ]


def _declared(exercise: Path | None, files: Sequence[Path]) -> tuple[Exercise, list[str], list[Scenario]]:
    """The exercise, and names and contents of the scenarios.

    Raises:
        InputError: a file is missing or wrong, or two would have the same table.
    """
    paper_exercise, paper_scenarios = load_scenarios()
    movement = paper_exercise if exercise is None else Exercise.from_file(exercise)
    if not files:
        return movement, list(FILES), paper_scenarios
    names = [path.stem for path in files]
    for path, name in zip(files, names, strict=True):
        if names.count(name) > 1:
            raise InputError(f"--scenarios {path}: expected files of different names, got '{name}' twice.")
    return movement, names, [Scenario.from_file(path) for path in files]


def _simulated(
    names: Sequence[str], declared: Sequence[Scenario], exercise: Exercise, ecosystem: Ecosystem, options: SolverOptions
) -> list[ScenarioRun]:
    """All runs, with a bar over simulated time."""
    runs: list[ScenarioRun] = []
    total = exercise.duration * len(declared)
    with tqdm(total=total, unit="s", leave=False, disable=None, bar_format=BAR) as bar:
        for name, scenario in zip(names, declared, strict=True):
            bar.set_description(name)
            try:
                runs.append(run(scenario, exercise, ecosystem, options, moves(bar, len(runs) * exercise.duration)))
            except KeyboardInterrupt:
                done = f"{len(runs)} of {len(declared)} scenarios were simulated"
                raise Stopped(f"{done}; nothing was written.") from None
    return runs


def _draw(out: Path, runs: list[ScenarioRun], labels: Sequence[str], ecosystem: Ecosystem) -> list[str]:
    """Draw Figs. 6, 7, 9 to 13; gives a sentence on each that cannot be drawn."""
    from exo_env.paper.figures import scenario_figures

    device = ecosystem.device
    experiment = StepExperiment(device, ecosystem.subject)
    draw_steps(out, experiment, device.tuning.Kc, Gains(**dict(device.gains)))
    return scenario_figures(out, runs, labels)


SHOWN = (
    ("tracking_error_rms_deg", "rms error [deg]"),
    ("peak_angle_deg", "peak angle [deg]"),
    ("peak_biceps_long_N", "biceps long [N]"),
    ("peak_triceps_long_N", "triceps long [N]"),
    ("peak_agonist_rope_N", "agonist rope [N]"),
    ("peak_muscle_moment_Nm", "muscles [Nm]"),
    ("peak_exoskeleton_moment_Nm", "exoskeleton [Nm]"),
    ("peak_elbow_reaction_force_N", "elbow force [N]"),
    ("peak_elbow_reaction_moment_Nm", "elbow moment [Nm]"),
    ("lowest_gym_rope_tension_N", "lowest gym rope [N]"),
)
"""Rows of the printed table."""


def _table(summaries: Sequence[dict[str, Any]]) -> list[str]:
    """Peaks by scenario, as far as subject and device have them."""
    widths = [max(14, len(s["name"]) + 2) for s in summaries]
    lines = [f"{'':20}" + "".join(f"{s['name']:>{n}}" for s, n in zip(summaries, widths, strict=True))]
    for key, label in SHOWN:
        if key in summaries[0]:
            lines.append(f"{label:20}" + "".join(f"{s[key]:{n}.4g}" for s, n in zip(summaries, widths, strict=True)))
    return lines


def _statements(orderings: Sequence[dict[str, Any]], of_the_paper: bool) -> list[str]:
    """The paper's statements and whether they hold."""
    if not of_the_paper:
        return ["The paper's statements are about its own four scenarios and its own exercise; none is judged here."]
    lines = ["What the paper's figures say, in ours:"]
    for o in orderings:
        numbers = ", ".join(f"{x:.4g}" for x in o["numbers"].values())
        lines.append(f"  {'true ' if o['holds'] else 'FALSE'}  Fig. {o['figure']:4} {o['statement']}: {numbers}")
        if not o["holds"]:
            lines.append(f"         because {o['why_not']}")
    missing = len(ORDERINGS) - len(orderings)
    if missing:
        lines.append(
            f"Left out: {missing} of {len(ORDERINGS)}, on muscles or ropes that subject or device do not have."
        )
    return lines
