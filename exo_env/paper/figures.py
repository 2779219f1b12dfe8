"""The paper's Figs. 6, 7 and 9 to 13 as PNG. Drawn by software (Agg), so no display is needed."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from dms_core.figures import drawn, letter
from exo_env.ecosystem.sensors import tension_sensor
from exo_env.paper.scenarios import ScenarioRun
from exo_env.paper.summary import SHOWN_MUSCLES, SHOWN_ROPES, magnitude
from exo_env.rendering.curves import Curve, difference, draw, told, told_apart
from exo_env.rendering.panels import COLOURS, DASHES, legend, note, panels, save
from exo_env.rendering.quantities import quantity

if TYPE_CHECKING:
    from exo_env.paper.tuning import Gains

WIDTH, HEIGHT = 7.0, 3.6
"""Size of a figure of one panel [inch]."""
SMALLEST_TOP = 1.0
"""Forces that stay below are not drawn [N or Nm]: a rope that stays slack is told in words."""
SETTLED = 0.01
"""Share of a step within which an angle has come to rest [-]."""
AT_REST = {"maximum_activation": "the subject commands no muscle", "assistance": "the device does not assist"}
"""What it means that a field of a scenario is 0."""

Quantity = Callable[[ScenarioRun], np.ndarray]
"""A quantity of a run over its times, shape (n,)."""


@dataclass(frozen=True)
class Panel:
    """A quantity of the scenarios over time."""

    label: str
    """The quantity in words."""
    unit: str
    of: Quantity


@dataclass(frozen=True)
class Line:
    """A run as a line in the figures."""

    run: ScenarioRun
    label: str
    style: dict[str, Any]
    """Colour and dashes, the same in all figures."""

    @property
    def short(self) -> str:
        """The label up to its title."""
        return self.label.partition(":")[0]

    def curve(self, quantity: Quantity) -> Curve:
        """A quantity of the run."""
        return Curve(self.short, self.run.times, quantity(self.run), {**self.style, "label": self.label})


@dataclass(frozen=True)
class Figure:
    """Quantities of some scenarios, one below the other over time."""

    file: str
    panels: tuple[Panel, ...]
    sensors: tuple[str, ...] = ()
    """Sensors of muscles or ropes that a subject or a device need not have."""
    needs: str | None = None
    """Field of a scenario that must be above 0 for its run to be shown."""
    forces: bool = False
    """Whether a quantity that stays below SMALLEST_TOP is left out."""


def _panels(count: int) -> tuple[Any, list[Any]]:
    """A figure with panels one below the other, over time."""
    figure, axes = panels(count, 1, (WIDTH, HEIGHT * (0.25 + 0.75 * count)), sharex=True)
    for ax in axes[:, 0]:
        ax.axhline(0.0, color="0.6", linewidth=0.6, zorder=0)
    axes[-1, 0].set_xlabel("time [s]")
    return figure, list(axes[:, 0])


def _legend(figure: Any, labels: Sequence[str]) -> None:
    """Four lines in two columns, else three beside each other."""
    legend(figure, 2 if len(labels) == 4 else 3, labels)


def _sensor(name: str, factor: float = 1.0) -> Quantity:
    """A component of the model's sensors times a factor."""
    return lambda run: factor * run.values[name]


