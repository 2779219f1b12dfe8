"""A cylinder on a cylinder against closed forms: where it rolls off, nearest points of skew lines, impacts, momenta."""

from __future__ import annotations

import math

import numpy as np
import pytest

from dms_core.assembly.model import Model
from dms_core.errors import ModelError
from dms_core.model import ContactSensor, CylinderPairContact, Gravity, RigidBody, System
from dms_core.model.contact.axis_pair import PARALLEL
from dms_core.model.contact.shapes import CYLINDERS, touching
from dms_core.model.geometry.frames import g_matrix, quaternion, rotation_matrix
from dms_core.simulation.dynamics import SolverOptions, simulate

G, MASS, STIFFNESS = 9.81, 0.5, 1e9
UNDER, ROLLER = 0.3, 0.1
"""Radii of the lower cylinder, which is fixed, and of the one on it [m]."""
START = 0.1
"""Angle from the top at which it is released [rad]."""
WAYS = {"sliding": (0.0, 2.0 / 3.0), "rolling": (1e3, 4.0 / 7.0)}
"""Friction, and cos a of the place where a solid cylinder leaves from rest on the top."""


def on_top(friction: float) -> Model:
    """A solid cylinder along z on another one, as deep as its weight presses it there; their middles are apart."""
    reach = UNDER + ROLLER - (MASS * G * math.cos(START) / STIFFNESS) ** (2.0 / 3.0)
    across = MASS * (ROLLER**2 / 4.0 + 0.4**2 / 12.0)
    roller = RigidBody(
        name="roller", mass=MASS, inertia=(across, across, 0.5 * MASS * ROLLER**2),
        position=(reach * math.sin(START), reach * math.cos(START), 0.0),
    )  # fmt: skip
    touch = CylinderPairContact(
        name="touch", body_j="roller", radius_i=UNDER, length_i=2.0, radius_j=ROLLER, length_j=0.4,
        stiffness=STIFFNESS, restitution=0.2, impact_speed=0.01, friction=friction, slip_speed=1e-5,
    )  # fmt: skip
    return Model(
        System(
            "off the cylinder", bodies=[roller], forces=[touch, Gravity(name="weight", acceleration=(0.0, -G, 0.0))],
            sensors=[ContactSensor(name="touch_sensor", contact="touch")],
        )
    )  # fmt: skip


@pytest.mark.parametrize("way", WAYS)
def test_it_leaves_at_the_angle_of_the_textbook(way):
    """m v^2 (1 + I / m r^2) / 2 = m g R (cos a0 - cos a), N = m g cos a - m v^2 / R.

    N is 0 at cos a = 2 cos a0 / (3 + I / m r^2).
    """
    friction, cosine = WAYS[way]
    run = simulate(on_top(friction), 1.0, SolverOptions(rtol=1e-8)).check()
    load = run.sensors(run.t)["touch_sensor.normal"] / (MASS * G)
    cos = run.q[:, 1] / np.hypot(run.q[:, 0], run.q[:, 1])
    left = int(np.flatnonzero(load <= 0.0)[0])
    lines = (load > 0.2) & (load < 0.6) & (np.arange(len(load)) < left)
    slope, offset = np.polyfit(cos[lines], load[lines], 1)
    # As for a sphere: depth over radius is 7e-6, and the acceleration of the depth makes 1e-4 of the weight.
    assert -offset / slope == pytest.approx(cosine * math.cos(START), abs=5e-5)
    assert slope == pytest.approx(1.0 + 2.0 / (1.0 + (0.5 if friction else 0.0)), rel=3e-4)
    # It stays parallel.
    np.testing.assert_allclose(run.q[-1, [2, 4, 5]], 0.0, atol=1e-9)


def pose(position, orientation) -> np.ndarray:
    p = np.array(orientation, float)
    return np.concatenate([position, p / np.linalg.norm(p)])


def placed(touch: CylinderPairContact, q: np.ndarray):
    """(g, n, X) of a contact between two bodies at q, shape (14,)."""
    bodies = [RigidBody(name=n, mass=1.0, inertia=(1.0, 1.0, 1.0)) for n in ("a", "b")]
    par = np.array(touch.place(System("x", bodies=bodies, forces=[touch])).numbers)
    g, n, X = touching(CYLINDERS, par, q)
    return g, np.array(n), np.array(X)


