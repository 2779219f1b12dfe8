"""Path geometry against closed forms and the muscle paths of arm26; derivatives are tested over every element."""

import math

import numpy as np
import pytest

from dms_core.errors import ModelError
from dms_core.model.bodies.rigid_body import RigidBody
from dms_core.model.element import GROUND
from dms_core.model.geometry.path import (
    PathPoint,
    moving_path,
    path_length,
    path_rate,
    path_table,
    start_length,
)
from dms_core.model.system import System
from tests.arm26 import MUSCLES, arm, body_coordinates, muscle, table

TOLERANCE = 1e-9
"""[m]: the reference's own advice for lengths and moment arms."""


def _evaluated(system: System, points: tuple[PathPoint, ...]) -> tuple[float, float]:
    """Length [m] and rate [m/s] at the declared start."""
    t = path_table(system, points)
    ip, par = np.array(t.integers, np.int32), np.array(t.numbers)
    q, v = body_coordinates(system, t.bodies)
    return path_length(ip, 0, par, 0, q), path_rate(ip, 0, par, 0, q, v)


@pytest.mark.parametrize("row", table("arm26_paths_via_points_only"), ids=lambda r: f"{r['elbow_flexion_deg']:.0f}deg")
@pytest.mark.parametrize("name", MUSCLES)
def test_lengths_and_moment_arms_of_arm26(name, row):
    system, path = arm(row["elbow_flexion_deg"], speed=1.0), muscle(name).path
    length, rate = _evaluated(system, path)
    assert length == pytest.approx(row[f"{name}_length_m"], abs=TOLERANCE)
    # At 1 rad/s of flexion the rate is dL/dangle, the negative moment arm.
    assert -rate == pytest.approx(row[f"{name}_elbow_moment_arm_m"], abs=TOLERANCE)
    assert start_length(system, path) == pytest.approx(length, abs=1e-14)


def _block(position=(0.0, 0.0, 0.0), velocity=(0.0, 0.0, 0.0)) -> System:
    return System(
        bodies=[
            RigidBody(
                name="block",
                mass=1.0,
                inertia=(1.0, 1.0, 1.0),
                centre_of_mass=(0.5, 0.0, 0.0),
                position=position,
                velocity=velocity,
            )
        ]
    )


def _points(*points) -> tuple[PathPoint, ...]:
    return tuple(PathPoint(body=body, point=point) for body, point in points)


def test_right_triangle():
    path = _points((GROUND, (0.0, 0.0, 0.0)), ("block", (0.0, 0.0, 0.0)))
    length, rate = _evaluated(_block((3.0, 4.0, 0.0), (1.0, 0.0, 0.0)), path)
    # 5 m, and the share 3/5 of the speed along the rope; rounding only.
    assert (length, rate) == (pytest.approx(5.0, abs=1e-14), pytest.approx(0.6, abs=1e-14))


def test_segments_within_a_body_are_one_constant():
    path = _points(
        (GROUND, (-1.0, 0.0, 0.0)),
        (GROUND, (0.0, 0.0, 0.0)),
        ("block", (0.0, 0.0, 0.0)),
        ("block", (0.0, 2.0, 0.0)),
        ("block", (0.0, 2.0, 3.0)),
    )
    t = path_table(_block((5.0, 0.0, 0.0)), path)
    assert t.bodies == ("block",) and t.integers == (1, -1, 0)
    assert t.numbers[0] == 6.0
    # Arms are seen from the centre of mass, 0.5 m beside the reference origin.
    assert t.numbers[1:] == (0.0, 0.0, 0.0, -0.5, 0.0, 0.0)
    assert _evaluated(_block((5.0, 0.0, 0.0)), path)[0] == pytest.approx(11.0, abs=1e-14)


def test_a_body_visited_twice_counts_twice():
    path = _points(*[(GROUND, (0.0, 0.0, 0.0)), ("block", (0.0, 0.0, 0.0))] * 2)
    assert _evaluated(_block((2.0, 0.0, 0.0), (1.0, 0.0, 0.0)), path) == (pytest.approx(6.0), pytest.approx(3.0))


def test_points_that_meet_leave_finite_numbers():
    path = _points((GROUND, (0.0, 0.0, 0.0)), ("block", (0.0, 0.0, 0.0)))
    length, rate = _evaluated(_block(velocity=(1.0, 0.0, 0.0)), path)
    assert length < 1e-11 and math.isfinite(rate)


def test_mistakes_name_the_culprit():
    with pytest.raises(ModelError, match=r"body 'blok' does not exist.*block"):
        path_table(_block(), _points((GROUND, (0.0, 0.0, 0.0)), ("blok", (0.0, 0.0, 0.0))))
    with pytest.raises(ModelError, match=r"rope 'r'.*'block'.*never changes"):
        moving_path(_block(), "rope 'r'", _points(("block", (0.0, 0.0, 0.0)), ("block", (1.0, 0.0, 0.0))))
    with pytest.raises(ModelError, match="point"):
        PathPoint(body="block", point=(1.0, 2.0))
