"""The rigid problems of this folder by Radau IIA: positions to 1e-8, constraints to 1e-10 at both levels.

Every reference is a closed form, or holds twelve digits (tests/reference/dae, test_rigid_bodies.py); none is a run of
this project's. Double pendulum, tumbling body at 2 rad/s, heavy top and Andrews' squeezer in the form of the IVP test
set are in test_high_order.py, with tolerances of their own.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import pytest

from dms_core import Model, SolverOptions, System, Trajectory, simulate
from dms_core.model.geometry.frames import quaternion, rotation_matrix
from dms_core.model.geometry.quaternions import product
from tests.dms_core.literature import test_point_masses as masses
from tests.dms_core.literature import test_rigid_bodies as rigid
from tests.dms_core.literature.chain import chain, tip
from tests.dms_core.literature.motions import BODY, tumbling_positions
from tests.dms_core.literature.test_andrews import LENGTH, andrews, problem
from tests.dms_core.model.constraints.test_drum_rope import TestDrumRope as Drum

pytestmark = pytest.mark.filterwarnings("ignore:.*read by no element")


class Problem(NamedTuple):
    """A run, and its largest error of a position (m, rad or Euler parameters)."""

    run: Callable[[SolverOptions], Trajectory]
    error: Callable[[Trajectory], float]
    rtol: float
    steps: int
    """A tenth more than was found."""
    atol: float | None = None


def solved(build: Callable[[], System | Model], end: float) -> Callable[[SolverOptions], Trajectory]:
    return lambda options: simulate(build(), end, options).check()


def off(found: np.ndarray, wanted: np.ndarray) -> float:
    return float(np.abs(found - wanted).max())


def pendulum_error(run: Trajectory) -> float:
    rows = masses.PENDULUM_ROWS
    return off(run.at(rows[:, 0]).q[:, :2], rows[:, 1:3])


def uniform(name: str, acceleration: float) -> Callable[[Trajectory], float]:
    """Of a uniform acceleration from rest at -1 m."""
    t = np.linspace(0.0, 0.5, 51)
    return lambda run: off(run.at(t).coordinate(f"{name}.y"), -1.0 + 0.5 * acceleration * t**2)


def drum_error(run: Trajectory) -> float:
    a = (Drum.M1 - Drum.M2) * 9.81 / (Drum.M1 + Drum.M2 + Drum.J / Drum.R**2)
    t = np.linspace(0.0, 1.0, 51)
    return off(run.at(t).coordinate("left.y"), -1.0 - 0.5 * a * t**2)


def oscillation(case: str, steps: int) -> Problem:
    system, rows = masses.oscillating(case)
    error = lambda run: off(run.at(rows[:, 0]).coordinate("mass.x") - 1.0, rows[:, 1])  # noqa: E731
    return Problem(solved(lambda: system, rows[-1, 0]), error, 1e-10, steps)


def tip_error(n: int) -> Callable[[Trajectory], float]:
    return lambda run: off(tip(run.q[-1])[:2], np.array(rigid.TIPS[n]))


def four_bar_error(run: Trajectory) -> float:
    t = np.linspace(0.0, 2.0, 41)
    y = run.sensors(t)
    return off(np.column_stack([y["pin.position.x"], y["pin.position.y"]]), rigid.coupler_end(t))


def free_error(positions: Callable[[np.ndarray], np.ndarray]) -> Callable[[Trajectory], float]:
    """Of all coordinates of a free body, whose centre moves evenly."""
    t = np.linspace(0.1, 3.0, 30)

    def error(run: Trajectory) -> float:
        q = run.at(t).q
        return max(off(q[:, :3], t[:, None] * [0.1, 0.2, 0.3]), off(q[:, 3:], positions(t)))

    return error


FAST = np.array([0.05, 6.0, 0.05])
J1, J3, SPUN = 0.02, 0.035, np.array([1.0, 0.0, 4.0])


def precession(t: np.ndarray) -> np.ndarray:
    """Euler parameters of the symmetric top: p = exp(L t / J1) p0 exp(e3 (1 - J3 / J1) w3 t)."""
    L = rotation_matrix(rigid.TILTED) @ (np.array([J1, J1, J3]) * SPUN)
    found = []
    for x in t:
        space = quaternion(L, float(np.linalg.norm(L)) / J1 * x)
        body = quaternion((0.0, 0.0, 1.0), (1.0 - J3 / J1) * SPUN[2] * x)
        found.append(product(product(tuple(space), tuple(rigid.TILTED)), tuple(body)))
    return np.array(found)


def driven_error(run: Trajectory) -> float:
    t = np.linspace(0.0, 2.0, 41)
    theta = rigid.OFFSET + rigid.AMPLITUDE * np.sin(2.0 * np.pi * rigid.FREQUENCY * t)
    wanted = np.zeros((41, 7))
    wanted[:, 0], wanted[:, 1] = 0.5 * np.cos(theta), 0.5 * np.sin(theta)
    wanted[:, 3], wanted[:, 6] = np.cos(0.5 * theta), np.sin(0.5 * theta)
    return off(run.at(t).q, wanted)


def squeezer_error(run: Trajectory) -> float:
    """Of the crank's angle, 33.8 rad at the end."""
    rows = np.array(problem("iftomm_A03_andrews")["reference"]["rows"])
    beta = np.unwrap(run.sensors(np.linspace(0.0, 0.05, 2001))["beta.angle"])
    return off(beta[::50], rows[:, 1])


