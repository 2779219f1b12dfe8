"""Joints leave exactly the motions free that they are named for, and take the rest."""

from __future__ import annotations

import numpy as np
import pytest

from dms_core.errors import ModelError
from dms_core.model.bodies import RigidBody
from dms_core.model.constraints import (
    AngleDriver,
    Cylindrical,
    Distance,
    Fixed,
    LineGuide,
    Planar,
    PlaneGuide,
    PositionDriver,
    Revolute,
    Screw,
    Slider,
    Spherical,
    Universal,
)
from dms_core.model.geometry.frames import perpendicular, rotation_matrix, unit
from dms_core.model.system import System
from tests.dms_core.model.poses import block_rate, start
from tests.example_elements import Example
from tests.example_elements.constraints import PAIR
from tests.example_elements.kernel_call import kernel_calls
from tests.example_elements.pair import LOWER, UPPER, pair

AXIS = (1.0, 0.5, -0.3)
LEAD = 0.7
ACROSS = rotation_matrix(LOWER.orientation).T @ rotation_matrix(UPPER.orientation) @ perpendicular(unit(AXIS, "axis"))
"""A direction of the lower body that is across AXIS of the upper one at the start."""
JOINTS = {
    "spherical": (Spherical(name="joint", **PAIR), "xyz"),
    "revolute": (Revolute(name="joint", axis_i=AXIS, **PAIR), "a"),
    "fixed": (Fixed(name="joint", **PAIR), ""),
    "slider": (Slider(name="joint", axis_i=AXIS, **PAIR), "A"),
    "line_guide": (LineGuide(name="joint", axis_i=AXIS, **PAIR), "Axyz"),
    "plane_guide": (PlaneGuide(name="joint", normal_i=AXIS, **PAIR), "FGxyz"),
    "cylindrical": (Cylindrical(name="joint", axis_i=AXIS, **PAIR), "Aa"),
    "planar": (Planar(name="joint", axis_i=AXIS, **PAIR), "FGa"),
    "screw": (Screw(name="joint", axis_i=AXIS, lead=LEAD, **PAIR), "S"),
    "universal": (Universal(name="joint", axis_i=AXIS, axis_j=tuple(ACROSS), **PAIR), "au"),
    "distance": (Distance(name="joint", point_j=(0.0, -0.2, 0.1), **PAIR), "ijkxyz"),
}
"""Each joint with its free motions. Capital A, F, G: sliding along the axis and its two perpendiculars; small: turning
about them or about ground axes (x, y, z), at the joint; i, j, k: turning about ground axes at the rod's far end. u is
turning about ACROSS, S the screw motion of the lead LEAD."""


def _call(element, *inputs: str):
    return kernel_calls(Example(pair(constraints=[element], inputs=inputs), element))[0]


def _free_rates(q: np.ndarray, free: str) -> np.ndarray:
    """Rates of both bodies for each free motion of body j while body i rests, shape (number, 14)."""
    a = rotation_matrix(q[3:7]) @ unit(AXIS, "axis")
    f = rotation_matrix(q[3:7]) @ perpendicular(unit(AXIS, "axis"))
    # Points of PAIR and the rod, relative to the centres of mass of example_elements/pair.py.
    centre = q[:3] + rotation_matrix(q[3:7]) @ (np.array(PAIR["point_i"]) - (0.0, -0.2, 0.02))
    rod = q[7:10] + rotation_matrix(q[10:]) @ (np.array([0.0, -0.2, 0.1]) - (0.01, -0.18, 0.0))
    x, y, z = np.eye(3)
    slide = {"A": a, "F": f, "G": np.cross(a, f)}
    turn = {"a": (centre, a), "x": (centre, x), "y": (centre, y), "z": (centre, z)}
    turn |= {"u": (centre, rotation_matrix(q[10:]) @ ACROSS), "S": (centre, a)}
    slide["S"] = LEAD / (2.0 * np.pi) * a
    turn |= {"i": (rod, x), "j": (rod, y), "k": (rod, z)}
    rates = []
    for motion in free:
        point, omega = turn.get(motion, (centre, np.zeros(3)))
        rates.append(np.r_[np.zeros(7), block_rate(q[7:], point, slide.get(motion, np.zeros(3)), omega)])
    return np.array(rates).reshape(-1, 14)


