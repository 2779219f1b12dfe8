"""The command `design`: attachment points, guide and cuff of a device that lower a load over patients."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

from tyro.conf import arg

from dms_core import SolverOptions
from dms_core.analyses.commands.ending import gave_up
from dms_core.command_line import FAILED_RUN, FolderOut
from dms_core.errors import InputError, SimulationError, Stopped, choices
from dms_core.figures import require_matplotlib
from dms_core.files.output_file import write_text
from dms_core.files.outputs import Outputs
from dms_core.files.yaml_text import yaml_of
from dms_core.validation import shown
from exo_env.design.comparison import Comparison, compared, printed, table
from exo_env.design.objectives import Objective
from exo_env.design.objectives import objective as objective_of
from exo_env.design.search import Found, search
from exo_env.design.space import Bounds, Design, DesignSpace
from exo_env.design.wearer import Setting, Wearer, wearers
from exo_env.ecosystem import exoskeleton as devices
from exo_env.ecosystem import subject as subjects
from exo_env.ecosystem.cuff import Cuff
from exo_env.ecosystem.exoskeleton import Exoskeleton
from exo_env.ecosystem.worn_exoskeleton import Misalignment
from exo_env.paper.scenarios import Exercise
from exo_env.patient.population import population as population_of

RTOL = 1e-6
"""Relative tolerance of the runs; the objective then errs by far less than an iteration gains."""
CUFFS = {"rigid": None, "compliant": Cuff()}
"""Cuffs by name; None: a rigid guide."""
Vector = tuple[float, float, float]


def design(
    out: FolderOut,
    objective: Annotated[str, arg(metavar="peak_tension|elbow_reaction|motor_power")] = "peak_tension",
    exoskeleton: Annotated[str, arg(metavar="NAME|FILE.yaml")] = devices.DEFAULT,
    cuff: Annotated[str, arg(metavar="rigid|compliant|FILE.yaml")] = "rigid",
    bounds: Annotated[Path | None, arg(metavar="FILE.yaml")] = None,
    population: Annotated[str, arg(metavar="NAME|FILE.yaml")] = "mixed",
    patients: int = 6,
    held_out: int = 12,
    seed: int = 0,
    weight: float = 1.0,
    shift: Vector = (0.0, 0.0, 0.0),
    exercise: Annotated[Path | None, arg(metavar="FILE.yaml")] = None,
    subject: Annotated[str, arg(metavar="NAME|FILE.yaml")] = subjects.DEFAULT,
    iterations: int = 15,
    overwrite: bool = False,
) -> int:
    """Find attachment points, guide and cuff of a device within bounds, by exact gradients over patients.

    Writes the found device (device.yaml, with a compliant cuff also cuff.yaml), a table of both devices on the patients
    that were designed on and on others (design.csv), and a picture of both (devices.png).

    Args:
        out: folder for the results; made where it is missing.
        objective: what is lowered: peak_tension of the ropes, elbow_reaction (peak force), or motor_power (RMS).
        exoskeleton: device to begin with, by name or YAML file; configs/exoskeletons/elbow.yaml shows every key.
        cuff: rigid guide, or compliant cuff whose stiffness is designed too, the shipped one or that of a YAML file.
        bounds: YAML file with the numbers that are designed, each with its least and largest value, such as
            'ropes.agonist.lower.1: [-0.09, -0.05]'; without it, rope ends and guide within 30 mm of where they are.
        population: population of the patients, by name or YAML file.
        patients: number of patients that are designed on.
        held_out: number of further patients that the table shows.
        seed: seed of the patients.
        weight: mass of the weight on the machine [kg].
        shift: of the hinge from the elbow centre, as the device is worn [m].
        exercise: movement, as in configs/design/exercise.yaml, which it is without it.
        subject: anatomy, by name or YAML file.
        iterations: largest number of iterations of the search.
        overwrite: replace files in the folder that others wrote or changed.
    """
    require_matplotlib()
    for option, value in (("--patients", patients), ("--iterations", iterations)):
        _check_count(option, value, 1)
    for option, value in (("--held-out", held_out), ("--seed", seed)):
        _check_count(option, value, 0)
    lowered, today = objective_of(objective), _today(exoskeleton, cuff)
    space = DesignSpace(today, None if bounds is None else Bounds.read(bounds))
    given = {} if exercise is None else {"exercise": Exercise.from_file(exercise)}
    setting = Setting(weight=weight, subject=subject, misalignment=Misalignment(shift=shift), **given)
    source = population_of(population)
    inputs = [exoskeleton, cuff, bounds, population, exercise, subject]
    with Outputs("design", folder=out, inputs=inputs, overwrite=overwrite) as outputs:
        who = wearers(source, seed, patients + held_out, setting)
        try:
            lines = _searched(space, lowered, who[:patients], who[patients:], iterations, outputs, out)
        except SimulationError as error:
            return gave_up(error)
    print("\n".join(lines))
    print(f"written: {outputs.where(out)}")
    return FAILED_RUN if outputs.failed else 0


def _check_count(option: str, value: int, least: int) -> None:
    if value < least:
        raise InputError(f"{option} {value}: expected a whole number from {least}.")


def _today(exoskeleton: str, cuff: str) -> Design:
    """The device to begin with.

    Raises:
        InputError: there is no such device or cuff.
    """
    device = Exoskeleton.named(exoskeleton)
    if cuff.endswith((".yaml", ".yml")):
        return Design(device, Cuff.from_file(cuff))
    if cuff not in CUFFS:
        raise InputError(f"cuff = {shown(cuff)}: expected one of {choices(CUFFS)}, or a YAML file.")
    return Design(device, CUFFS[cuff])


def _searched(
    space: DesignSpace,
    lowered: Objective,
    who: Sequence[Wearer],
    others: Sequence[Wearer],
    iterations: int,
    outputs: Outputs,
    out: Path,
) -> list[str]:
    """Search, write all files, and report in lines.

    Raises:
        SimulationError: today's device fails, or no run for the table reached its end.
        Stopped: by the user, who keeps the best device so far.
    """
    options = SolverOptions(rtol=RTOL)
    found = search(space, who, lowered, options, iterations, _say)
    better = space.design(found.x)
    _write(out, better, _origin(found, lowered, len(who)))
    if found.stopped:
        raise Stopped(_kept(found, outputs.where(out)))
    named = [("designed on", who), ("held out", others)]
    groups = [compared(name, w, space.today, better, options, _say) for name, w in named if w]
    write_text(out / "design.csv", table(groups))
    _draw(out, space.today, better)
    return _report(space, found, lowered.unit, groups)


def _say(sentence: str) -> None:
    print(f"  {sentence}", flush=True)


def _kept(found: Found, where: Path) -> str:
    """What a search that was stopped leaves."""
    return (
        f"the best design of {found.evaluations} evaluations is kept in {where}; the table and the picture are missing."
    )


def _origin(found: Found, lowered: Objective, patients: int) -> str:
    """The comment that heads the files of a found device."""
    change = f"from {found.start:.4g} to {found.value:.4g} {lowered.unit}"
    return f"# Found by 'python -m exo_env design' for the least {lowered.title}: {change} over {patients} patients.\n"


def _write(out: Path, design: Design, origin: str) -> None:
    """The device, and the cuff that goes with it."""
    write_text(out / "device.yaml", origin + yaml_of(design.device.model_dump(mode="json")))
    if design.cuff is not None:
        write_text(out / "cuff.yaml", origin + yaml_of(design.cuff.model_dump(mode="json")))


def _draw(out: Path, today: Design, found: Design) -> None:
    from exo_env.design.picture import draw

    draw(out / "devices.png", today, found)


def _report(space: DesignSpace, found: Found, unit: str, groups: Sequence[Comparison]) -> list[str]:
    """Numbers of the design, what the search saw, and the table."""
    at = space.at_bounds(found.x)
    lines = [f"{'number':28}{'today':>12}{'found':>12}{'least':>12}{'largest':>12}"]
    for k, name in enumerate(space.names):
        numbers = (space.start[k], found.x[k], space.low[k], space.high[k])
        # Adding 0 keeps a minus from a rounded nothing.
        shown = "".join(f"{round(float(x), 7) + 0.0:12.5g}" for x in numbers)
        lines.append(f"{name:28}{shown}" + ("  at its bound" if name in at else ""))
    change = 100.0 * (found.value / found.start - 1.0)
    return [
        *lines, "",
        f"smoothed objective: {found.start:.4g} {unit} today, {found.value:.4g} {unit} found ({change:+.1f} %), "
        f"{found.evaluations} evaluations, {len(found.refused)} not acceptable",
        found.ending, "",
        *printed(groups), "",
    ]  # fmt: skip
