"""A worn device's estimate of what others put on the elbow, and what its sensors cannot tell."""

from __future__ import annotations

import numpy as np
import pytest

from dms_core import Model, SolverOptions, World
from dms_core.errors import InputError
from dms_core.estimation import EstimatedInput, FilterSettings, KalmanFilter
from dms_core.estimation.observability import local_observability
from dms_core.model import Constant, Input, LumpedLoad, System
from exo_env.ecosystem.person import Person
from exo_env.estimation import ElbowEstimator, NominalElbow
from exo_env.estimation.elbow_estimator import ANGLE, GUIDE_FORCE, RATE
from exo_env.estimation.nominal_elbow import GRIP, NET


@pytest.fixture(scope="module")
def estimator() -> ElbowEstimator:
    return ElbowEstimator(NominalElbow(), 0.01)


def readings(world: World, rng: np.random.Generator) -> dict[str, float]:
    """What the sensors show, with the noise of the device."""
    y = dict(zip((name for name, _ in world.model.layout.outputs), world.read(), strict=True))
    noise = {ANGLE: 4e-4, RATE: 0.02, GUIDE_FORCE: 0.5}
    return {name: float(y[name] + deviation * rng.normal()) for name, deviation in noise.items()}


def test_moment_of_a_heavier_arm_that_is_pushed(estimator):
    """Another body, another solver, and a moment that grows to 2 Nm against a device that holds it but for a rest."""
    world = World(Model(NominalElbow(person=Person(body_mass=85.0)).system()), SolverOptions(rtol=1e-7))
    rng, errors, moments = np.random.default_rng(6), [], []
    world.settle()
    found = estimator.reset(readings(world, rng))
    for k in range(150):
        push = 2.0 * np.sin(0.02 * k)
        rest = 0.05 * np.sin(0.15 * k)
        world.set_input(GRIP, -push)
        world.set_input(NET, rest)
        world.advance(0.01 * (k + 1))
        found = estimator.update(readings(world, rng))
        if k > 50:
            errors.append(found.others - push - rest)
            moments.append(push + rest)
    rms = np.sqrt(np.mean(np.square(moments)))
    # Noise of the cuff is 0.08 Nm a reading, that of the acceleration as much again.
    assert np.sqrt(np.mean(np.square(errors))) < 0.05 * rms
    assert estimator.lost == 0


def test_a_start_at_any_angle(estimator):
    for angle in (0.3, 1.0, 2.2):
        estimator.reset({ANGLE: angle, RATE: 0.0, GUIDE_FORCE: 0.0})
        kalman = estimator.filter.kalman
        y = kalman.read(estimator.filter.belief())
        assert y[kalman.estimated.outputs[ANGLE]] == pytest.approx(angle, abs=2e-3)


def test_what_a_start_needs():
    fresh = ElbowEstimator(NominalElbow(), 0.01)
    with pytest.raises(InputError, match="Expected 'reset' with first readings"):
        fresh.update({ANGLE: 0.8})
    for given in ({}, {ANGLE: float("nan")}):
        with pytest.raises(InputError, match=f"'{ANGLE}': Expected the angle to begin with"):
            fresh.reset(given)


def test_readings_that_are_missing_widen_the_deviation(estimator):
    start = {ANGLE: 0.8, RATE: 0.0, GUIDE_FORCE: 3.0}
    estimator.reset(start)
    for _ in range(50):
        known = estimator.update(start)
    for _ in range(20):
        blind = estimator.update({**start, GUIDE_FORCE: float("nan")})
    assert blind.deviation > 1.5 * known.deviation


def test_muscles_and_a_load_cannot_be_told_apart_by_the_device():
    """A moment of muscles and a weight in the hand: from hinge and cuff only their sum is known."""
    own = NominalElbow().system()
    load = LumpedLoad(
        name="weight in hand", body="forearm", point=(0.0, -0.3, 0.0), force=(0.0, -1.0, 0.0), input="load"
    )
    both = System(
        own.name, bodies=own.own("bodies"), constraints=own.own("constraints"), forces=[*own.own("forces"), load],
        sensors=own.own("sensors"), inputs=[*own.own("inputs"), Input(name="load", signal=Constant(value=0.0))],
    )  # fmt: skip
    channels = {name: {"deviation": d} for name, d in {ANGLE: 4e-4, RATE: 0.02, GUIDE_FORCE: 0.5}.items()}
    inputs = {name: EstimatedInput(deviation=x, walk=1.0) for name, x in {NET: 5.0, GRIP: 5.0, "load": 20.0}.items()}
    settings = FilterSettings(channels=channels, inputs=inputs)
    found = local_observability(KalmanFilter(Model(both), settings), 10)
    weakest = found.directions[-1]
    told = {name for name, x in weakest.share.items() if abs(x) > 0.1}
    assert {"input.net", "input.load"} <= told
    # Over 0.1 s at rest nothing but their sum moves the arm.
    np.testing.assert_allclose([d.singular_value for d in found.directions[:-1]], [2200, 790, 210, 150], rtol=0.05)
    assert weakest.singular_value < 1e-9 * found.directions[0].singular_value
