"""What is asked of one random mechanism: it runs, it keeps its energy, and two methods agree."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from dms_core import Model, Simulation, SolverOptions, Trajectory
from tests.dms_core.mechanisms import overconstrained, planar
from tests.dms_core.mechanisms.sketch import Sketch, moving, started

FAMILIES: tuple[Callable[[np.random.Generator], Sketch], ...] = planar.FAMILIES + overconstrained.FAMILIES
RTOL = {"bdf2": 1e-6, "sdirk2": 1e-5}
TIGHTER = 0.1
"""Share of these where the methods differ by more than they should."""
NEIGHBOUR = 1e-4
"""Relative change of the start velocities of the neighbouring solution."""
PARTED = 0.05
"""Distance of a body from itself in the neighbouring solution at which the two have parted [m]."""
RESOLVED = 1e-4
"""Difference of positions that is put down to the tolerances alone [m]."""


ENERGY = 1e-3
"""Largest change of energy over the largest kinetic energy that counts as kept; 1e-4 is usual at these tolerances."""
FINE = 2.0
"""Largest distance of the two methods, over that of the neighbours or RESOLVED, that counts as agreement."""


class Row(NamedTuple):
    """One line of the table."""

    seed: int
    family: str
    bodies: int
    rows: int
    rank: int
    freedoms: int
    share: float
    """Tolerances, over RTOL."""
    bdf2: str
    """How the run of BDF2 ended, and that of SDIRK2."""
    sdirk2: str
    reached: float
    """Time that both reached [s]."""
    steps: int
    """Of BDF2."""
    energy: float
    """Largest change of the total energy of the BDF2 run, over the largest kinetic energy."""
    parted: float
    """Time at which the neighbouring solution has parted [s]."""
    difference: float
    """Largest distance of the two methods before that, over that of the neighbours or RESOLVED."""
    said: str
    """Message of a run that stopped."""

    @property
    def finished(self) -> bool:
        """Both methods reached the end."""
        return self.bdf2 == self.sdirk2 == "SUCCESS"


def mechanism(seed: int) -> tuple[Model, Model]:
    """The random mechanism of a seed with its start velocities, and with those of its neighbour."""
    rng = np.random.default_rng(seed)
    sketch = FAMILIES[seed % len(FAMILIES)](rng)
    turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    still = Model(sketch.turned(turn * np.sign(np.linalg.det(turn))).system(rng))
    v = moving(still, rng)
    model = Model(started(still, v), like=still)
    return model, Model(started(still, (1.0 + NEIGHBOUR) * v), like=model)


def energy(run: Trajectory) -> tuple[np.ndarray, np.ndarray]:
    """Total and kinetic energy [J] at the steps of a run, each of shape (n,)."""
    bodies, g = run.model.system.bodies, np.array([0.0, -9.81, 0.0])
    kinetic, potential = np.zeros(len(run.t)), np.zeros(len(run.t))
    for k, body in enumerate(bodies):
        r, p = run.q[:, 7 * k : 7 * k + 3], run.q[:, 7 * k + 3 : 7 * k + 7]
        dr, dp = run.v[:, 7 * k : 7 * k + 3], run.v[:, 7 * k + 3 : 7 * k + 7]
        omega = 2.0 * (p[:, :1] * dp[:, 1:] - dp[:, :1] * p[:, 1:] - np.cross(p[:, 1:], dp[:, 1:]))
        inertia = body.inertia_matrix()
        kinetic += 0.5 * body.mass * np.sum(dr**2, axis=1) + 0.5 * np.einsum("ki,ij,kj->k", omega, inertia, omega)
        potential -= body.mass * r @ g
    return kinetic + potential, kinetic


def _positions(run: Trajectory, times: np.ndarray) -> np.ndarray:
    """Centres of mass, shape (times, 3 bodies)."""
    places = [7 * k + i for k in range(len(run.model.system.bodies)) for i in range(3)]
    return run.at(times).q[:, places]


def study(seed: int, t_end: float = 5.0) -> Row:
    """Run the mechanism of a seed by both methods, and its neighbour by BDF2; once more, tighter, where they differ.

    The neighbour differs along the motion only; in a chaotic one errors of the methods may grow faster than that.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        models = mechanism(seed)
        row = _compared(seed, *models, t_end, 1.0)
        return row if row.difference < FINE else _compared(seed, *models, t_end, TIGHTER)


def _compared(seed: int, model: Model, neighbour: Model, t_end: float, share: float) -> Row:
    """The row of a mechanism, with tolerances of this share of RTOL."""
    runs = {}
    for method, rtol in RTOL.items():
        simulation = Simulation(model, SolverOptions(rtol=share * rtol, method=method))  # type: ignore[arg-type]
        simulation.advance(t_end)
        runs[method] = simulation.trajectory()
    beside = Simulation(neighbour, SolverOptions(rtol=share * RTOL["bdf2"]))
    beside.advance(t_end)
    other = beside.trajectory()
    total, kinetic = energy(runs["bdf2"])
    reached = min(run.t[-1] for run in (*runs.values(), other))
    times = np.linspace(0.0, reached, 501)
    bdf2, sdirk2, near = (_positions(run, times) for run in (*runs.values(), other))
    apart = np.maximum.accumulate(np.abs(near - bdf2).max(axis=1))
    together = apart < PARTED
    difference = np.abs(sdirk2 - bdf2).max(axis=1) / np.maximum(apart, RESOLVED)
    parted = reached if together.all() else times[~together][0]
    return Row(
        seed, model.system.name, len(model.system.bodies), model.n_phi, len(model.start.active),
        model.degrees_of_freedom, share, runs["bdf2"].result.name, runs["sdirk2"].result.name,
        float(min(runs[m].t[-1] for m in RTOL)), runs["bdf2"].stats.steps,
        float(np.abs(total - total[0]).max() / kinetic.max()), float(parted), float(difference[together].max()),
        " | ".join(run.message for run in runs.values() if not run.success),
    )  # fmt: skip
