"""Derivatives of whole runs: against differences over the recorded steps, closed forms, forward against adjoint."""

from __future__ import annotations

import math

import numpy as np
import pytest

from dms_core import Model, SolverOptions
from dms_core.errors import InputError
from dms_core.model import Gravity, Point, PointMass, System
from dms_core.sensitivity import record as record_module
from dms_core.sensitivity.nodes import Number
from dms_core.sensitivity.record import RecordedWorld
from dms_core.sensitivity.run import By, Output, Sensitivity, Shift, Start
from dms_core.simulation.events import Crossing
from tests.dms_core.analyses.mechanisms import spring_mass_chain
from tests.dms_core.sensitivity.again import difference
from tests.dms_core.sensitivity.systems import SYSTEMS, controlled, pendulum

METHODS = ["sdirk2", "bdf2", "radau5"]
TOLERANCE = 1e-7
"""Of the largest derivative of an output: differences are good to about 1e-9, and those of a declared number, whose
direction is itself a difference, to 1e-9 of the number's own effect."""
BENT = {"arm": 1e-5}
"""As TOLERANCE where curves of muscles bend: their second derivatives jump, so that a difference errs with its step."""
STIFF = {"flexible": 10.0}
"""Times SAME: the bar is stiff along its axis, so that rounding counts for more."""
SAME = {"sdirk2": 1e-10, "bdf2": 1e-10, "radau5": 3e-10}
"""Forward and adjoint do the same sums in another order; Radau IIA solves three stages at a time."""


def _run(model: Model, method: str, times=(0.05, 0.12), settings=(), rtol: float = 1e-6) -> RecordedWorld:
    """A run that lands at each time and then sets what belongs to it."""
    world = RecordedWorld(model, SolverOptions(rtol=rtol, method=method))
    for k, t in enumerate(times):
        world.advance(t)
        for name, value in settings[k : k + 1]:
            world.set_input(name, value)
    return world


def _assert_equal(run: Sensitivity, steps: dict[By, float], tolerance: float = TOLERANCE, more: float = 1.0) -> None:
    forward, adjoint = run.forward(), run.adjoint()
    size = np.abs(forward).max(axis=1, keepdims=True) + 1e-300
    assert np.abs((forward - adjoint) / size).max() < more * SAME[run.record.options.method]
    for k, x in enumerate(run.by):
        expected = difference(run, x, steps[x])
        scale = np.abs(expected).max() + 1e-9
        assert np.abs(forward[:, k] - expected).max() < tolerance * scale, (x, forward[:, k], expected)


CASES = {
    "pendulum": (
        (Output("bend.angle"), Output("bend.acceleration"), Output("q.lower.y"), Output("v.lower.x", 0.05),
         Output("bend.rate", integral=True)),
        {Number("upper", "mass"): 1e-3, Number("elbow", "point_i.0"): 1e-4, Number("weight", "acceleration.1"): 1e-2,
         Start("q.lower.x"): 1e-4, Start("v.lower.y"): 1e-3, Shift("moment"): 1e-3, Shift("size", 0.05): 1e-3},
    ),
    "crank_and_rocker": (
        (Output("crank_angle.angle"), Output("rocker_angle.rate"), Output("rocker_angle.angle", integral=True)),
        {Number("rocker", "mass"): 1e-3, Number("crank_pin", "point_i.0"): 1e-4, Shift("size"): 1e-3},
    ),
    "arm": (
        (Output("v.forearm.x"), Output("q.agonist_motor.tension"), Output("q.BIClong.activation", 0.05)),
        {Number("forearm", "mass"): 1e-5, Number("pid", "kp"): 0.1, Number("BIClong", "max_isometric_force"): 1e-2,
         Shift("assistance", 0.05): 1e-4},
    ),
    "flexible": ((Output("v.link.tip.y"),), {Number("weight", "acceleration.1"): 1e-2, Shift("load"): 1e-2}),
}  # fmt: skip


LONG = {("arm", "radau5"), ("flexible", "radau5")}
"""Half a minute each, as Radau IIA is differentiated in Python: among the slow tests."""
RUNS = [
    pytest.param(name, method, id=f"{name}-{method}", marks=[pytest.mark.slow] * ((name, method) in LONG))
    for name in CASES
    for method in METHODS
]


@pytest.mark.parametrize(("name", "method"), RUNS)
def test_derivatives_equal_differences_over_the_recorded_steps(name, method):
    of, steps = CASES[name]
    rtol = 1e-4 if name == "flexible" else 1e-6
    _assert_equal(
        Sensitivity(_run(SYSTEMS[name](), method, (0.05, 0.1), rtol=rtol), of, tuple(steps)),
        steps,
        BENT.get(name, TOLERANCE),
        STIFF.get(name, 1.0),
    )


@pytest.mark.parametrize("method", METHODS)
def test_through_jumps_of_inputs(method):
    world = _run(pendulum(), method, (0.04, 0.08, 0.12), [("moment", 2.0), ("moment", -1.0)])
    steps = {Shift("moment", 0.0, 0.04): 1e-3, Shift("moment", 0.04, 0.08): 1e-3, Shift("moment", 0.08): 1e-3,
             Number("lower", "mass"): 1e-3}  # fmt: skip
    of = (Output("bend.angle"), Output("bend.acceleration", 0.08), Output("bend.acceleration", integral=True))
    run = Sensitivity(world, of, tuple(steps))
    _assert_equal(run, steps)
    # A run knows nothing of what comes later.
    np.testing.assert_array_equal(run.adjoint()[1, 2], 0.0)


