"""Command line of the ecosystem: the paper's scenarios and tuning, and the bare arm.

python -m exo_env scenarios --out DIR
python -m exo_env tune --out DIR
python -m exo_env arm26 --excitations FILE.csv --start-deg D --start-activation A --t-end T --rtol R --sample DT
                        --out FILE.csv
python -m exo_env soak --steps N
"""

from __future__ import annotations

import math
import sys
from pathlib import Path

from tqdm import tqdm

from dms_core import Simulation, SolverOptions
from dms_core.command_line import FAILED_RUN, bar_of_run, moves, run_command
from dms_core.errors import InputError
from dms_core.model.control.ziegler_nichols import STEP, Gains, ziegler_nichols
from dms_core.model.muscles.activation import MINIMUM
from dms_core.output_file import check_writable, write_csv, write_json
from exo_env.ecosystem import bare_arm as bare
from exo_env.ecosystem.exoskeleton import Exoskeleton
from exo_env.paper.scenarios import FILES, ScenarioRun, load_scenarios, run
from exo_env.paper.statements import judged
from exo_env.paper.summary import columns, summary
from exo_env.paper.tuning import START, StepExperiment, proportional
from exo_env.paper.tuning import tune as find_gains

DEVICE = "exoskeletons/elbow.yaml"
BAR = "{desc} {percentage:3.0f}% |{bar}| {n:.3g} of {total:.3g} s simulated, {elapsed} passed, {remaining} left"


def scenarios(out: Path, rtol: float = SolverOptions.rtol) -> int:
    """Simulate the four scenarios of the paper: figures, one table a scenario, and scenarios.json.

    Args:
        out: folder for the results; made where it is missing.
        rtol: relative tolerance of the error per step.
    """
    check_writable(out / "scenarios.json")
    exercise, all_scenarios = load_scenarios()
    options = SolverOptions(rtol=rtol)
    runs: list[ScenarioRun] = []
    with tqdm(total=exercise.duration * len(FILES), unit="s", leave=False, disable=None, bar_format=BAR) as bar:
        for name, scenario in zip(FILES, all_scenarios, strict=True):
            bar.set_description(name)
            runs.append(run(scenario, exercise, options=options, progress=moves(bar, len(runs) * exercise.duration)))
    summaries = [summary(r) for r in runs]
    orderings = judged(summaries)
    for name, r in zip(FILES, runs, strict=True):
        write_csv(out / f"{name}.csv", columns(r))
    named = [{"name": name, **s} for name, s in zip(FILES, summaries, strict=True)]
    write_json(out / "scenarios.json", {"scenarios": named, "orderings": orderings})
    _draw_scenarios(out, runs)
    print(_report(named, orderings))
    print(f"written: {out}")
    return 0


def _draw_scenarios(out: Path, runs: list[ScenarioRun]) -> None:
    """Figs. 6, 7, 9 to 13."""
    from exo_env.paper.figures import scenario_figures

    scenario_figures(out, runs)
    device = Exoskeleton.from_config(DEVICE)
    _draw_steps(out, StepExperiment(device), device.tuning.Kc, Gains(**dict(device.gains)))


def _draw_steps(out: Path, experiment: StepExperiment, Kc: float, gains: Gains) -> None:
    """Figs. 6 and 7."""
    from exo_env.paper.figures import step_response

    for name, title, used in (
        ("fig06_critical_gain.png", "critical gain", proportional(Kc)),
        ("fig07_tuned.png", "tuned", gains),
    ):
        times, angle = experiment.response(used)
        step_response(out / name, times, angle, START + STEP, title, used)


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


def _report(summaries: list[dict], orderings: list[dict]) -> str:
    """What `scenarios` prints: peaks by scenario, then the paper's statements."""
    lines = [f"{'':20}" + "".join(f"{s['name']:>14}" for s in summaries)]
    lines += [f"{label:20}" + "".join(f"{s[key]:14.4g}" for s in summaries) for key, label in SHOWN]
    lines += ["", "What the paper's figures say, in ours:"]
    for o in orderings:
        numbers = ", ".join(f"{x:.4g}" for x in o["numbers"].values())
        lines.append(f"  {'true ' if o['holds'] else 'FALSE'}  Fig. {o['figure']:4} {o['statement']}: {numbers}")
        if not o["holds"]:
            lines.append(f"         because {o['why_not']}")
    return "\n".join(lines)


