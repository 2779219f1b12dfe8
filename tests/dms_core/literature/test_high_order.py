"""Radau IIA for digits: errors below 1e-8, constraints below 1e-10, against references of twelve digits."""

from __future__ import annotations

import numpy as np
import pytest

from dms_core import Model, SolverOptions, System, Trajectory, simulate
from dms_core.model import RigidBody
from tests.dms_core.literature.motions import BODY, MOTIONS, SPIN, Motion, tumbling_positions, tumbling_spin
from tests.dms_core.literature.test_andrews import andrews, problem
from tests.dms_core.literature.test_arm26 import columns, forward_model

STEPS = {"double pendulum": 11_000, "tumbling body": 320, "heavy top": 10_000}
"""A tenth more than was found."""
RTOL = {"double pendulum": 1e-13, "tumbling body": 1e-10, "heavy top": 1e-12}


def radau(rtol: float, **options) -> SolverOptions:
    return SolverOptions(rtol=rtol, method="radau5", **options)


def holds_constraints(run: Trajectory) -> bool:
    """Both levels, over the whole run."""
    return run.stats.largest_phi < 1e-10 and run.stats.largest_phi_v <= 1e-10


@pytest.mark.parametrize("name", MOTIONS)
def test_motions_to_eight_digits(name):
    """7.7e-9, 1.4e-9 and 3.8e-9 are found (m, or Euler parameters)."""
    motion: Motion = MOTIONS[name]
    run = simulate(motion.model(), motion.times[-1], radau(RTOL[name])).check()
    assert np.abs(run.at(motion.times).q - motion.positions(motion.times)).max() < 1e-8
    assert holds_constraints(run)
    assert run.stats.steps < STEPS[name]


def test_the_closed_form_of_the_tumbling_body():
    """Jacobi's functions satisfy Euler's equations and start where the body starts; and attitude turns L nowhere."""
    times, h = np.linspace(0.0, 10.0, 41), 1e-5
    np.testing.assert_allclose(tumbling_spin(np.zeros(1))[0], SPIN, atol=1e-14)
    w = tumbling_spin(times)
    rates = (tumbling_spin(times + h) - tumbling_spin(times - h)) / (2.0 * h)
    # Central differences err by h^2 and by rounding over h.
    np.testing.assert_allclose(BODY * rates, -np.cross(w, BODY * w), atol=1e-10)
    assert w[:, 1].min() < -1.9
    assert np.abs(np.linalg.norm(tumbling_positions(times)[:, 3:], axis=1) - 1.0).max() < 1e-11


def test_andrews_to_nine_digits():
    """Of 15.8 rad; rates near 1e3, accelerations near 5e5 and forces near 200 N as far as the reference has them."""
    wanted = np.array(problem("ivp_andrews_index3")["reference"]["recomputed_y"])
    run = simulate(andrews("ivp_andrews_index3"), 0.03, radau(1e-11, atol=1e-12)).check()
    y, turn = {name: values[0] for name, values in run.sensors([0.03]).items()}, 2.0 * np.pi
    for name, k, offset in (("beta", 0, 0.0), ("gamma", 2, -turn / 4), ("delta", 4, 0.0), ("epsilon", 6, -turn / 4)):
        error = (y[f"{name}.angle"] - wanted[k] - offset + turn / 2) % turn - turn / 2
        # 2.8e-10 are found in the crank's angle, 3e-12 in the others.
        assert abs(error) < 1e-9, name
        assert abs(y[f"{name}.rate"] - wanted[7 + k]) < 1e-6
        assert abs(y[f"{name}.acceleration"] - wanted[14 + k]) < 1e-2
    np.testing.assert_allclose([y["E.Fx"], y["E.Fy"]], wanted[21:23], atol=1e-6)
    assert holds_constraints(run)
    # BDF2 takes 86,000 for 3e-7.
    assert run.stats.steps < 1300


@pytest.mark.parametrize(("run", "flexors"), [("A", 0.15), ("A2", 0.30)])
def test_arm26_as_far_as_its_reference_goes(run, flexors):
    """4e-8 rad; the error in time of OpenSim's own run is of that size."""
    rows = columns(f"arm26_forward_{run}")
    mine = simulate(forward_model(flexors), rows["time_s"][-1], radau(1e-11)).check()
    y = mine.sensors(rows["time_s"])
    np.testing.assert_allclose(y["elbow.angle"], rows["elbow_flexion_rad"], atol=4e-8)
    assert mine.stats.steps < 500
    assert holds_constraints(mine)


def test_steps_of_bdf2_depend_on_the_state_alone():
    """A body that tumbles at 6 rad/s for 10 s: 3e-3 and 5500 steps are found, 1e-2 where steps grow late."""
    body = RigidBody(name="body", mass=1.0, inertia=tuple(BODY), angular_velocity=(0.05, 6.0, 0.05))
    model, times = Model(System("tumbling", bodies=[body])), np.linspace(0.0, 10.0, 11)
    exact = simulate(model, 10.0, radau(1e-12)).check()
    run = simulate(model, 10.0, SolverOptions(rtol=1e-6)).check()
    assert np.abs(run.at(times).q - exact.at(times).q).max() < 6e-3
    assert run.stats.steps < 6000
    sizes = np.log(np.diff(run.t)[50:-5]) / np.log(1.4)
    # All but those that Newton's method or the end of the run has cut.
    assert np.mean(np.abs(sizes - np.round(sizes)) < 1e-6) > 0.9