@pytest.mark.parametrize("method", METHODS)
def test_free_fall(method):
    """x = x0 + v0 t + g t^2 / 2: SDIRK2 is exact, BDF2 too behind its start."""
    g, end = 9.81, 0.4
    model = Model(System(
        bodies=[PointMass(name="ball", mass=2.0)], forces=[Gravity(name="weight", acceleration=(0.0, -g, 0.0))],
        sensors=[Point(name="place", body="ball")],
    ))  # fmt: skip
    world = _run(model, method, (end,))
    by = (Number("weight", "acceleration.1"), Number("ball", "mass"), Start("q.ball.y"), Start("v.ball.y"))
    found = Sensitivity(world, (Output("q.ball.y"), Output("v.ball.y")), by).adjoint()
    expected = [[0.5 * end**2, 0.0, 1.0, end], [end, 0.0, 0.0, 1.0]]
    np.testing.assert_allclose(found, expected, atol=1e-9)


@pytest.mark.parametrize("method", METHODS)
def test_spring_and_mass(method):
    """x = x0 cos(w t) with w^2 = 2 k / m: dx/dm = x0 t sin(w t) w / 2 m, dx/dk = -x0 t sin(w t) w / 2 k."""
    mass, stiffness, x0, end = 2.0, 150.0, 0.1, 0.6
    model = Model(spring_mass_chain(1, mass, stiffness))
    world = RecordedWorld(model, SolverOptions(rtol=1e-8, method=method))
    k = model.layout.index["mass0.x"]
    world.state.q[k] += x0
    world.advance(end)
    by = (Number("mass0", "mass"), Number("spring0", "stiffness"), Start("q.mass0.x"))
    found = Sensitivity(world, (Output("q.mass0.x"),), by).adjoint()[0]
    w = math.sqrt(2.0 * stiffness / mass)
    slope = 0.5 * x0 * end * math.sin(w * end) * w
    # Of two springs one is moved: half of the whole.
    expected = [slope / mass, -0.5 * slope / stiffness, math.cos(w * end)]
    # That of the method itself: local errors of 1e-9 over some hundred steps.
    np.testing.assert_allclose(found, expected, rtol=3e-5)


def test_what_lies_between_kept_states_is_computed_again(monkeypatch):
    """The bound on memory changes nothing."""
    model = pendulum()
    of, by = (Output("bend.angle"), Output("bend.rate", 0.05)), (Number("upper", "mass"), Start("q.lower.x"))
    for method in METHODS:
        whole = Sensitivity(_run(model, method), of, by)
        with monkeypatch.context() as m:
            m.setattr(record_module, "MOST_STATES", 4)
            few = _run(model, method)
        assert few.stride > 1 and len(few._kept) <= 5
        # States that are computed again are those of the run within the tolerance of Newton's method.
        np.testing.assert_allclose(Sensitivity(few, of, by).adjoint(), whole.adjoint(), rtol=1e-6)


def test_free_steps_agree_to_the_error_of_the_solver():
    """The derivative over the recorded steps is that of the motion, up to the method's own error."""
    found = []
    for rtol in (1e-5, 1e-7):
        world = _run(pendulum(), "bdf2", (0.3,), rtol=rtol)
        found.append(Sensitivity(world, (Output("bend.angle"),), (Number("upper", "mass"), Shift("moment"))).adjoint())
    np.testing.assert_allclose(found[0], found[1], rtol=1e-3)


def test_value_is_that_of_the_sensors():
    world = _run(controlled(), "sdirk2")
    run = Sensitivity(world, (Output("angle.angle"), Output("q.arm.x")), ())
    world.settle()
    names = [name for name, _ in world.model.layout.outputs]
    expected = [world.read()[names.index("angle.angle")], world.state.q[world.model.layout.index["arm.x"]]]
    np.testing.assert_allclose(run.value(), expected, rtol=1e-12)


def test_wrong_names_and_times_are_refused():
    world = _run(pendulum(), "sdirk2")
    with pytest.raises(InputError, match="'bent' is no output of system 'double pendulum'. Expected a sensor"):
        Sensitivity(world, [Output("bent")], [])
    with pytest.raises(InputError, match="'q.lower.p1' is no independent state"):
        Sensitivity(world, [Output("bend.angle")], [Start("q.lower.p1")])
    with pytest.raises(InputError, match=r"No step of the run ended at t = 0.0512345 s; the nearest"):
        Sensitivity(world, [Output("bend.angle", 0.0512345)], [])
    with pytest.raises(InputError, match="'weight_of' does not exist"):
        Sensitivity(world, [Output("bend.angle")], [Number("upper", "weight_of")])
    with pytest.raises(InputError, match="nothing was computed"):
        Sensitivity(RecordedWorld(pendulum()), [Output("bend.angle")], [])


def test_a_run_that_ends_on_a_crossing_keeps_its_record():
    """The landing tries the last step again and again; the record is that of the run to the same time."""
    landed, plain = (RecordedWorld(pendulum(), SolverOptions(method="sdirk2")) for _ in range(2))
    landed.advance(1.0, stop_at=Crossing("bend.angle", 0, -1.2))
    assert 0.01 < landed.time < 1.0
    plain.advance(landed.time)
    assert landed.times[0] == 0.0
    of, by = [Output("v.lower.x")], [Shift("moment"), Number("lower", "mass")]
    one, other = (Sensitivity(world, of, by).adjoint() for world in (landed, plain))
    # The last steps differ in size, and with them the errors of both at rtol 1e-3.
    np.testing.assert_allclose(one, other, rtol=0.02)
