"""Static equilibria against closed forms and polygons of forces, and problems that have no single answer."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.optimize import brentq

from dms_core import Model
from dms_core.analyses import static_equilibrium
from dms_core.errors import InputError, SimulationError
from dms_core.model import (
    Constant,
    FirstOrder,
    Gravity,
    Input,
    JointAngle,
    LineGuide,
    Pid,
    PointMass,
    Revolute,
    RopeActuator,
    RopeForce,
    RopeLength,
    SpringDamper,
    System,
)
from tests.dms_core.analyses.mechanisms import (
    G,
    ball_and_rod,
    double_pendulum,
    hanging_chain,
    rod,
    spring_mass_chain,
)

ROUNDING = 1e-10
"""Newton's last step is below 1e-10 of the nominal sizes, and the one behind it would be rounding."""


def chain_polygon(links: int, length: float, span: float) -> np.ndarray:
    """Joints of a chain of equal heavy links: the tangent of each is its vertical force over the horizontal one H.

    In the middle of link k the vertical force is (k - (n - 1) / 2) w (statics of a cable, e.g. Beer and Johnston,
    sect. 7.10); H in units of w follows from the span.
    """
    k = np.arange(links) - 0.5 * (links - 1)

    def excess(H: float) -> float:
        return float(np.sum(length * np.cos(np.arctan(k / H)))) - span

    angle = np.arctan(k / brentq(excess, 1e-3, 1e3, xtol=1e-15))
    steps = length * np.column_stack([np.cos(angle), np.sin(angle)])
    return np.concatenate([[[0.0, 0.0]], np.cumsum(steps, axis=0)])


class TestClosedForms:
    @pytest.mark.parametrize("start", [0.3, 0.5 * math.pi, 3.0])
    def test_a_pendulum_creeps_to_its_lowest_place_and_not_to_the_highest(self, start):
        last = static_equilibrium(double_pendulum(0.7, (start, start))).last
        q = dict(zip(last.model.layout.names, last.q, strict=True))
        assert q["upper.y"] == pytest.approx(-0.35, abs=ROUNDING)
        assert q["lower.y"] == pytest.approx(-1.05, abs=ROUNDING)
        assert last.stable
        # The bearing carries both rods.
        row = last.model.layout.row_names.index("shoulder.y")
        assert abs(last.lam[row]) == pytest.approx(2.0 * G, rel=1e-9)

    def test_a_spring_is_stretched_by_the_weight(self):
        mass, k = 2.0, 300.0
        system = System(
            "spring",
            bodies=[PointMass(name="ball", mass=mass, position=(0.0, -1.0, 0.0))],
            constraints=[LineGuide(name="track", body_j="ball", axis_i=(0.0, 1.0, 0.0))],
            forces=[
                SpringDamper(name="spring", body_j="ball", stiffness=k, free_length=1.0),
                Gravity(name="weight", acceleration=(0.0, -G, 0.0)),
            ],
        )
        y = static_equilibrium(system).states().coordinate("ball.y")
        assert y[-1] == pytest.approx(-1.0 - mass * G / k, abs=ROUNDING)

    @pytest.mark.parametrize("links", [5, 12])
    def test_a_hanging_chain_is_the_polygon_of_forces(self, links):
        length, span = 2.0 / links, 1.2
        last = static_equilibrium(hanging_chain(links, length, span, 1.0 / links)).last
        q = dict(zip(last.model.layout.names, last.q, strict=True))
        joints = chain_polygon(links, length, span)
        middles = 0.5 * (joints[1:] + joints[:-1])
        found = np.array([[q[f"link{k}.x"], q[f"link{k}.y"]] for k in range(links)])
        # 1e-9: the polygon itself is found to 1e-12, and positions to 1e-10 of a metre in each of its links.
        np.testing.assert_allclose(found, middles, atol=1e-9)
        assert last.stable

    def test_the_polygon_tends_to_the_catenary_with_the_square_of_the_links(self):
        """Sag of a cable of length S over a span L: a (cosh(L / 2a) - 1) with 2 a sinh(L / 2a) = S."""
        S, L = 2.0, 1.2
        a = brentq(lambda a: 2.0 * a * math.sinh(0.5 * L / a) - S, 0.05, 10.0, xtol=1e-14)
        sag = a * (math.cosh(0.5 * L / a) - 1.0)
        errors = []
        for links in (4, 8, 16):
            last = static_equilibrium(hanging_chain(links, S / links, L, 1.0 / links)).last
            k = links // 2
            q = dict(zip(last.model.layout.names, last.q, strict=True))
            half = 0.5 * S / links
            slope = 2.0 * math.atan2(q[f"link{k}.p3"], q[f"link{k}.p0"])
            lowest = q[f"link{k}.y"] - half * math.sin(slope)
            errors.append(abs(-lowest - sag))
        orders = np.log2(np.array(errors[:-1]) / np.array(errors[1:]))
        assert np.all(np.abs(orders - 2.0) < 0.15)


