"""Observability of textbook cases, by derivatives and by runs: what can be told, and the name of what cannot."""

from __future__ import annotations

import numpy as np
import pytest

from dms_core import Model
from dms_core.errors import InputError
from dms_core.estimation import Channel, EstimatedConstant, EstimatedInput, FilterSettings
from dms_core.estimation.filter.kalman import KalmanFilter
from dms_core.estimation.measurement import Measurements
from dms_core.estimation.observability import empirical_observability, local_observability
from dms_core.estimation.record import estimate
from dms_core.model import (
    Constant,
    FirstOrder,
    Gravity,
    Input,
    JointAngle,
    LineGuide,
    LumpedLoad,
    Point,
    PointMass,
    SpringDamper,
    System,
    ThelenMuscle,
)
from dms_core.model.element import Force
from tests.dms_core.analyses.mechanisms import G, hinge, rod
from tests.dms_core.estimation.systems import masses

BOTH = pytest.mark.parametrize("found_by", [local_observability, empirical_observability])


def watched(system: System, *sensors: str, **changes) -> KalmanFilter:
    channels = {name: Channel(deviation=0.01) for name in sensors}
    return KalmanFilter(Model(system), FilterSettings(channels=channels, **changes))


@BOTH
def test_two_masses_are_observable_from_the_position_of_one(found_by):
    found = found_by(watched(masses(), "at0.position.x"), 20)
    assert (found.rank, len(found.names), found.unobservable) == (4, 4, ())


@BOTH
def test_masses_without_a_spring_between_them_are_not(found_by):
    """A free mass that nothing joins to the watched one: its position and its rate are unknown."""
    bodies = [PointMass(name=name, mass=1.0, position=(x, 0.0, 0.0)) for name, x in (("near", 1.0), ("far", 3.0))]
    system = System(
        "two masses", bodies=bodies,
        constraints=[LineGuide(name=f"track {b.name}", body_j=b.name, axis_i=(1.0, 0.0, 0.0)) for b in bodies],
        forces=[SpringDamper(name="spring", body_j="near", stiffness=30.0, free_length=1.0)],
        sensors=[Point(name="at", body="near")],
    )  # fmt: skip
    found = found_by(watched(system, "at.position.x"), 20)
    assert found.rank == 2
    assert all("'far'" in d.words and "'near'" not in d.words for d in found.unobservable)


def two_muscles() -> System:
    """A forearm with two muscles of the same line of action, each with its own activation."""
    path = [{"point": (-0.05, 0.25, 0.0)}, {"body": "arm", "point": (0.04, 0.0, 0.0)}]
    drives, forces = ("one", "two"), list[Force]([Gravity(name="weight", acceleration=(0.0, -G, 0.0))])
    for name in drives:
        forces.append(
            ThelenMuscle(
                name=name, path=path, excitation=f"drive of {name}", max_isometric_force=300.0,
                optimal_fibre_length=0.15,                tendon_slack_length=0.1,
            )
        )  # fmt: skip
    return System(
        "two muscles", bodies=[rod("arm", 0.3, 1.0)],
        constraints=[hinge("elbow", "ground", "arm", (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))],
        forces=forces, sensors=[JointAngle(name="angle", joint="elbow")],
        inputs=[Input(name=f"drive of {name}", signal=Constant(value=0.3)) for name in drives],
    )  # fmt: skip


class TestTwoEqualMuscles:
    def test_they_cannot_be_told_apart_from_the_angle(self):
        found = local_observability(watched(two_muscles(), "angle.angle"), 30)
        weakest = found.directions[-1]
        assert found.unobservable
        assert "one" in weakest.words
        assert "two" in weakest.words
        # Along it the one gains what the other loses.
        assert weakest.share["q.one.activation"] * weakest.share["q.two.activation"] < 0.0

    def test_their_drives_are_refused_by_name_and_direction(self):
        drives = {f"drive of {name}": EstimatedInput(deviation=0.2, time_constant=0.5) for name in ("one", "two")}
        kalman = watched(two_muscles(), "angle.angle", inputs=drives)
        t = 0.01 * np.arange(20)
        record = Measurements(t, ("angle.angle",), np.zeros((20, 1)), {})
        with pytest.raises(InputError, match=r"not observable.*'input.drive of one'.*'input.drive of two' at once"):
            estimate(kalman, record)

    def test_one_of_them_can_be_estimated(self):
        kalman = watched(two_muscles(), "angle.angle", inputs={"drive of one": EstimatedInput(deviation=0.2, walk=0.3)})
        t = 0.01 * np.arange(20)
        assert len(estimate(kalman, Measurements(t, ("angle.angle",), np.zeros((20, 1)), {})).t) == 20


def pushed() -> System:
    """A mass on a track that a force of 1 N pulls back."""
    return System(
        "pushed", bodies=[PointMass(name="m", mass=2.0, position=(1.0, 0.0, 0.0))],
        constraints=[LineGuide(name="track", body_j="m", axis_i=(1.0, 0.0, 0.0))],
        forces=[LumpedLoad(name="pull", body="m", force=(-1.0, 0.0, 0.0))], sensors=[Point(name="at", body="m")],
    )  # fmt: skip


def test_a_mass_is_observable_where_a_known_force_moves_it():
    kalman = watched(pushed(), "at.position.x", constants={"m.mass": EstimatedConstant(deviation=0.3)})
    found = local_observability(kalman, 30)
    assert found.rank == 3
    t = 0.01 * np.arange(200)
    # x = 1 - t^2 / 2 m with a mass of 1.7 kg, 2 kg declared.
    y = 1.0 - 0.5 / 1.7 * t**2 + 0.001 * np.random.default_rng(2).normal(size=200)
    mass, deviation = estimate(kalman, Measurements(t, ("at.position.x",), y[:, None], {})).rest("constant.m.mass")
    assert mass[-1] == pytest.approx(1.7, abs=3.0 * deviation[-1])
    assert deviation[-1] < 0.05


def test_words_of_a_lagging_state():
    system = System(
        "lag", bodies=[PointMass(name="m", mass=1.0)],
        constraints=[LineGuide(name="track", body_j="m", axis_i=(1.0, 0.0, 0.0))],
        forces=[FirstOrder(name="lag", input="u", time_constant=0.2)],
        sensors=[Point(name="at", body="m")], inputs=[Input(name="u", signal=Constant(value=0.0))],
    )  # fmt: skip
    (missing,) = local_observability(watched(system, "at.position.x"), 10).unobservable
    assert "lag" in missing.words
