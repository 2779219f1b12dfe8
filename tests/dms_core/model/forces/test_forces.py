"""Loads and springs against mechanics: power, action and reaction, closed forms."""

from __future__ import annotations

import numpy as np
import pytest

from dms_core.errors import ModelError
from dms_core.model.constraints import Revolute
from dms_core.model.forces import FirstOrder, Gravity, JointSpringDamper, LumpedLoad, SecondOrder, SpringDamper
from dms_core.model.geometry.frames import rotation_matrix
from tests.dms_core.model.poses import block_rate, omega, random_motion, start
from tests.example_elements import Example, examples
from tests.example_elements.forces import ENDS, LOAD
from tests.example_elements.kernel_call import kernel_calls
from tests.example_elements.pair import LOWER, UPPER, WEIGHT, pair

RTOL = 1e-12
"""Rounding of sums of a few dozen products."""


def _calls(element, *inputs: str, constraints=()):
    return kernel_calls(Example(pair(constraints=constraints, forces=[element], inputs=inputs), element))


def _end(q, arm):
    """A point of a body's block in ground axes, its arm seen from the centre of mass."""
    return q[:3] + rotation_matrix(q[3:]) @ arm


class TestGravity:
    def test_every_body_has_its_weight(self):
        calls = _calls(Gravity(name="g"))
        assert [c.placement.bodies for c in calls] == [("upper",), ("lower",), ("weight",)]
        for call, body in zip(calls, (UPPER, LOWER, WEIGHT), strict=True):
            weight = [0.0, body.mass * 9.80665, 0.0, 0.0, 0.0, 0.0, 0.0]
            np.testing.assert_allclose(call(start(call))[0], weight, rtol=RTOL)

    def test_only_the_named_bodies(self):
        assert [c.placement.bodies for c in _calls(Gravity(name="g", bodies=("lower",)))] == [("lower",)]

    def test_the_ground_has_no_weight(self):
        with pytest.raises(ModelError, match="the ground has no weight"):
            _calls(Gravity(name="g", bodies=("ground",)))


class TestLumpedLoad:
    @pytest.mark.parametrize("axes", ["ground", "body"])
    def test_power_is_force_times_velocity_and_moment_times_rate(self, axes):
        call = _calls(LumpedLoad(name="load", axes=axes, **LOAD))[0]
        x = start(call)
        v = random_motion(x.q, np.random.default_rng(1))
        w = omega(x.q, v)
        A = rotation_matrix(x.q[3:])
        lever = A @ (np.array(LOAD["point"]) - LOWER.centre_of_mass)
        turn = A if axes == "body" else np.eye(3)
        power = (turn @ LOAD["force"]) @ (v[:3] + np.cross(w, lever)) + (turn @ LOAD["moment"]) @ w
        assert -call(x)[0] @ v == pytest.approx(power, rel=RTOL)

    def test_input_scales_the_load(self):
        free = _calls(LumpedLoad(name="load", **LOAD))[0]
        scaled = _calls(LumpedLoad(name="load", input="pull", **LOAD), "pull")[0]
        x = start(scaled)
        x.u[0, 0] = -2.5
        np.testing.assert_allclose(scaled(x)[0], -2.5 * free(start(free))[0], rtol=RTOL)

    def test_the_ground_cannot_be_loaded(self):
        with pytest.raises(ModelError, match="'ground' cannot be loaded"):
            _calls(LumpedLoad(name="load", body="ground", force=(1.0, 0.0, 0.0)))


class TestSpringDamper:
    def test_tension_and_direction(self):
        call = _calls(SpringDamper(name="s", stiffness=200.0, damping=15.0, free_length=0.2, preload=12.0, **ENDS))[0]
        x = start(call)
        x = x._replace(v=random_motion(x.q, np.random.default_rng(2)))
        arms = np.array(ENDS["point_i"]) - UPPER.centre_of_mass, np.array(ENDS["point_j"]) - LOWER.centre_of_mass
        ends, speeds = [], []
        for arm, o in zip(arms, (0, 7), strict=True):
            block, rate = x.q[o : o + 7], x.v[o : o + 7]
            ends.append(_end(block, arm))
            speeds.append(rate[:3] + np.cross(omega(block, rate), ends[-1] - block[:3]))
        way, speed = ends[0] - ends[1], speeds[0] - speeds[1]
        length = np.linalg.norm(way)
        tension = 200.0 * (length - 0.2) + 15.0 * (way @ speed) / length + 12.0
        np.testing.assert_allclose(-call(x)[0][7:10], tension * way / length, rtol=RTOL)

    def test_default_is_slack_at_the_start(self):
        call = _calls(SpringDamper(name="s", stiffness=200.0, **ENDS))[0]
        # 200 N/m times the rounding of a length below 1 m.
        np.testing.assert_allclose(call(start(call))[0], 0.0, atol=1e-12)

    def test_coincident_ends_give_finite_numbers(self):
        ends = {"body_j": "lower", "point_j": LOWER.centre_of_mass}
        call = _calls(SpringDamper(name="s", stiffness=200.0, damping=1.0, free_length=0.0, **ends))[0]
        x = start(call)
        x.q[7:10] = 0.0
        r, Jq, Jv, _ = call(x)
        assert not np.any(r)
        assert np.all(np.isfinite(Jq)) and np.all(np.isfinite(Jv))