def pair(**changes) -> CylinderPairContact:
    given = {"radius_i": 0.2, "length_i": 6.0, "radius_j": 0.1, "length_j": 6.0, "stiffness": 1.0, **changes}
    return CylinderPairContact(name="touch", body_i="a", body_j="b", **given)


@pytest.mark.parametrize("seed", range(8))
def test_crossed_cylinders_are_as_far_apart_as_their_axes(seed):
    """|d . (f_i x f_j)| / |f_i x f_j| less both radii, along that product; the point lies on both common normals."""
    rng = np.random.default_rng(seed)
    f_i, f_j = (x / np.linalg.norm(x) for x in rng.normal(size=(2, 3)))
    cross = np.cross(f_i, f_j)
    if np.linalg.norm(cross) < 0.3:
        f_j = f_j + np.array([0.0, 0.7, 0.0])
        f_j /= np.linalg.norm(f_j)
        cross = np.cross(f_i, f_j)
    n = cross / np.linalg.norm(cross)
    s, t, apart = *rng.uniform(-1.0, 1.0, 2), rng.uniform(0.4, 1.0)
    c_i = rng.normal(size=3)
    c_j = c_i + s * f_i + apart * n - t * f_j
    q = np.concatenate([pose(c_i, (1, 0, 0, 0)), pose(c_j, (1, 0, 0, 0))])
    g, normal, X = placed(pair(axis_i=tuple(f_i), axis_j=tuple(f_j)), q)
    # The share of s^2 and t^2 that makes parallel axes definite: PARALLEL^2 over the sine squared.
    error = PARALLEL**2 / np.linalg.norm(cross) ** 2
    assert g == pytest.approx(apart - 0.3, abs=5.0 * error)
    np.testing.assert_allclose(normal, n, atol=10.0 * error)
    np.testing.assert_allclose(X, c_i + s * f_i + (0.2 + 0.5 * (apart - 0.3)) * n, atol=20.0 * error)


def test_ends_touch_where_segments_are_nearest():
    """By brute force over both segments, whatever ends are the nearest."""
    rng = np.random.default_rng(3)
    u = np.linspace(-0.5, 0.5, 801)
    for _ in range(12):
        axes, c_j, lengths = rng.normal(size=(2, 3)), rng.normal(size=3) * 1.5, rng.uniform(0.2, 2.0, 2)
        f_i, f_j = axes / np.linalg.norm(axes, axis=1)[:, None]
        a, b = np.outer(u * lengths[0], f_i), c_j + np.outer(u * lengths[1], f_j)
        wanted = np.sqrt(((a[:, None] - b[None]) ** 2).sum(2).min())
        touch = pair(axis_i=tuple(f_i), axis_j=tuple(f_j), length_i=lengths[0], length_j=lengths[1])
        g, n, _ = placed(touch, np.concatenate([pose((0, 0, 0), (1, 0, 0, 0)), pose(c_j, (1, 0, 0, 0))]))
        # The grid misses the nearest points by half its spacing of 2.5 mm at most.
        assert wanted - 5e-6 / wanted - 1e-6 < g + 0.3 < wanted + 1e-5
        assert np.linalg.norm(n) == pytest.approx(1.0)


def test_parallel_cylinders_touch_in_the_middle_of_what_they_share():
    """A short one at 0.7 m from the middle of a long one, turned over as well."""
    for turn in ((1, 0, 0, 0), (0, 1, 0, 0)):
        q = np.concatenate([pose((0, 0, 0), (1, 0, 0, 0)), pose((0.25, 0.0, 0.7), turn)])
        g, n, X = placed(pair(length_j=0.1), q)
        # (h_j / h_i)^2 of the distance of the middles is left.
        np.testing.assert_allclose(X, [0.175, 0.0, 0.7], atol=1e-3)
        assert g == pytest.approx(-0.05, abs=1e-6) and n[0] == pytest.approx(1.0)