@drawn
def step_response(path: Path, times: np.ndarray, angle: np.ndarray, target: float, title: str, gains: Gains) -> Path:
    """Figs. 6 and 7: hinge angle after a step, until it has come to rest.

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
    ax.set_ylabel("hinge angle [deg]")
    shown = (("$K_p$", gains.kp, "N/rad"), ("$K_i$", gains.ki, "N/(rad s)"), ("$K_d$", gains.kd, "N s/rad"))
    said = ", ".join(f"{name} = {quantity(value, unit)}" for name, value, unit in shown if value != 0.0)
    ax.set_title(f"{title}: {said}", fontsize=9)
    rest = rest_time(times, angle)
    if 2.0 * rest < times[-1]:
        ax.set_xlim(-0.1 * rest, 2.0 * rest)
        later = np.degrees(np.abs(angle[times >= 2.0 * rest] - target).max())
        note(
            figure, [f"From {2.0 * rest:.2g} s to {times[-1]:.2g} s it stays within {later:.2g} deg of the reference."]
        )
    _legend(figure, ["hinge angle", "reference"])
    return save(figure, path)


def rest_time(times: np.ndarray, angle: np.ndarray) -> float:
    """Time from which an angle stays within SETTLED of its whole way of where it ends [s]."""
    moving = np.abs(angle - angle[-1]) > SETTLED * abs(angle[-1] - angle[0])
    return float(times[np.flatnonzero(moving)[-1]]) if moving.any() else float(times[-1])


def _both_moments(run: ScenarioRun) -> np.ndarray:
    """Moment of muscles and exoskeleton together [Nm]."""
    return run.values["muscle_moment"] + run.values["exo_moment"]


BICEPS, TRICEPS = SHOWN_MUSCLES.values()
AGONIST, ANTAGONIST = map(tension_sensor, SHOWN_ROPES)
FLEXION = Panel("elbow flexion", "deg", _sensor("elbow_angle.angle", 180.0 / np.pi))
ERROR = Panel("flexion minus reference", "deg", lambda run: FLEXION.of(run) - np.degrees(run.reference))
FIGURES = (
    Figure(
        "fig10_muscle_forces.png",
        (
            Panel("biceps force (long head)", "N", _sensor(BICEPS)),
            Panel("triceps force (long head)", "N", _sensor(TRICEPS)),
        ),
        sensors=(BICEPS, TRICEPS), needs="maximum_activation", forces=True,
    ),
    Figure(
        "fig11_rope_tensions.png",
        (
            Panel("agonist tension (PID 1)", "N", _sensor(AGONIST)),
            Panel("antagonist tension (PID 2)", "N", _sensor(ANTAGONIST)),
        ),
        sensors=(AGONIST, ANTAGONIST), needs="assistance", forces=True,
    ),
    Figure(
        "fig12_joint_moments.png",
        (
            Panel("moment of the muscles", "Nm", _sensor("muscle_moment")),
            Panel("moment of the exoskeleton", "Nm", _sensor("exo_moment")),
            Panel("moment of both together", "Nm", _both_moments),
        ),
    ),
    Figure(
        "fig13_elbow_reactions.png",
        (
            Panel("elbow reaction force", "N", lambda run: magnitude(run, "F")),
            Panel("elbow reaction moment", "Nm", lambda run: magnitude(run, "M")),
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
        elif not (kept := _above(figure, shown)):
            sentences.append(f"{figure.file} is left out: {_below(figure.panels, shown)}")
        else:
            _stacked(folder / figure.file, figure, kept, shown, _left_out(figure, kept, lines, shown))
    return sentences


def _highest(panel: Panel, lines: Sequence[Line]) -> float:
    """Largest size of a quantity in some scenarios."""
    return max(float(np.abs(panel.of(line.run)).max()) for line in lines)


def _above(figure: Figure, lines: Sequence[Line]) -> list[Panel]:
    """The quantities of a figure that show something."""
    return [p for p in figure.panels if not figure.forces or _highest(p, lines) >= SMALLEST_TOP]


def _below(declared: Sequence[Panel], lines: Sequence[Line]) -> str:
    """A sentence on quantities that show nothing."""
    said = [f"{p.label} is at most {quantity(_highest(p, lines), p.unit, 2)}" for p in declared]
    return f"{'; '.join(said)} in all scenarios shown." if said else ""


def _left_out(figure: Figure, kept: Sequence[Panel], lines: Sequence[Line], shown: Sequence[Line]) -> list[str]:
    """Sentences on the scenarios and quantities that a figure does not draw."""
    sentences = [
        f'Not drawn: "{x.label}", in which {AT_REST[figure.needs]}.' for x in lines if figure.needs and x not in shown
    ]
    dropped = _below([p for p in figure.panels if p not in kept], shown)
    return sentences + ([f"Not drawn: {dropped}"] if dropped else [])


@drawn
def _trajectories(path: Path, lines: Sequence[Line]) -> None:
    """Fig. 9: angles, and below them the errors that the eye cannot see there."""
    figure, (above, below) = _panels(2)
    first = lines[0].run
    bold = {"color": "k", "linewidth": 2.5, "alpha": 0.35, "label": "reference"}
    reference = Curve("the reference", first.times, np.degrees(first.reference), bold)
    kept, twins = told_apart([reference, *(line.curve(FLEXION.of) for line in lines)])
    draw(above, kept)
    draw(below, [line.curve(ERROR.of) for line in lines])
    for ax, panel in ((above, FLEXION), (below, ERROR)):
        ax.set_ylabel(f"{panel.label} [{panel.unit}]")
    if twins:
        note(figure, [f"Not drawn in a, but in b: {told(twins, FLEXION.unit)}."])
    _legend(figure, ["reference", *(line.label for line in lines)])
    save(figure, path)


@drawn
def _stacked(
    path: Path, declared: Figure, shown: Sequence[Panel], lines: Sequence[Line], sentences: Sequence[str]
) -> None:
    """Quantities of a figure, one below the other; curves that lie on each other as differences below them."""
    parts = [(panel, *told_apart([line.curve(panel.of) for line in lines])) for panel in shown]
    figure, axes = _panels(len(parts) + sum(bool(twins) for _, _, twins in parts))
    rest, said = iter(axes), []
    for panel, kept, twins in parts:
        ax = next(rest)
        draw(ax, kept)
        ax.set_ylabel(f"{panel.label} [{panel.unit}]")
        if twins:
            below = next(rest)
            differences, again = told_apart([difference(twin.curve, twin.on) for twin in twins])
            draw(below, differences)
            names = sorted({twin.on.name for twin in twins})
            below.set_ylabel(f"{panel.label}:\ndifference to {', '.join(names)} [{panel.unit}]")
            a, b, on = letter(figure, ax), letter(figure, below), told(twins, panel.unit)
            said.append(f"Not drawn in {a}, but in {b}: {on}.")
            said += [f"Not drawn in {b}: {told(again, panel.unit)}."] if again else []
    note(figure, [*said, *sentences])
    _legend(figure, [line.label for line in lines])
    save(figure, path)