class TestJointSpringDamper:
    @pytest.mark.parametrize("angle", [0.3, -2.0, 3.0])
    def test_moment_about_the_axis(self, angle):
        hinge = Revolute(name="hinge", body_j="lower", axis_i=(0.0, 0.0, 1.0), axis_j=(0.0, 0.0, 1.0))
        spring = JointSpringDamper(name="s", joint="hinge", stiffness=8.0, damping=0.7, rest_angle=0.4)
        call = _calls(spring, constraints=[hinge])[0]
        x = start(call)
        x.q[10:] = (np.cos(angle / 2.0), 0.0, 0.0, np.sin(angle / 2.0))
        about = block_rate(x.q[7:], x.q[7:10], np.zeros(3), np.array([0.0, 0.0, 1.0]))
        x.v[7:] = 1.7 * about
        twist = (angle - 0.4 + np.pi) % (2.0 * np.pi) - np.pi
        assert call(x)[0][7:] @ about == pytest.approx(8.0 * twist + 0.7 * 1.7, rel=RTOL)

    def test_joint_must_exist(self):
        with pytest.raises(
            ModelError,
            match="'knee' does not exist. Expected the name of a .*Screw. Declared: none are declared",
        ):
            _calls(JointSpringDamper(name="s", joint="knee"))


@pytest.mark.parametrize("kind", ["spring_damper", "joint_spring_damper", "joint_stop"])
def test_internal_forces_do_no_work_on_a_common_motion(kind):
    """Action is minus reaction, in force and in moment."""
    for example in examples()[kind]:
        call = kernel_calls(example())[0]
        x = start(call)
        rng = np.random.default_rng(4)
        x = x._replace(q=x.q.copy(), v=random_motion(x.q, rng))
        x.q[7:10] += 0.1  # stretches the spring that is slack at the start
        r = call(x)[0]
        velocity, w = rng.normal(size=3), rng.normal(size=3)
        common = np.concatenate([block_rate(x.q[o : o + 7], np.zeros(3), velocity, w) for o in (0, 7)])
        size = np.abs(r) @ np.abs(common)
        assert size > 1e-3
        assert abs(r @ common) < 1e-13 * size  # rounding


class TestDifferentialEquations:
    def test_lag_follows_a_step_exponentially(self):
        call = _calls(FirstOrder(name="lag", time_constant=0.04, gain=3.0, input="u"), "u")[0]
        x = start(call)._replace(q=np.empty(1), v=np.empty(1), a=np.zeros(1))
        t = 0.05
        x.u[0, 0] = 2.0
        x.q[0], x.v[0] = 6.0 * (1.0 - np.exp(-t / 0.04)), 6.0 / 0.04 * np.exp(-t / 0.04)
        assert call(x)[0][0] == pytest.approx(0.0, abs=1e-14)  # rounding of numbers up to 6

    def test_lag_is_a_first_order_state(self):
        (own,) = FirstOrder(name="lag", time_constant=0.04).coordinates()
        assert not own.differential_rate

    def test_oscillator_swings_at_its_eigenfrequency(self):
        call = _calls(SecondOrder(name="mode", mass=2.0, stiffness=50.0))[0]
        w, t = 5.0, 0.3
        x = start(call)._replace(
            q=np.array([np.cos(w * t)]), v=np.array([-w * np.sin(w * t)]), a=np.array([-w * w * np.cos(w * t)])
        )
        assert call(x)[0][0] == pytest.approx(0.0, abs=1e-13)  # rounding of numbers up to 50