OSCILLATIONS = {"free": 390, "under": 330, "critical": 142, "over": 130, "resonance": 475, "undamped_resonance": 490}
CHAINS = {1: 265, 2: 460, 4: 620, 8: 565}
PROBLEMS = {
    "pendulum A01": Problem(solved(masses.pendulum, 10.0), pendulum_error, 1e-11, 2_420),
    "squeezer A03": Problem(
        solved(lambda: andrews("iftomm_A03_andrews"), 0.05), squeezer_error, 1e-11, 2_500, 1e-11 * LENGTH
    ),
    "Atwood, massless pulley": Problem(
        solved(masses.over_a_pulley, 0.5), uniform("m1", masses.ATWOOD["b_massless"]["acceleration"]), 1e-8, 9
    ),
    "Atwood, movable pulley": Problem(
        solved(masses.over_a_movable_pulley, 0.5),
        uniform("load", masses.ATWOOD["c_movable"]["acceleration_M_up"]), 1e-8, 9,
    ),
    "Atwood, massive drum": Problem(lambda options: Drum().atwood(1.0, options), drum_error, 1e-8, 116),
    **{f"spring and mass, {case}": oscillation(case, n) for case, n in OSCILLATIONS.items()},
    **{
        f"chain of {n}": Problem(solved(lambda n=n: chain(n), 1.0), tip_error(n), 1e-11, steps)
        for n, steps in CHAINS.items()
    },
    "four-bar": Problem(solved(rigid.four_bar, 2.0), four_bar_error, 1e-9, 63),
    "free body at 6 rad/s": Problem(
        solved(lambda: rigid.free_body(tuple(BODY), tuple(FAST)), 3.0),
        free_error(lambda t: tumbling_positions(t, FAST, rigid.TILTED)[:, 3:]), 1e-11, 445,
    ),
    "symmetric top": Problem(
        solved(lambda: rigid.free_body((J1, J1, J3), tuple(SPUN)), 3.0), free_error(precession), 1e-12, 590
    ),
    "driven rod": Problem(solved(rigid.driven_rod, 2.0), driven_error, 1e-9, 157),
}  # fmt: skip


@pytest.mark.parametrize("name", PROBLEMS)
def test_positions_to_eight_digits(name):
    """From 2e-16 (Atwood) to 2e-9 (top) are found, see docs/digits.md."""
    case = PROBLEMS[name]
    run = case.run(SolverOptions(rtol=case.rtol, atol=case.atol, method="radau5"))
    assert case.error(run) < 1e-8
    assert run.stats.largest_phi < 1e-10 and run.stats.largest_phi_v < 1e-10
    assert run.stats.steps <= case.steps
