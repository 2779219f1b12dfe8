"""Where a run left the ranges that its elements are meant for (`Limit` in model/element.py).

A rope of fixed length that pushes, a muscle whose fibre is on its stop: the equations have a solution there, and a run
goes on, but its result says when, which element, and how far.
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
            allowed = limit.share * np.abs(x).max(initial=0.0)
            for far, said in ((limit.low - x, limit.below), (x - limit.high, limit.above)):
                if said and (far > allowed).any():
                    flags.append(_flag(element, limit, said, t, x, far, allowed))
        return tuple(flags)


def _flag(element: Any, limit: Limit, said: str, t: np.ndarray, x: np.ndarray, far: np.ndarray, allowed: float) -> Flag:
    """The flag of one range that was left."""
    outside, worst = far > allowed, int(np.argmax(far))
    total = float(np.sum(np.diff(t) * 0.5 * (outside[1:].astype(float) + outside[:-1])))
    first = float(t[int(np.argmax(outside))])
    return Flag(element.name, element.kind, said, limit.unit, first, total, float(x[worst]), float(t[worst]))


def input_values(model: Model, signals: Signals, t: np.ndarray, behind: np.ndarray) -> np.ndarray:
    """Values of all inputs at times t, shape (n, n_u); behind[k] takes the one behind a jump."""
    work = model.new_work()
    table, packed, u = Packed(signals), Packed(work), np.zeros((len(t), len(model.layout.input_index)))
    for k in range(len(t)):
        evaluate_inputs(table.table, float(t[k]), not behind[k], packed.table)
        u[k] = work.u[:, 0]
    return u
