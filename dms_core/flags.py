"""Where a run left the ranges that its elements are meant for (`Limit` in model/element.py).

A rope of fixed length that pushes, a muscle whose fibre is on its stop: the equations have a solution there, and a run
goes on, but its result says when, which element, and how far.

What is solved for is only as good as the run, and its own steps show how good that is, whatever method, tolerance or
step it was given: both methods are of order 2, so that a step errs by less than what a parabola adds to a straight line
over it, x'' h^2. A value that is outside by less than that, and by less than `Limit.share` of its largest size, is not
flagged. A value that stays outside is no error of a step: there x'' h^2 is 0, whatever peak is beside it.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from dms_core.assembly.model import Model
from dms_core.assembly.residual import evaluate_inputs
from dms_core.assembly.tables import Signals
from dms_core.compiled.arena import Packed
from dms_core.model.element import Limit

ROUNDING = 1e-12
"""Share of the largest size of a value by which it is outside without being so."""


@dataclass(frozen=True)
class Flag:
    """An element that left one of its ranges."""

    element: str
    kind: str
    what: str
    """What is so outside of the range."""
    unit: str
    first: float
    """First time outside [s]."""
    total: float
    """Time spent outside [s]."""
    worst: float
    """Value farthest outside, in `unit`."""
    at: float
    """When that was [s]."""

    @property
    def sentence(self) -> str:
        """For the user."""
        return (
            f"{self.kind} '{self.element}': {self.what}: first at t = {self.first:.6g} s, for {self.total:.4g} s in "
            f"all; {self.worst:.6g} {self.unit} at t = {self.at:.6g} s."
        )

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        return {**asdict(self), "sentence": self.sentence}


class Limits:
    """All limits of a model's elements."""

    def __init__(self, model: Model) -> None:
        self._model = model
        self._limits = [(e, limit) for e in model.system.everything() for limit in e.limits()]

    def reads(self, of: str) -> bool:
        """True if any limit is one of a 'coordinate', 'multiplier' or 'input'."""
        return any(limit.of == of for _, limit in self._limits)

    def left(self, t: np.ndarray, q: np.ndarray, lam: np.ndarray, u: np.ndarray) -> tuple[Flag, ...]:
        """Flags of a run.

        Args:
            t: times [s], shape (n,).
            q: coordinates, shape (n, n_q).
            lam: multipliers, shape (n, n_phi); may be empty where none is read.
            u: values of the inputs, shape (n, n_u); may be empty where none is read.
        """
        rows, flags = self._model.layout.row_names, []
        for element, limit in self._limits:
            if limit.of == "coordinate":
                x = q[:, self._model.layout.index[limit.name]]
            elif limit.of == "input":
                x = u[:, self._model.layout.input_index[limit.name]]
            else:
                x = lam[:, rows.index(limit.name)]
            allowed = _allowed(limit, t, x)
            for far, said in ((limit.low - x, limit.below), (x - limit.high, limit.above)):
                if said and (far > allowed).any():
                    flags.append(_flag(element, limit, said, t, x, far, allowed))
        return tuple(flags)


def _allowed(limit: Limit, t: np.ndarray, x: np.ndarray) -> np.ndarray:
    """How far outside x may be at each time without a flag, shape (n,)."""
    size = np.abs(x).max(initial=0.0)
    curved = curvature(t, x)
    # What a run gets wrong lasts: beside a shorter step, such as that behind a jump, its usual accuracy counts.
    error = np.maximum(curved, _median(t, curved)) if limit.share else curved
    return np.maximum(ROUNDING * size, np.minimum(error, limit.share * size))


def curvature(t: np.ndarray, x: np.ndarray) -> np.ndarray:
    """|x''| h^2 at and one step beside each time, shape (n,): h the longer step there, 0 across a jump (equal times).

    One time alone, as `World.flags` sees it, shows nothing: 0.
    """
    found = np.zeros(len(t))
    h = np.diff(t)
    smooth = (h[1:] > 0.0) & (h[:-1] > 0.0)
    slope = np.diff(x) / np.where(h > 0.0, h, 1.0)
    bend = 2.0 * np.abs(np.diff(slope)) / np.where(smooth, h[1:] + h[:-1], 1.0)
    found[1:-1] = np.where(smooth, bend * np.maximum(h[1:], h[:-1]) ** 2, 0.0)
    beside = found.copy()
    beside[1:] = np.maximum(beside[1:], found[:-1])
    beside[:-1] = np.maximum(beside[:-1], found[1:])
    return beside


def _median(t: np.ndarray, x: np.ndarray) -> float:
    """Value that x is below of for half of the time."""
    h = np.diff(t)
    time = np.append(h, 0.0) + np.append(0.0, h)
    order = np.argsort(x)
    passed = np.cumsum(time[order])
    return float(x[order][np.searchsorted(passed, 0.5 * passed[-1])])


def _flag(
    element: Any, limit: Limit, said: str, t: np.ndarray, x: np.ndarray, far: np.ndarray, allowed: np.ndarray
) -> Flag:
    """The flag of one range that was left."""
    outside = far > allowed
    worst = int(np.argmax(np.where(outside, far, 0.0)))
    total = float(np.sum(np.diff(t) * 0.5 * (outside[1:].astype(float) + outside[:-1])))
    first = float(t[int(np.argmax(outside))])
    return Flag(element.name, element.kind, said, limit.unit, first, total, float(x[worst]), float(t[worst]))


def input_values(model: Model, signals: Signals, t: np.ndarray, v: np.ndarray, behind: np.ndarray) -> np.ndarray:
    """Values of all inputs at times t, shape (n, n_u); behind[k] takes the one behind a jump.

    Those that an element drives are rates of its coordinates, in v, shape (n, n_q).
    """
    work = model.new_work()
    table, packed, u = Packed(signals), Packed(work), np.zeros((len(t), len(model.layout.input_index)))
    for k in range(len(t)):
        evaluate_inputs(table.table, float(t[k]), not behind[k], packed.table)
        u[k] = work.u[:, 0]
    model.layout.put_driven(u, v)
    return u