def test_an_impact_gives_back_the_restitution_and_keeps_momenta():
    """Two crossed rods meet in their middles, head on, and beside them, where both are set spinning."""
    for aside in (0.0, 0.15):
        one = RigidBody(name="a", mass=1.2, inertia=(0.04, 0.04, 0.001))
        two = RigidBody(
            name="b", mass=0.4, inertia=(0.01, 0.01, 0.001), position=(aside, 0.3 + 1e-3, aside),
            orientation=tuple(quaternion((0.0, 1.0, 0.0), 0.5 * math.pi)), velocity=(0.0, -2.0, 0.0),
        )  # fmt: skip
        touch = pair(length_i=0.8, length_j=0.8, stiffness=1e7, restitution=0.6, impact_speed=2.0)
        run = simulate(System("impact", bodies=[one, two], forces=[touch]), 0.01, SolverOptions(rtol=1e-8)).check()
        v, q = run.v[-1], run.q[-1]
        np.testing.assert_allclose(1.2 * v[:3] + 0.4 * v[7:10], [0.0, -0.8, 0.0], atol=1e-9)
        spins = [2.0 * rotation_matrix(p) @ g_matrix(p) @ v[o + 3 : o + 7] for o, p in ((0, q[3:7]), (7, q[10:]))]
        # At the point of contact (0, 0.2, aside) of a, and at -aside along the axis of b.
        at = [v[o : o + 3] + np.cross(w, lever) for o, w, lever in
              ((0, spins[0], (0.0, 0.2, aside)), (7, spins[1], (-aside, -0.1, 0.0)))]  # fmt: skip
        # The bodies turn by 0.1 rad within the time that is left.
        assert at[1][1] - at[0][1] == pytest.approx(1.2, rel=2e-4 if aside == 0.0 else 0.02)


@pytest.mark.parametrize(
    ("numbers", "complaint"),
    [
        ({"radius_i": 0.0}, "radius_i = 0.0: Expected a number above 0"),
        ({"length_j": -1.0}, "length_j = -1.0: Expected a number above 0"),
        ({"axis_j": (0.0, 0.0, 0.0)}, "cylinder_pair_contact 'touch': axis_j = .* has length 0"),
        ({"body_i": "b"}, "two different bodies, got 'b' twice"),
    ],
)
def test_wrong_numbers_are_refused(numbers, complaint):
    given = {"body_j": "b", "radius_i": 1.0, "length_i": 1.0, "radius_j": 1.0, "length_j": 1.0, "stiffness": 1.0}
    body = RigidBody(name="b", mass=1.0, inertia=(1.0, 1.0, 1.0), position=(0.0, 3.0, 0.0))
    with pytest.raises(ModelError, match=complaint):
        Model(System("x", bodies=[body], forces=[CylinderPairContact(name="touch", **given | numbers)]))


def test_two_contacts_bring_a_tilted_roller_to_rest_along_the_other():
    """By impacts that lose energy, in 540 steps; with a tenth of PARALLEL it took thousands, and stayed tilted."""
    tilt, half, stiffness = 1e-5, 0.2, 1e6
    across = MASS * (ROLLER**2 / 4.0 + 0.4**2 / 12.0)
    depth = (0.5 * MASS * G / stiffness) ** (2.0 / 3.0)
    roller = RigidBody(
        name="roller", mass=MASS, inertia=(across, across, 0.5 * MASS * ROLLER**2),
        position=(0.0, UNDER + ROLLER - depth, 0.0), orientation=tuple(quaternion((1.0, 0.0, 0.0), tilt)),
    )  # fmt: skip
    halves = [
        CylinderPairContact(
            name=f"half{side}", body_j="roller", radius_i=UNDER, length_i=2.0, radius_j=ROLLER, length_j=half,
            centre_j=(0.0, 0.0, 0.5 * half * side), stiffness=stiffness, restitution=0.3, impact_speed=0.1,
        )
        for side in (-1, 1)
    ]  # fmt: skip
    weight = Gravity(name="weight", acceleration=(0.0, -G, 0.0))
    run = simulate(Model(System("resting", bodies=[roller], forces=[*halves, weight])), 0.2, SolverOptions(rtol=1e-5))
    run.check()
    assert run.stats.steps < 1500
    assert abs(2.0 * run.q[-1, 4]) < 1e-4 * tilt
