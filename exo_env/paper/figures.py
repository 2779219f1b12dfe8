"""The paper's Figs. 6, 7 and 9 to 13 as PNG. Drawn by software (Agg), so no display is needed."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from exo_env.ecosystem.sensors import tension_sensor
from exo_env.paper.scenarios import ScenarioRun
from exo_env.paper.summary import SHOWN_MUSCLES, SHOWN_ROPES, magnitude
from exo_env.rendering.panels import drawn, legend, panels, save

if TYPE_CHECKING:
    from exo_env.paper.tuning import Gains

COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#56B4E9", "#E69F00", "#000000")
"""Colours of the scenarios in turn, distinct for colour-blind readers (Okabe and Ito 2008)."""
DASHES = ("-", "--", "-.", (0, (4, 1, 1, 1, 1, 1)))
"""Dashes of the scenarios in turn; with seven colours the same line comes again after 28."""
WIDTH, HEIGHT = 7.0, 3.6
"""Size of a figure of one panel [inch]."""
SMALLEST_TOP = 1.0
"""Least upper end of an axis of forces [N]: a rope that stays slack is drawn on a scale of newtons."""

Curve = Callable[[ScenarioRun], np.ndarray]
"""A quantity of a run over its times, shape (n,)."""


@dataclass(frozen=True)
class Line:
    """A run as a line in the figures."""

    run: ScenarioRun
    label: str
    style: dict[str, Any]
    """Colour and dashes, the same in all figures."""


@dataclass(frozen=True)
class Figure:
    """Quantities of some scenarios, one below the other over time."""

    file: str
    panels: tuple[tuple[str, Curve], ...]
    """Label of the axis, and the quantity."""
    sensors: tuple[str, ...] = ()
    """Sensors of muscles or ropes that a subject or a device need not have."""
    needs: str | None = None
    """Field of a scenario that must be above 0 for its run to be shown."""
    forces: bool = False
    """Whether axes reach up to at least SMALLEST_TOP."""


def _panels(count: int) -> tuple[Any, list[Any]]:
    """A figure with panels one below the other, over time."""
    figure, axes = panels(count, 1, (WIDTH, HEIGHT * (0.25 + 0.75 * count)), sharex=True)
    for ax in axes[:, 0]:
        ax.axhline(0.0, color="0.6", linewidth=0.6, zorder=0)
    axes[-1, 0].set_xlabel("time [s]")
    return figure, list(axes[:, 0])


def _draw(ax: Any, lines: Iterable[Line], curve: Curve) -> None:
    """Draw a curve for each scenario."""
    for line in lines:
        ax.plot(line.run.times, curve(line.run), label=line.label, **line.style)


def _legend(figure: Any, ax: Any) -> None:
    """Four lines in two columns, else three beside each other."""
    legend(figure, ax, 2 if len(ax.get_legend_handles_labels()[1]) == 4 else 3)


def _sensor(name: str, factor: float = 1.0) -> Curve:
    """A component of the model's sensors times a factor."""
    return lambda run: factor * run.values[name]


@drawn
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


def _both_moments(run: ScenarioRun) -> np.ndarray:
    """Moment of muscles and exoskeleton together [Nm]."""
    return run.values["muscle_moment"] + run.values["exo_moment"]


BICEPS, TRICEPS = SHOWN_MUSCLES.values()
AGONIST, ANTAGONIST = map(tension_sensor, SHOWN_ROPES)
FIGURES = (
    Figure(
        "fig10_muscle_forces.png",
        (("biceps long head [N]", _sensor(BICEPS)), ("triceps long head [N]", _sensor(TRICEPS))),
        sensors=(BICEPS, TRICEPS), needs="maximum_activation", forces=True,
    ),
    Figure(
        "fig11_rope_tensions.png",
        (("agonist rope, PID 1 [N]", _sensor(AGONIST)), ("antagonist rope, PID 2 [N]", _sensor(ANTAGONIST))),
        sensors=(AGONIST, ANTAGONIST), needs="assistance", forces=True,
    ),
    Figure(
        "fig12_joint_moments.png",
        (
            ("muscles [Nm]", _sensor("muscle_moment")),
            ("exoskeleton [Nm]", _sensor("exo_moment")),
            ("both [Nm]", _both_moments),
        ),
    ),
    Figure(
        "fig13_elbow_reactions.png",
        (
            ("reaction force [N]", lambda run: magnitude(run, "F")),
            ("reaction moment [Nm]", lambda run: magnitude(run, "M")),
        ),
        forces=True,
    ),
)  # fmt: skip
"""Figs. 10 to 13; Fig. 9 has the reference in it."""


def scenario_figures(folder: Path, runs: Sequence[ScenarioRun], labels: Sequence[str]) -> list[str]:
    """Draw Figs. 9 to 13 of some runs, as many as there are, of one subject and one device.

    Args:
        folder: where the figures are written, under the same names as those of the paper.
        runs: simulated scenarios of the same exercise.
        labels: name of each run in the legend.

    Returns:
        A sentence on each figure that cannot be drawn.
    """
    lines = [
        Line(run, label, {"color": COLOURS[k % len(COLOURS)], "linestyle": DASHES[k % len(DASHES)]})
        for k, (run, label) in enumerate(zip(runs, labels, strict=True))
    ]
    _trajectories(folder / "fig09_trajectories.png", lines)
    sentences = []
    for figure in FIGURES:
        shown = [x for x in lines if figure.needs is None or getattr(x.run.scenario, figure.needs) > 0.0]
        missing = [name for name in figure.sensors if name not in runs[0].values]
        if missing:
            sentences.append(f"{figure.file} is left out: subject and device have no {' and no '.join(missing)}.")
        elif not shown:
            sentences.append(f"{figure.file} is left out: no scenario has a {figure.needs} above 0.")
        else:
            _stacked(folder / figure.file, figure, shown)
    return sentences


@drawn
def _trajectories(path: Path, lines: Sequence[Line]) -> None:
    """Fig. 9: angles, and below them the errors that the eye cannot see there."""
    figure, (above, below) = _panels(2)
    first = lines[0].run
    above.plot(first.times, np.degrees(first.reference), color="k", linewidth=2.5, alpha=0.35, label="reference")
    _draw(above, lines, _sensor("elbow_angle.angle", 180.0 / np.pi))
    _draw(below, lines, lambda run: np.degrees(run.values["elbow_angle.angle"] - run.reference))
    above.set_ylabel("elbow flexion [deg]")
    below.set_ylabel("flexion - reference [deg]")
    _legend(figure, above)
    save(figure, path)


@drawn
def _stacked(path: Path, declared: Figure, lines: Sequence[Line]) -> None:
    """The quantities of a figure, one below the other."""
    figure, axes = _panels(len(declared.panels))
    for ax, (label, curve) in zip(axes, declared.panels, strict=True):
        _draw(ax, lines, curve)
        ax.set_ylabel(label)
        low, high = ax.get_ylim()
        if declared.forces:
            ax.set_ylim(low if high > SMALLEST_TOP else -0.1 * SMALLEST_TOP, max(high, SMALLEST_TOP))
    _legend(figure, axes[0])
    save(figure, path)