class TestElementStates:
    def test_a_controller_that_integrates_holds_its_target_whatever_the_load(self):
        """At rest e = 0, so that the angle is psi and the tension is the weight's moment over the lever."""
        target, length, mass = math.radians(-60.0), 1.0, 2.0
        system = System(
            "held rod",
            bodies=[rod("rod", length, mass, angle=-0.5 * math.pi)],
            constraints=[Revolute(name="hinge", body_j="rod", point_j=(0.0, 0.0, 0.0))],
            forces=[
                Gravity(name="weight", acceleration=(0.0, -G, 0.0)),
                Pid(name="pid", joint="hinge", reference="psi", kp=200.0, ki=50.0, kd=20.0),
                RopeActuator(name="motor", pid="pid", time_constant=0.05),
                RopeForce(
                    name="rope",
                    path=[{"point": (0.5, 0.5, 0.0)}, {"body": "rod", "point": (1.0, 0.0, 0.0)}],
                    coordinate="motor.tension",
                ),
            ],
            sensors=[JointAngle(name="angle", joint="hinge")],
            inputs=[Input(name="psi", signal=Constant(value=target))],
        )
        result = static_equilibrium(system)
        assert result.states().sensors()["angle.angle"][-1] == pytest.approx(target, abs=1e-8)
        tip = length * np.array([math.cos(target), math.sin(target)])
        pull = np.array([0.5, 0.5]) - tip
        pull /= np.linalg.norm(pull)
        lever = tip[0] * pull[1] - tip[1] * pull[0]
        tension = 0.5 * mass * G * tip[0] / lever
        assert result.states().coordinate("motor.tension")[-1] == pytest.approx(tension, rel=1e-7)

    def test_a_proportional_controller_leaves_an_error(self):
        """kp e is the force that a spring needs: e = k (x - x0) / kp in a loop of one joint; here by its moment."""
        stiff = {"joint": "hinge", "reference": "psi", "kp": 100.0, "ki": 0.0, "kd": 5.0}
        system = System(
            "proportional",
            bodies=[rod("rod", 1.0, 1.0, angle=-0.5 * math.pi)],
            constraints=[Revolute(name="hinge", body_j="rod", point_j=(0.0, 0.0, 0.0))],
            forces=[
                Gravity(name="weight", acceleration=(0.0, -G, 0.0)),
                Pid(name="pid", **stiff),
                RopeActuator(name="motor", pid="pid", time_constant=0.05, width=0.01),
                RopeForce(
                    name="rope",
                    path=[{"point": (0.5, 0.5, 0.0)}, {"body": "rod", "point": (1.0, 0.0, 0.0)}],
                    coordinate="motor.tension",
                ),
            ],
            sensors=[JointAngle(name="angle", joint="hinge")],
            inputs=[Input(name="psi", signal=Constant(value=-1.0))],
        )
        states = static_equilibrium(system).states()
        angle, tension = states.sensors()["angle.angle"][-1], states.coordinate("motor.tension")[-1]
        assert tension == pytest.approx(100.0 * (-1.0 - angle), rel=1e-4)  # the smoothed positive part adds 1e-6
        tip = np.array([math.cos(angle), math.sin(angle)])
        pull = np.array([0.5, 0.5]) - tip
        pull /= np.linalg.norm(pull)
        assert tension * (tip[0] * pull[1] - tip[1] * pull[0]) == pytest.approx(0.5 * G * tip[0], rel=1e-8)

    def test_a_first_order_state_is_at_its_end(self):
        system = System(
            "lag", bodies=[PointMass(name="ball", mass=1.0)],
            forces=[FirstOrder(name="lag", input="u", gain=3.0, time_constant=0.2),
                    *(SpringDamper(name=f"s{k}", body_j="ball", point_i=p, stiffness=10.0)
                      for k, p in enumerate([(1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (-1.0, -1.0, -1.0)]))],
            inputs=[Input(name="u", signal=Constant(value=2.0))],
        )  # fmt: skip
        assert static_equilibrium(system).states().coordinate("lag.x")[-1] == pytest.approx(6.0, rel=1e-9)


class TestLoadSteps:
    def test_steps_end_where_one_step_does(self):
        system = hanging_chain(5, 0.4, 1.2, 0.2)
        whole = static_equilibrium(system).last
        stepped = static_equilibrium(system, loads=["weight"], steps=4)
        np.testing.assert_allclose(stepped.loads, [0.25, 0.5, 0.75, 1.0])
        np.testing.assert_allclose(stepped.last.q, whole.q, atol=1e-9)
        # A chain hangs the same way under any gravity, and its joints carry in proportion.
        np.testing.assert_allclose(stepped.steps[0].q, whole.q, atol=1e-9)
        np.testing.assert_allclose(4.0 * stepped.steps[0].lam, whole.lam, atol=1e-6)

    @pytest.mark.parametrize(
        ("arguments", "said"),
        [
            ({"steps": 0, "loads": ["weight"]}, "steps: Expected a positive whole number of load steps, got 0."),
            ({"steps": 3}, "loads: Expected the names of the loads"),
            (
                {"loads": ["wait"]},
                "load 'wait': Expected an input, or a force element without coordinates. There are: ",
            ),
            ({"inputs": {"P": math.nan}}, "input 'P': Expected a finite number, got nan."),
        ],
    )
    def test_wrong_arguments(self, arguments, said):
        with pytest.raises(InputError) as error:
            static_equilibrium(double_pendulum(1.0), **arguments)
        assert said in str(error.value)


class TestNoSingleAnswer:
    def test_the_free_motion_is_named(self):
        system = System(
            "cart",
            bodies=[rod("rod", 1.0, 1.0), PointMass(name="cart", mass=1.0, position=(0.0, 1.0, 0.0))],
            constraints=[
                Revolute(name="axle", body_j="rod", axis_i=(0.0, 1.0, 0.0), point_j=(0.0, 0.0, 0.0)),
                LineGuide(name="rail", body_j="cart", axis_i=(1.0, 0.0, 0.0), point_i=(0.0, 1.0, 0.0)),
            ],
            forces=[
                Gravity(name="weight", acceleration=(0.0, -G, 0.0)),
                SpringDamper(name="spring", body_j="cart", point_i=(3.0, 1.0, 0.0), stiffness=10.0),
            ],
        )
        with pytest.raises(SimulationError) as error:
            static_equilibrium(system)
        assert "underdetermined: there is a motion that nothing holds: 'rod' turns about (0, 1, 0)" in str(error.value)
        assert "at revolute 'axle'" in str(error.value)

    def test_two_free_motions_are_counted(self):
        loose = ball_and_rod(1.0)
        system = System("loose", bodies=loose.bodies, constraints=loose.constraints)
        with pytest.raises(SimulationError, match="there are 2 motions that nothing holds: 'ball' moves along"):
            static_equilibrium(system)

    def test_what_falls_for_ever_is_named(self):
        system = System(
            "stone", bodies=[PointMass(name="stone", mass=1.0)],
            forces=[Gravity(name="weight", acceleration=(0.0, -G, 0.0))],
        )  # fmt: skip
        with pytest.raises(SimulationError, match=r"no equilibrium was found.*'stone' moves along \(0, 1, 0\)"):
            static_equilibrium(system)

    def test_a_chain_of_springs_is_stable_and_says_so(self):
        last = static_equilibrium(Model(spring_mass_chain(3, 1.0, 100.0))).last
        assert last.stable
        assert last.sentence == "The equilibrium is stable."
        assert last.flags == ()

    def test_a_rope_that_pushes_is_flagged(self):
        """A ball that starts upright on its rope: an equilibrium, unstable, and none of a real rope."""
        system = System(
            "balanced", bodies=[PointMass(name="ball", mass=1.0, position=(0.0, 1.0, 0.0))],
            constraints=[RopeLength(name="rope", path=[{"point": (0.0, 0.0, 0.0)},
                                                       {"body": "ball", "point": (0.0, 0.0, 0.0)}])],
            forces=[Gravity(name="weight", acceleration=(0.0, -G, 0.0))],
        )  # fmt: skip
        last = static_equilibrium(system).last
        (flag,) = last.flags
        assert flag.element == "rope" and flag.worst == pytest.approx(-G)
        assert not last.stable and last.growth == pytest.approx(math.sqrt(G), rel=1e-9)
        assert last.sentence.startswith("The equilibrium is unstable: a small disturbance grows e-fold in 0.319")