@pytest.mark.parametrize("kind", JOINTS)
class TestJoint:
    def test_start_poses_satisfy_the_joint(self, kind):
        call = _call(JOINTS[kind][0])
        np.testing.assert_allclose(call(start(call))[0], 0.0, atol=1e-14)  # rounding of lengths below 1 m

    def test_free_motions_are_free(self, kind):
        joint, free = JOINTS[kind]
        call = _call(joint)
        x = start(call)
        rates = _free_rates(x.q, free)
        np.testing.assert_allclose(call(x)[2] @ rates.T, 0.0, atol=1e-14)  # rounding of rates about 1

    def test_rows_and_freedoms_add_up_to_six(self, kind):
        joint, free = JOINTS[kind]
        call = _call(joint)
        x = start(call)
        G = call(x)[2]
        norms = np.zeros((2, 14))
        norms[0, 3:7], norms[1, 10:] = x.q[3:7], x.q[10:]
        rank = np.linalg.matrix_rank(np.vstack([G, norms]), tol=1e-8)
        # The freedoms of the rod are 5: turning at either end about the rod itself is one motion, listed twice.
        freedoms = np.linalg.matrix_rank(_free_rates(x.q, free), tol=1e-8) if free else 0
        assert rank == len(joint.rows()) + 2
        assert len(joint.rows()) + freedoms == 6

    def test_both_bodies_may_move_together(self, kind):
        call = _call(JOINTS[kind][0])
        x = start(call)
        rng = np.random.default_rng(3)
        velocity, omega = rng.normal(size=3), rng.normal(size=3)
        together = [block_rate(x.q[o : o + 7], np.zeros(3), velocity, omega) for o in (0, 7)]
        np.testing.assert_allclose(call(x)[2] @ np.concatenate(together), 0.0, atol=1e-14)  # rounding of rates about 1


@pytest.mark.parametrize(
    ("guide", "rows", "rank"), [("slider", 15, 11), ("line_guide", 12, 11), ("plane_guide", 11, 11)]
)
def test_rank_of_the_loop_of_elbow_and_exoskeleton(guide, rows, rank):
    """Forearm and lower link turn about one axis on the upper arm (here the ground) and are coupled by a guide."""
    forearm = RigidBody(name="forearm", mass=1.5, inertia=(0.02, 0.001, 0.02), centre_of_mass=(0.0, -0.18, 0.0))
    link = RigidBody(name="link", mass=0.4, inertia=(0.01, 0.001, 0.01), centre_of_mass=(0.05, -0.1, 0.02))
    elbow = Revolute(name="elbow", body_j="forearm")
    hinge = Revolute(name="hinge", body_j="link")
    along = {"body_i": "link", "body_j": "forearm", "point_i": (0.0, -0.2, 0.0)}
    coupling = {
        "slider": Slider(name="guide", axis_i=(0.0, 1.0, 0.0), **along),
        "line_guide": LineGuide(name="guide", axis_i=(0.0, 1.0, 0.0), **along),
        "plane_guide": PlaneGuide(name="guide", normal_i=(1.0, 0.0, 0.0), **along),
    }[guide]
    system = System(bodies=[forearm, link], constraints=[elbow, hinge, coupling])
    columns = {"forearm": 0, "link": 7}
    blocks = []
    for constraint in system.constraints:
        call = kernel_calls(Example(system, constraint))[0]
        G = call(start(call))[2]
        block = np.zeros((len(G), 14))
        for k, body in enumerate(call.placement.bodies):
            if body in columns:
                block[:, columns[body] : columns[body] + 7] = G[:, 7 * k : 7 * k + 7]
        blocks.append(block)
    G = np.vstack(blocks)
    assert len(G) == rows + 2
    assert np.linalg.matrix_rank(G, tol=1e-8) == rank + 2
    # One degree of freedom is left, whatever the guide: 14 coordinates, two unit lengths.
    assert 14 - (rank + 2) == 1


