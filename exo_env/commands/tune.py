"""The command `tune`: the Ziegler-Nichols procedure on a device, with Figs. 6 and 7."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from tyro.conf import arg

from dms_core.command_line import FAILED_RUN, FolderOut
from dms_core.figures import require_matplotlib
from dms_core.files.output_file import write_json
from dms_core.files.outputs import Outputs
from dms_core.model.control.ziegler_nichols import STEP, Gains, ziegler_nichols
from exo_env.ecosystem.exoskeleton import DEFAULT, Exoskeleton
from exo_env.paper.tuning import START, StepExperiment, Tuning, proportional
from exo_env.paper.tuning import tune as find_gains


def tune(
    out: FolderOut,
    exoskeleton: Annotated[str, arg(metavar="NAME|FILE.yaml")] = DEFAULT,
    overwrite: bool = False,
) -> int:
    """Repeat the Ziegler-Nichols procedure on a device: Kc, Tc, gains and what limits them, with Figs. 6 and 7.

    Args:
        out: folder for the figures and tuning.json; made where it is missing.
        exoskeleton: device, by name or YAML file; configs/exoskeletons/elbow.yaml shows every key. Its own `gains` and
            `tuning` do not count.
        overwrite: replace files in the folder that others wrote or changed.
    """
    require_matplotlib()
    device = Exoskeleton.named(exoskeleton)
    with Outputs("tune", folder=out, inputs=[exoskeleton], overwrite=overwrite) as outputs:
        _tune(out, device)
    print(f"written: {outputs.where(out)}")
    return FAILED_RUN if outputs.failed else 0


def _tune(out: Path, device: Exoskeleton) -> None:
    """Find the gains of a device; print, write and draw them."""
    tuning = find_gains(device, lambda kp, growth: print(f"  Kp = {kp:9.1f} N/rad: growth {growth:+.5f}", flush=True))
    _print_gains(tuning)
    write_json(
        out / "tuning.json",
        {
            "Kc_N_per_rad": tuning.critical.Kc,
            "Tc_s": tuning.critical.Tc,
            "kp_N_per_rad": tuning.gains.kp,
            "ki_N_per_rad_s": tuning.gains.ki,
            "kd_N_s_per_rad": tuning.gains.kd,
            "limit": tuning.limit,
            "trials": [{"kp_N_per_rad": kp, "growth": growth} for kp, growth in tuning.critical.trials],
        },
    )
    draw_steps(out, StepExperiment(device), tuning.critical.Kc, tuning.gains)


def _print_gains(tuning: Tuning) -> None:
    """Critical oscillation, gains, and what limits them."""
    critical, gains = tuning.critical, tuning.gains
    plain = ziegler_nichols(critical.Kc, critical.Tc, integral_divisor=1.0)
    print(
        f"Kc = {critical.Kc:.5g} N/rad, Tc = {critical.Tc:.4g} s "
        "(the paper, on its own geometry and units: 9e6, 0.091 s)"
    )
    print(
        f"Kp = {gains.kp:.5g} N/rad, Ki = {plain.ki:.5g} / 500 = {gains.ki:.4g} N/(rad s), Kd = {gains.kd:.4g} N s/rad"
    )
    print(f"What limits the gain: {tuning.limit}.")


def draw_steps(out: Path, experiment: StepExperiment, Kc: float, gains: Gains) -> None:
    """Draw Figs. 6 and 7.

    Args:
        out: folder of the figures.
        experiment: gives the step responses.
        Kc: critical gain [N/rad], of Fig. 6.
        gains: of Fig. 7.
    """
    from exo_env.paper.figures import step_response

    for name, title, used in (
        ("fig06_critical_gain.png", "critical gain", proportional(Kc)),
        ("fig07_tuned.png", "tuned", gains),
    ):
        times, angle = experiment.response(used)
        step_response(out / name, times, angle, START + STEP, title, used)
