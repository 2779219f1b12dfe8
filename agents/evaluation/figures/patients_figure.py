"""The figure of patients over time: a column a patient, a colour a policy."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from dms_core.figures import drawn, letter
from exo_env.rendering.curves import Curve, difference, draw, told, told_apart
from exo_env.rendering.panels import COLOURS, legend, literal, note, panels, save

from ..episodes.time_course import TimeCourse
from .marks import end_sentence, mark_end, mark_load_steps

if TYPE_CHECKING:
    from pathlib import Path

DASHED: dict[str, Any] = {"linestyle": (0, (4, 2)), "linewidth": 1.0}
ANGLE = "elbow_angle.angle"


@dataclass(frozen=True)
class Row:
    """A row of panels: lines of some readings, the second one dashed."""

    label: str
    unit: str
    reads: tuple[str, ...]
    lines: tuple[str, ...] = ()
    """What the lines are, where there are two."""
    of: Callable[..., np.ndarray] | None = None
    """What is drawn of the readings where it is not they themselves."""
    compared: bool = False
    """Whether the first policy is the zero of the others."""

    def curves(self, one: TimeCourse, colour: str) -> list[Curve]:
        """The lines of one episode."""
        columns = [one.columns[name] for name in self.reads]
        shown = columns if self.of is None else [self.of(*columns)]
        found = []
        for k, values in enumerate(shown):
            style = {"color": colour, **(DASHED if k > 0 else {"label": literal(one.policy)})}
            name = f"{one.policy}, {self.lines[k]}" if self.lines else one.policy
            found.append(Curve(name, one.columns["time"], values, style))
        return found

    def cell(self, ones: Sequence[TimeCourse]) -> list[Curve]:
        """All curves of a panel; flexion has what the patient wants first."""
        every = [self.curves(one, COLOURS[k % len(COLOURS)]) for k, one in enumerate(ones)]
        if self.compared:
            return [difference(c, first) for curves in every[1:] for c, first in zip(curves, every[0], strict=True)]
        longest = max(ones, key=lambda one: len(one.columns["time"]))
        wanted = self.reads == (ANGLE,) and "reference" in longest.columns
        return [*([wanted_curve(longest)] if wanted else []), *(c for curves in every for c in curves)]


MOMENTS = ("exo_moment", "muscle_moment")
ROWS = (
    Row("elbow flexion", "deg", (ANGLE,), of=np.degrees),
    Row("flexion minus\n{wanted}", "deg", (ANGLE, "reference"), of=lambda angle, psi: np.degrees(angle - psi)),
    Row("rope tension", "N", ("agonist_tension", "antagonist_tension"), ("agonist", "antagonist")),
    Row("moment at\nthe elbow", "Nm", MOMENTS, ("device", "muscles")),
    Row("moment minus that of\n{first}", "Nm", MOMENTS, ("device", "muscles"), compared=True),
    Row("effort of\nthe patient", "-", ("effort",)),
)


def wanted_curve(one: TimeCourse) -> Curve:
    """What the patient wants [deg]: dashed where the device is not told it."""
    style: dict[str, Any] = {"color": "0.55", "linewidth": 3.5, "alpha": 0.6, "label": "reference"}
    if one.hidden:
        style = {"color": "k", "linewidth": 1.3, "linestyle": (0, (4, 2)), "label": "plan, hidden from the device"}
    return Curve(f"the {one.wanted}", one.columns["time"], np.degrees(one.columns["reference"]), style)


@drawn
def time_courses(path: Path, columns: Mapping[str, Sequence[TimeCourse]]) -> None:
    """Draw them; curves that lie on another one are told below."""
    every = [one for ones in columns.values() for one in ones]
    readings = {name for one in every for name in one.columns}
    several = any(len(ones) > 1 for ones in columns.values())
    rows = [row for row in ROWS if readings.issuperset(row.reads) and (several or not row.compared)]
    figure, axes = panels(
        len(rows), len(columns), (1.2 + 4.4 * len(columns), 2.0 * len(rows) + 0.4), sharex="col", sharey="row"
    )
    said = []
    for line, row in zip(axes, rows, strict=True):
        label = row.label.format(wanted=every[0].wanted, first=literal(every[0].policy))
        line[0].set_ylabel(f"{label} [{row.unit}]", fontsize=9)
        cells = [row.cell(ones) for ones in columns.values()]
        span = float(np.ptp(np.concatenate([c.values for cell in cells for c in cell])))
        for ax, curves in zip(line, cells, strict=True):
            kept, twins = told_apart(curves, span)
            draw(ax, kept)
            said += [f"{letter(figure, ax)}: {told(twins, row.unit)}"] if twins else []
            if row.lines:
                words = f"solid: {row.lines[0]}, dashed: {row.lines[1]}"
                ax.set_title(words, fontsize=7, loc="right", pad=2, color="0.3")
    for column, (title, ones) in zip(axes.T, columns.items(), strict=True):
        for k, one in enumerate(ones):
            mark_end(column[0], one, ANGLE, COLOURS[k % len(COLOURS)], 180.0 / np.pi)
        for ax in column:
            mark_load_steps(ax, max(ones, key=lambda one: len(one.columns["time"])), say=ax is column[0])
        column[0].set_title(literal(f"{title}\n{ones[0].who}"), fontsize=9, pad=14)
        column[-1].set_xlabel("time [s]")
        column[-1].set_ylim(bottom=-0.05)
    figure.align_ylabels()
    ends = [
        f"{title}: {sentence}" for title, ones in columns.items() for one in ones if (sentence := end_sentence(one))
    ]
    note(figure, ([f"Not drawn, as they would lie on another curve: {'; '.join(said)}."] if said else []) + ends)
    legend(figure, 4)
    save(figure, path)