class TestGivenPose:
    def test_fixed_at_a_given_orientation(self):
        joint = Fixed(name="joint", body_j="lower", point_j=(0.1, 0.0, 0.2), orientation=(0.3, 0.2, -0.5, 1.0))
        call = _call(joint)
        x = start(call)
        p = unit(joint.orientation, "orientation")
        arm = np.array(joint.point_j) - LOWER.centre_of_mass
        x.q[7:10], x.q[10:] = -rotation_matrix(p) @ arm, p
        np.testing.assert_allclose(call(x)[0], 0.0, atol=1e-14)  # rounding of lengths below 1 m

    def test_rod_of_given_length_measures_its_elongation(self):
        ends = {"body_j": "lower", "point_j": LOWER.centre_of_mass}
        call = _call(Distance(name="rod", length=0.5, **ends))
        x = start(call)
        x.q[7:10] = (0.3, 0.4 + 1e-6, 0.0)
        # l - L = 0.8e-6 to first order; what is beyond is (1e-6)^2 / 2L = 1e-12.
        assert call(x)[0][0] == pytest.approx(0.8e-6, abs=2e-12)


class TestDrivers:
    @pytest.mark.parametrize("angle", [0.3, -2.0, 3.5, 7.0])
    def test_angle_is_met_at_any_number_of_turns(self, angle):
        hinge = Revolute(name="hinge", body_j="lower", axis_i=(0.0, 0.0, 1.0), axis_j=(0.0, 0.0, 1.0))
        drive = AngleDriver(name="drive", joint="hinge", input="psi")
        call = kernel_calls(Example(pair(constraints=[hinge, drive], inputs=["psi"]), drive))[0]
        x = start(call)
        x.q[10:] = (np.cos(angle / 2.0), 0.0, 0.0, np.sin(angle / 2.0))
        x.u[0] = (angle - 0.01, 0.5, -0.2)
        phi, phi_t, G, *_ = call(x)
        np.testing.assert_allclose(phi, 0.01, atol=1e-14)  # rounding of an angle of a few radians
        np.testing.assert_array_equal(phi_t, [[-0.5, 0.2]])
        turning = block_rate(x.q[7:], x.q[7:10], np.zeros(3), np.array([0.0, 0.0, 1.0]))
        assert G[0, 7:] @ turning == pytest.approx(1.0, abs=1e-14)

    def test_position_is_measured_along_the_axis(self):
        drive = PositionDriver(name="drive", body_j="lower", axis_i=(0.0, 2.0, 0.0), point_i=(0.0, 0.1, 0.0), input="y")
        call = _call(drive, "y")
        x = start(call)
        x.u[0] = (LOWER.position[1] - 0.1, 0.7, 0.4)
        phi, phi_t, *_ = call(x)
        np.testing.assert_allclose(phi, 0.0, atol=1e-15)  # rounding of a length of 0.2 m
        np.testing.assert_array_equal(phi_t, [[-0.7, -0.4]])


class TestMistakes:
    def test_unknown_body_lists_the_bodies(self):
        with pytest.raises(ModelError, match=r"body 'elbow' does not exist. Declared: ground, lower, upper, weight"):
            _call(Spherical(name="joint", body_j="elbow"))

    def test_axis_of_length_zero(self):
        with pytest.raises(ModelError, match=r"slider 'joint': axis_i = \(0.0, 0.0, 0.0\) has length 0"):
            _call(Slider(name="joint", body_j="lower", axis_i=(0.0, 0.0, 0.0)))

    def test_orientation_of_length_zero(self):
        with pytest.raises(ModelError, match="fixed 'joint': orientation"):
            _call(Fixed(name="joint", body_j="lower", orientation=(0.0, 0.0, 0.0, 0.0)))

    def test_rod_of_length_zero(self):
        with pytest.raises(ModelError, match="use a spherical joint"):
            _call(Distance(name="rod", body_i="lower", body_j="lower"))

    def test_driver_needs_a_revolute_joint(self):
        drive = AngleDriver(name="drive", joint="ball", input="psi")
        with pytest.raises(ModelError, match="'ball' is a spherical. Expected the name of a .*Revolute or Screw"):
            kernel_calls(Example(pair(constraints=[Spherical(name="ball", **PAIR), drive], inputs=["psi"]), drive))
