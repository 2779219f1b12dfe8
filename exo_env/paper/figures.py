"""The paper's Figs. 6, 7 and 9 to 13 as PNG. Drawn by software (Agg), so no display is needed."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from exo_env.paper.scenarios import ScenarioRun
from exo_env.paper.summary import magnitude
from exo_env.rendering.panels import legend, panels, save

if TYPE_CHECKING:
    from exo_env.paper.tuning import Gains

COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7")
"""Of scenarios 1 to 4, distinct for colour-blind readers (Okabe and Ito 2008)."""
DASHES = ("-", "--", "-.", (0, (4, 1, 1, 1, 1, 1)))
WIDTH, HEIGHT = 7.0, 3.6
"""Of a figure of one panel [inch]."""

Course = Callable[[ScenarioRun], np.ndarray]


def _panels(count: int) -> tuple[Any, list[Any]]:
    """A figure with panels one below the other, over time."""
    figure, axes = panels(count, 1, (WIDTH, HEIGHT * (0.25 + 0.75 * count)), sharex=True)
    for ax in axes[:, 0]:
        ax.axhline(0.0, color="0.6", linewidth=0.6, zorder=0)
    axes[-1, 0].set_xlabel("time [s]")
    return figure, list(axes[:, 0])


def _draw(ax: Any, runs: Iterable[tuple[int, ScenarioRun]], course: Course) -> None:
    """One line a scenario, numbered as in the paper."""
    for k, run in runs:
        ax.plot(run.times, course(run), color=COLOURS[k], linestyle=DASHES[k], label=f"{k + 1}: {run.scenario.title}")


def _legend(figure: Any, ax: Any) -> None:
    """Four scenarios in two columns, else all beside each other."""
    legend(figure, ax, 2 if len(ax.get_legend_handles_labels()[1]) == 4 else 3)


def _sensor(name: str, factor: float = 1.0) -> Course:
    return lambda run: factor * run.values[name]


def step_response(path: Path, times: np.ndarray, angle: np.ndarray, target: float, title: str, gains: Gains) -> Path:
    """Figs. 6 and 7: hinge angle after a step.

    Args:
        path: PNG file.
        times: [s], shape (n,).
        angle: hinge angle [rad], shape (n,).
        target: angle that the step asks for [rad].
        title: headline.
        gains: shown below it.
    """
    figure, (ax,) = _panels(1)
    ax.plot(times, np.degrees(angle), color=COLOURS[0], label="hinge angle")
    ax.axhline(np.degrees(target), color="k", linestyle=":", linewidth=1.2, label="reference")
    low, high = np.degrees(min(angle.min(), target)), np.degrees(max(angle.max(), target))
    ax.set_ylim(low - 0.1 * (high - low), high + 0.1 * (high - low))
    ax.set_ylabel("angle [deg]")
    ax.set_title(
        f"{title}: $K_p$ = {gains.kp:.4g} N/rad, $K_i$ = {gains.ki:.3g} N/(rad s), $K_d$ = {gains.kd:.3g} N s/rad",
        fontsize=9,
    )
    _legend(figure, ax)
    return save(figure, path)


def scenario_figures(folder: Path, runs: Sequence[ScenarioRun]) -> list[Path]:
    """Figs. 9 to 13 of the four runs, in order."""
    numbered = list(enumerate(runs))
    active, assisted = [numbered[k] for k in (0, 2, 3)], numbered[1:]
    return [
        _trajectories(folder / "fig09_trajectories.png", numbered),
        _pair(
            folder / "fig10_muscle_forces.png", active,
            ("biceps long head [N]", _sensor("BIClong.sensor.tendon_force")),
            ("triceps long head [N]", _sensor("TRIlong.sensor.tendon_force")),
        ),
        _pair(
            folder / "fig11_rope_tensions.png", assisted,
            ("agonist rope, PID 1 [N]", _sensor("agonist_tension")),
            ("antagonist rope, PID 2 [N]", _sensor("antagonist_tension")),
        ),
        _moments(folder / "fig12_joint_moments.png", numbered),
        _pair(
            folder / "fig13_elbow_reactions.png", numbered,
            ("reaction force [N]", lambda run: magnitude(run, "F")),
            ("reaction moment [Nm]", lambda run: magnitude(run, "M")),
        ),
    ]  # fmt: skip


def _trajectories(path: Path, runs: list[tuple[int, ScenarioRun]]) -> Path:
    """Fig. 9: angles, and below them the errors that the eye cannot see there."""
    figure, (above, below) = _panels(2)
    first = runs[0][1]
    above.plot(first.times, np.degrees(first.reference), color="k", linewidth=2.5, alpha=0.35, label="reference")
    _draw(above, runs, _sensor("elbow_angle.angle", 180.0 / np.pi))
    _draw(below, runs, lambda run: np.degrees(run.values["elbow_angle.angle"] - run.reference))
    above.set_ylabel("elbow flexion [deg]")
    below.set_ylabel("flexion - reference [deg]")
    _legend(figure, above)
    return save(figure, path)


def _pair(
    path: Path, runs: list[tuple[int, ScenarioRun]], above: tuple[str, Course], below: tuple[str, Course]
) -> Path:
    """Two quantities, one below the other."""
    figure, axes = _panels(2)
    for ax, (label, course) in zip(axes, (above, below), strict=True):
        _draw(ax, runs, course)
        ax.set_ylabel(label)
        low, high = ax.get_ylim()
        # Next to nothing shall look like it: a rope that stays slack is drawn on a scale of newtons.
        ax.set_ylim(low if high > 1.0 else -0.1, max(high, 1.0))
    _legend(figure, axes[0])
    return save(figure, path)


def _moments(path: Path, runs: list[tuple[int, ScenarioRun]]) -> Path:
    """Fig. 12: equivalent elbow moments of the muscles, the exoskeleton, and both."""
    figure, axes = _panels(3)
    muscles, device = _sensor("muscle_moment"), _sensor("exo_moment")
    courses = (("muscles", muscles), ("exoskeleton", device), ("both", lambda run: muscles(run) + device(run)))
    for ax, (label, course) in zip(axes, courses, strict=True):
        _draw(ax, runs, course)
        ax.set_ylabel(f"{label} [Nm]")
    _legend(figure, axes[0])
    return save(figure, path)
