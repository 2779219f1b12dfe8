"""What a found design is worth: true peaks and more in today's device and in the found one, patient by patient.

Numbers are of a run's table with a row every 5 ms behind its start, not of the smoothed objective.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from dms_core import SolverOptions, simulate
from dms_core.errors import SimulationError
from exo_env.design.acceptance import Acceptance
from exo_env.design.space import Design
from exo_env.design.wearer import Wearer, exercise_times, rate_sensor, tracking_error
from exo_env.ecosystem.sensors import tension_sensor

SAMPLE = 0.005
"""Longest interval of the tables [s]."""
QUANTITIES = {
    "peak rope tension": "N",
    "peak elbow reaction": "N",
    "RMS motor power": "W",
    "mean positive motor power": "W",
    "peak guide force": "N",
    "rms tracking error": "deg",
}
"""Rows of the comparison with their units."""
TENSION, OFF = (list(QUANTITIES).index(name) for name in ("peak rope tension", "rms tracking error"))
"""Places of those that a device is judged by."""
HEAD = ("patients", "quantity", "unit", "today", "found", "change_percent")


def quantities(wearer: Wearer, design: Design, options: SolverOptions) -> np.ndarray:
    """QUANTITIES of a wearer's run in a design, shape (6,).

    Raises:
        SimulationError: the run did not reach its end; names the wearer.
    """
    model, end = wearer.model(design), wearer.exercise.duration
    try:
        trajectory = simulate(model, end, options).check()
    except SimulationError as error:
        raise SimulationError(f"{wearer.name}: {error}") from None
    times = np.array(exercise_times(wearer.exercise, SAMPLE))
    y, ropes = trajectory.sensors(times), tuple(design.device.ropes)
    tension = np.array([y[tension_sensor(r)] for r in ropes])
    power = -tension * np.array([y[rate_sensor(r)] for r in ropes])
    reaction, guide = (
        np.sqrt(sum(y[f"{name}.F{axis}"] ** 2 for axis in "xyz")) for name in ("elbow_reaction", "guide_force")
    )
    return np.array([
        tension.max(), reaction.max(), np.sqrt((power**2).sum(axis=0).mean()),
        np.maximum(power, 0.0).sum(axis=0).mean(), guide.max(),
        tracking_error(wearer.exercise, times, y["elbow_angle.angle"]),
    ])  # fmt: skip


class Comparison(NamedTuple):
    """Quantities of some patients in two designs."""

    group: str
    """In words, as 'designed on'."""
    patients: tuple[str, ...]
    today: np.ndarray
    """Shape (patients, quantities)."""
    found: np.ndarray

    def rows(self) -> list[tuple[str, str, str, float, float, float]]:
        """A row for each quantity, means over the patients, as HEAD says."""
        before, after = self.today.mean(axis=0), self.found.mean(axis=0)
        return [
            (f"{self.group} ({len(self.patients)})", name, unit, float(a), float(b), float(100.0 * (b / a - 1.0)))
            for (name, unit), a, b in zip(QUANTITIES.items(), before, after, strict=True)
        ]


def compared(
    group: str, who: Sequence[Wearer], today: Design, found: Design, options: SolverOptions,
    say: Callable[[str], None] = lambda sentence: None,
) -> Comparison:  # fmt: skip
    """Both designs on some wearers; one whose run fails in either is left out with a sentence.

    A wearer with whom a device does not do the exercise counts, and is told: the table is there to show it.

    Raises:
        SimulationError: none of them comes to the end of a run.
    """
    names, before, after, acceptance = [], [], [], Acceptance()
    for wearer in who:
        try:
            pair = [quantities(wearer, design, options) for design in (today, found)]
        except SimulationError as error:
            say(f"left out of the table: {error}")
            continue
        for which, design, row in zip(("today's", "the found"), (today, found), pair, strict=True):
            try:
                acceptance.check(wearer.name, design.device, row[OFF], row[TENSION])
            except SimulationError as error:
                say(f"in {which} device: {error}")
        names.append(wearer.name)
        before.append(pair[0])
        after.append(pair[1])
    if not names:
        raise SimulationError(f"no run of the patients {group} reached its end; the sentences above say why.")
    return Comparison(group, tuple(names), np.array(before), np.array(after))


def table(comparisons: Sequence[Comparison]) -> str:
    """The comparison as CSV."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(HEAD)
    for comparison in comparisons:
        writer.writerows([*row[:3], *(f"{x:.5g}" for x in row[3:])] for row in comparison.rows())
    return text.getvalue()


def printed(comparisons: Sequence[Comparison]) -> list[str]:
    """The comparison in lines."""
    lines = [f"{'mean over patients':34}{'today':>10}{'found':>10}{'change':>10}"]
    for comparison in comparisons:
        lines.append(f"{comparison.group}, {len(comparison.patients)} patients")
        for _, name, unit, *numbers, change in comparison.rows():
            lines.append(f"  {f'{name} [{unit}]':32}" + "".join(f"{x:10.4g}" for x in numbers) + f"{change:+9.1f}%")
    return lines