def tune(out: Path) -> int:
    """Repeat the Ziegler-Nichols procedure on our model: Kc, Tc, gains and what limits them, with Figs. 6 and 7.

    Args:
        out: folder for the figures and tuning.json; made where it is missing.
    """
    check_writable(out / "tuning.json")
    device = Exoskeleton.from_config(DEVICE)
    found = find_gains(device, lambda kp, growth: print(f"  Kp = {kp:9.1f} N/rad: growth {growth:+.5f}", flush=True))
    critical, gains = found.critical, found.gains
    plain = ziegler_nichols(critical.Kc, critical.Tc, integral_divisor=1.0)
    print(
        f"Kc = {critical.Kc:.5g} N/rad, Tc = {critical.Tc:.4g} s "
        "(the paper, on its own geometry and units: 9e6, 0.091 s)"
    )
    print(
        f"Kp = {gains.kp:.5g} N/rad, Ki = {plain.ki:.5g} / 500 = {gains.ki:.4g} N/(rad s), Kd = {gains.kd:.4g} N s/rad"
    )
    print(f"What limits the gain: {found.limit}.")
    _draw_steps(out, StepExperiment(device), critical.Kc, gains)
    write_json(
        out / "tuning.json",
        {
            "Kc_N_per_rad": critical.Kc,
            "Tc_s": critical.Tc,
            "kp_N_per_rad": gains.kp,
            "ki_N_per_rad_s": gains.ki,
            "kd_N_s_per_rad": gains.kd,
            "limit": found.limit,
            "trials": [{"kp_N_per_rad": kp, "growth": growth} for kp, growth in critical.trials],
        },
    )
    print(f"written: {out}")
    return 0


def arm26(
    excitations: Path,
    out: Path,
    t_end: float,
    start_deg: float = 20.0,
    start_activation: float = 0.05,
    rtol: float = SolverOptions.rtol,
    sample: float = 0.01,
) -> int:
    """Drive the bare arm26 by a table of excitations and write its motion, muscles and elbow reaction as CSV.

    Args:
        excitations: CSV file with the columns time_s [s], BIClong, BICshort, BRA, TRIlong, TRIlat, TRImed [-, 0 to 1];
            each row holds until the next, and the first stands at 0.
        out: CSV file to write; its folder is made where it is missing.
        t_end: end time [s].
        start_deg: elbow flexion at the start [deg].
        start_activation: of every muscle at the start, 0.01 to 1 [-].
        rtol: relative tolerance of the error per step.
        sample: time between rows [s].
    """
    for name, value in (("--t-end", t_end), ("--sample", sample)):
        if not (math.isfinite(value) and value > 0.0):
            raise InputError(f"{name} {value}: a positive time [s] is wanted.")
    if not -180.0 < start_deg < 180.0:
        raise InputError(f"--start-deg {start_deg}: an angle between -180 and 180 deg is wanted.")
    if not MINIMUM <= start_activation <= 1.0:
        raise InputError(f"--start-activation {start_activation}: a number from {MINIMUM} to 1 is wanted.")
    check_writable(out)
    system = bare.bare_arm(math.radians(start_deg), bare.read_excitations(excitations), start_activation)
    simulation = Simulation(system, SolverOptions(rtol=rtol))
    with bar_of_run(t_end) as bar:
        simulation.advance(t_end, moves(bar))
    trajectory = simulation.trajectory()
    write_csv(out, bare.table(trajectory, sample))
    print(f"{trajectory.message} {trajectory.stats.steps} steps. Written: {out}")
    for warning in bare.warnings(trajectory):
        print(f"warning: {warning}", file=sys.stderr)
    if not trajectory.success:
        print(f"The run failed; '{out}' holds the part before.", file=sys.stderr)
        return FAILED_RUN
    return 0


def soak(steps: int = 100_000, population: str = "evaluation", seed: int = 0, action_mode: str = "rope_tension") -> int:
    """Random actions in exo/ElbowLift-v1, a new patient an episode: counts of what happened and the worst figures.

    Args:
        steps: control periods in all.
        population: of the patients, by name or YAML file.
        seed: of patients and actions.
        action_mode: 'rope_tension' or 'pid_setpoint'.
    """
    from exo_env.envs.soak import soak as long_run

    if steps < 1:
        raise InputError(f"--steps {steps}: at least 1 is wanted.")
    with tqdm(total=steps, unit="step", leave=False, disable=None) as bar:

        def progress(done: int) -> None:
            bar.update(done - bar.n)

        found = long_run(steps, seed=seed, patient=population, action_mode=action_mode, progress=progress)
    for name, value in found.items():
        if name != "failures":
            print(f"{name:24} {value:.4g}" if isinstance(value, float) else f"{name:24} {value}")
    for sentence in found["failures"]:
        print(f"  {sentence}")
    return FAILED_RUN if found["not_finite_or_outside"] else 0


def main(arguments: list[str] | None = None) -> int:
    """Run a command; a mistake of the user is one message on stderr and status 2."""
    return run_command(
        {"scenarios": scenarios, "tune": tune, "arm26": arm26, "soak": soak},
        "python -m exo_env",
        "A subject with an elbow exoskeleton on a gym machine: scenarios, tuning, and the bare arm.",
        arguments,
    )


if __name__ == "__main__":
    sys.exit(main())
