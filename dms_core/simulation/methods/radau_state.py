"""What a world carries for the Radau IIA method beside its State: stages, their past, the complex system."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from dms_core.assembly.tables import Tables
from dms_core.compiled.arena import Packed, fields
from dms_core.linear.lu import storage
from dms_core.simulation.methods.radau_constants import STAGES


class Control(NamedTuple):
    """Places in `RadauState.control`."""

    h_before: int
    """Size of the last step whose stages are in `past_*` [s]."""
    error_before: int
    """Weighted local error of that step; 0 behind a start."""
    rejected: int
    """1 where the last attempt erred too much."""
    wanted: int
    """Size that the next step should have [s]."""


class RadauState(NamedTuple):
    """Arrays of one world; all are empty where another method runs. Stages are rows."""

    control: np.ndarray
    q: np.ndarray
    """Stage values, shape (3, n_q)."""
    v: np.ndarray
    lam: np.ndarray
    mu: np.ndarray
    past_q: np.ndarray
    """Begin and stages of the last accepted step, shape (4, n_q): the collocation polynomial."""
    past_v: np.ndarray
    past_lam: np.ndarray
    """Stages of that step, shape (3, n_phi)."""
    past_mu: np.ndarray
    residual: np.ndarray
    """-(r1, r2, r3, r4) of each stage in what is solved for, shape (3, 2 n + 2 k)."""
    values: np.ndarray
    """The complex system: its matrix, work array, right-hand side and solution, as pairs of reals."""
    work: np.ndarray
    b: np.ndarray
    x: np.ndarray


CONTROL, RADAU = fields(Control), fields(RadauState)


def _arrays(n: int, m: int, size: int, lu: tuple[int, int]) -> RadauState:
    """Arrays for n coordinates, m rows, a system of `size` unknowns whose matrix and work array have lengths `lu`."""
    stages, past = {"q": n, "v": n, "lam": m, "mu": m}, {"past_lam": m, "past_mu": m}
    return RadauState(
        control=np.zeros(len(CONTROL)),
        **{name: np.zeros((STAGES, width)) for name, width in (stages | past).items()},
        **{name: np.zeros((1 + STAGES, n)) for name in ("past_q", "past_v")},
        residual=np.zeros((STAGES, size)),
        values=storage(2 * lu[0]) if lu[0] else np.zeros(0),
        work=storage(2 * lu[1]) if lu[1] else np.zeros(0),
        b=np.zeros(2 * size),
        x=np.zeros(2 * size),
    )  # fmt: skip


NOT_USED = Packed(_arrays(0, 0, 0, (0, 0)))
"""Of all worlds that another method runs; nothing is written into it."""


def new_radau_state(tables: Tables, n_phi: int, used: bool) -> Packed:
    """A packed RadauState: fresh arrays, or the empty ones where they are not used."""
    if not used:
        return NOT_USED
    lu, size = tables.newton_lu, 2 * (len(tables.free) + len(tables.active))
    return Packed(_arrays(len(tables.second), n_phi, size, (lu.size, lu.work_size)))
