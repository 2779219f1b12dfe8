"""Linearisation against closed forms of frequencies and differences of the dynamics; pictures of modes."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from dms_core import Model, World
from dms_core.analyses import linearise, static_equilibrium
from dms_core.analyses.pictures import draw_modes
from dms_core.errors import InputError, ModelError
from dms_core.model import (
    Constant,
    FirstOrder,
    Gravity,
    Harmonic,
    Input,
    JointMoment,
    JointReaction,
    JointSpringDamper,
    LineGuide,
    LumpedLoad,
    Point,
    PointMass,
    PositionDriver,
    RopeForce,
    SpringDamper,
    System,
    ThelenMuscle,
)
from tests.dms_core.analyses.dynamics_in_charts import Charted, differences
from tests.dms_core.analyses.mechanisms import (
    G,
    ball_and_rod,
    double_pendulum,
    four_bar,
    hinge,
    rod,
    spring_mass_chain,
)


def about_rest(system: System):
    return static_equilibrium(system).last.linearisation


class TestClosedForms:
    @pytest.mark.parametrize("n", [1, 2, 5])
    def test_frequencies_of_a_chain_of_springs(self, n):
        """omega_j = 2 sqrt(k / m) sin(j pi / (2 (n + 1))), a chain between walls (e.g. Meirovitch 1986, sect. 4.9)."""
        mass, k = 0.5, 200.0
        modes = about_rest(spring_mass_chain(n, mass, k)).modes()
        j = np.arange(1, n + 1)
        expected = 2.0 * math.sqrt(k / mass) * np.sin(j * math.pi / (2.0 * (n + 1)))
        np.testing.assert_allclose([m.eigenvalue.imag for m in modes], expected, rtol=1e-9)
        np.testing.assert_allclose([m.damping for m in modes], 0.0, atol=1e-9)
        # The shape of mode j is sin(j pi i / (n + 1)).
        shape = np.sin(math.pi * np.arange(1, n + 1) / (n + 1))
        x = modes[0].shape.real[0::3]
        np.testing.assert_allclose(x / x[0], shape / shape[0], atol=1e-9)

    def test_damping_ratio_of_one_mass(self):
        """zeta = c / (2 sqrt(k m)), damped frequency omega sqrt(1 - zeta^2); two springs and dampers side by side."""
        (mode,) = about_rest(spring_mass_chain(1, 2.0, 50.0, 3.0)).modes()
        zeta = 6.0 / (2.0 * math.sqrt(100.0 * 2.0))
        assert mode.damping == pytest.approx(zeta, rel=1e-9)
        assert mode.frequency == pytest.approx(math.sqrt(50.0) / (2.0 * math.pi), rel=1e-9)
        assert mode.damped_frequency == pytest.approx(mode.frequency * math.sqrt(1.0 - zeta**2), rel=1e-9)
        assert mode.time_constant == pytest.approx(2.0 * 2.0 / 6.0, rel=1e-9)

    def test_double_pendulum_of_two_rods(self):
        """omega^2 = (3 -+ 6 / sqrt 7) g / l, from M = m l^2 [[4/3, 1/2], [1/2, 1/3]] and K = m g l diag(3/2, 1/2)."""
        length = 0.6
        modes = about_rest(double_pendulum(length, (0.2, 0.1))).modes()
        expected = np.sqrt((3.0 + np.array([-6.0, 6.0]) / math.sqrt(7.0)) * G / length)
        np.testing.assert_allclose([m.eigenvalue.imag for m in modes], expected, rtol=1e-8)

    def test_a_spherical_pendulum_swings_twice_with_one_frequency(self):
        modes = about_rest(ball_and_rod(0.8)).modes()
        np.testing.assert_allclose([m.frequency for m in modes], math.sqrt(G / 0.8) / (2.0 * math.pi), rtol=1e-7)
        assert len(modes) == 2

    def test_an_inverted_pendulum_falls_at_sqrt_of_3g_over_2l(self):
        system = System(
            "upside down", bodies=[rod("rod", 0.5, 1.0, angle=0.5 * math.pi)],
            constraints=[hinge("shoulder", "ground", "rod", (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))],
            forces=[Gravity(name="weight", acceleration=(0.0, -G, 0.0))],
        )  # fmt: skip
        world = World(system)
        world.settle()
        linear = linearise(world.model, world.operating_point())
        assert not linear.stable
        assert linear.growth == pytest.approx(math.sqrt(1.5 * G / 0.5), rel=1e-10)

    def test_a_moved_base_enters_by_its_position_and_acceleration(self):
        """m xddot = -k (x - u): with z = x the driver of the base enters by value; with z = x - u by uddot."""
        k, mass = 40.0, 2.0
        system = System(
            "base",
            bodies=[PointMass(name="base", mass=1.0), PointMass(name="mass", mass=mass, position=(1.0, 0.0, 0.0))],
            constraints=[
                LineGuide(name="rail", body_j="base", axis_i=(1.0, 0.0, 0.0)),
                LineGuide(name="track", body_j="mass", axis_i=(1.0, 0.0, 0.0)),
                PositionDriver(name="shaker", body_j="base", axis_i=(1.0, 0.0, 0.0), input="u"),
            ],
            forces=[SpringDamper(name="spring", body_i="base", body_j="mass", stiffness=k)],
            sensors=[JointReaction(name="drive", constraint="shaker", body="base"), Point(name="far", body="mass")],
            inputs=[Input(name="u", signal=Constant(value=0.0))],
        )
        linear = about_rest(system)
        assert linear.states == ("q.mass.x", "v.mass.x")
        np.testing.assert_allclose(linear.A, [[0.0, 1.0], [-k / mass, 0.0]], atol=1e-9)
        np.testing.assert_allclose(linear.B, [[0.0], [k / mass]], atol=1e-9)
        np.testing.assert_allclose(linear.B_acceleration, 0.0, atol=1e-12)
        row = [name for name, _ in linear.outputs].index("drive.Fx")
        # The driver carries the base's inertia and the spring.
        assert linear.D_acceleration[row, 0] == pytest.approx(1.0, rel=1e-9)
        assert linear.D[row, 0] == pytest.approx(k, rel=1e-9)
        assert linear.C[row, 0] == pytest.approx(-k, rel=1e-9)


def moving_four_bar() -> System:
    """A loop with redundant rows, a damper, a torque by an input and a rope, in motion."""
    return four_bar(
        (0.1, 0.25, 0.22, 0.3), None, crank_angle=0.8,
        forces=[
            JointSpringDamper(name="friction", joint="rocker_bearing", stiffness=2.0, damping=0.3),
            LumpedLoad(name="torque", body="crank", moment=(0.0, 0.0, 1.0), input="drive"),
            RopeForce(name="rope", path=[{"point": (0.0, 0.5, 0.0)}, {"body": "rocker", "point": (0.1, 0.0, 0.0)}],
                      input="pull"),
        ],
        sensors=[JointReaction(name="load", constraint="main_bearing", body="crank"),
                 JointMoment(name="moment", joint="rocker_bearing", elements=("rope",)),
                 Point(name="tip", body="coupler", point=(0.25, 0.0, 0.0))],
        inputs=[Input(name="drive", signal=Constant(value=0.7)), Input(name="pull", signal=Constant(value=4.0))],
    )  # fmt: skip


def muscle_on_a_rod() -> System:
    """First-order states: a fibre and an activation, and a filter."""
    return System(
        "muscle",
        bodies=[rod("rod", 0.3, 1.0, angle=-0.4)],
        constraints=[hinge("shoulder", "ground", "rod", (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))],
        forces=[
            Gravity(name="weight", acceleration=(0.0, -G, 0.0)),
            ThelenMuscle(
                name="muscle", path=[{"point": (0.0, 0.25, 0.0)}, {"body": "rod", "point": (0.05, 0.0, 0.0)}],
                excitation="drive", max_isometric_force=300.0, optimal_fibre_length=0.1, tendon_slack_length=0.16,
                start_activation=0.4,
            ),
            FirstOrder(name="lag", input="drive", gain=2.0, time_constant=0.1),
        ],
        sensors=[JointMoment(name="moment", joint="shoulder", elements=("muscle",))],
        inputs=[Input(name="drive", signal=Constant(value=0.35))],
    )  # fmt: skip


def driven_pendulum() -> System:
    """A pendulum whose support a driver shakes: inputs by value, rate and second derivative."""
    return System(
        "shaken",
        bodies=[rod("slide", 0.2, 0.5), rod("rod", 0.4, 1.0, angle=-1.2)],
        constraints=[
            hinge("pivot", "slide", "rod", (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)),
            LineGuide(name="rail", body_j="slide", axis_i=(1.0, 0.0, 0.0)),
            PositionDriver(name="shaker", body_j="slide", axis_i=(1.0, 0.0, 0.0), input="u"),
        ],
        forces=[
            Gravity(name="weight", acceleration=(0.0, -G, 0.0)),
            *(SpringDamper(name=f"hold{k}", body_j="slide", point_i=p, point_j=(0.1, 0.1, 0.1), stiffness=80.0)
              for k, p in enumerate([(1.0, 1.0, 0.0), (-1.0, 0.5, 1.0), (0.0, -1.0, -1.0)])),
        ],
        sensors=[JointReaction(name="drive", constraint="shaker", body="slide")],
        inputs=[Input(name="u", signal=Harmonic(amplitude=0.1, frequency=1.0, phase=0.3))],
    )  # fmt: skip


class TestAgainstDifferences:
    @pytest.mark.parametrize("make", [moving_four_bar, muscle_on_a_rod, driven_pendulum])
    def test_matrices(self, make):
        """Differences over 1e-6 err by rounding, 1e-10 of the rates over it, and by 1e-7 where a tendon is curved."""
        world = World(Model(make()))
        world.advance(0.15)
        world.settle()
        point = world.operating_point(behind=True)
        linear = linearise(world.model, point)
        f = Charted(world.model, linear)
        x, u = f.start(), point.u
        xdot, y = f(x, u)
        n = len(f.z)
        np.testing.assert_allclose(xdot[:n], point.v[f.z], atol=1e-8)
        np.testing.assert_allclose(xdot[n : 2 * n], point.a[f.z], rtol=1e-6, atol=1e-6)
        A, B, C, D = differences(f, x, u)
        for found, expected in (
            (linear.A, A), (linear.B, B[0]), (linear.B_rate, B[1]), (linear.B_acceleration, B[2]),
        ):  # fmt: skip
            np.testing.assert_allclose(found, expected, atol=2e-6 * max(1.0, np.abs(A).max()))
        # With redundant rows the share of each in a reaction is a convention; sums are not.
        rows = [k for k, (name, _) in enumerate(linear.outputs) if not (world.model.redundant_rows and "load" in name)]
        for found, expected in (
            (linear.C, C), (linear.D, D[0]), (linear.D_rate, D[1]), (linear.D_acceleration, D[2]),
        ):  # fmt: skip
            np.testing.assert_allclose(found[rows], expected[rows], atol=2e-6 * max(1.0, np.abs(C).max()))
        assert len(y) == len(linear.y)

    def test_names(self):
        world = World(Model(muscle_on_a_rod()))
        world.settle()
        linear = linearise(world.model, world.operating_point())
        assert linear.states[-3:] == ("q.muscle.fibre_length", "q.muscle.activation", "q.lag.x")
        assert linear.inputs == ("drive",)
        assert linear.outputs == (("moment", "Nm"),)
        assert linear.as_dict()["states"] == list(linear.states)


class TestWrongPoints:
    def test_a_point_out_of_balance_is_named(self):
        world = World(Model(double_pendulum(1.0, (0.4, 0.0))))
        world.settle()
        point = world.operating_point()
        with pytest.raises(InputError, match=r"the equation of 'upper\..*' is open by"):
            linearise(world.model, point._replace(lam=0.0 * point.lam, a=0.0 * point.a))

    def test_a_point_off_the_constraints_is_named(self):
        world = World(Model(ball_and_rod(0.8)))
        world.settle()
        point = world.operating_point()
        q = point.q + np.array([0.0, 0.1, 0.0])
        with pytest.raises(InputError, match="constraint 'rod.length' is open by"):
            linearise(world.model, point._replace(q=q, lam=0.0 * point.lam, a=np.array([0.0, -G, 0.0])))

    def test_a_constraint_on_a_first_order_state_is_refused(self, monkeypatch):
        world = World(Model(ball_and_rod(0.8)))
        world.settle()
        monkeypatch.setattr(world.model, "second_order", np.array([True, False, True]))
        with pytest.raises(ModelError, match="distance 'rod' reads 'ball.y', a state of first order"):
            linearise(world.model, world.operating_point())


class TestPictures:
    def test_modes_are_drawn(self, tmp_path: Path):
        pytest.importorskip("matplotlib")
        out = draw_modes(tmp_path / "modes.png", about_rest(double_pendulum(0.6)))
        assert out.read_bytes().startswith(b"\x89PNG")

    def test_the_ending_says_the_kind_of_picture(self, tmp_path: Path):
        with pytest.raises(InputError, match="Expected a name that ends with .png, .svg, .pdf"):
            draw_modes(tmp_path / "modes.gif", about_rest(double_pendulum(0.6)))

    def test_nothing_to_draw_is_said(self, tmp_path: Path):
        chain = spring_mass_chain(1, 1.0, 1.0)
        system = System(
            "lag", bodies=chain.bodies, constraints=chain.constraints, inputs=[Input(name="u")],
            forces=[FirstOrder(name="lag", input="u", time_constant=0.5), *chain.forces],
        )  # fmt: skip
        linear = about_rest(system)
        lag = [m for m in linear.modes() if "lag" in m.words]
        assert lag[0].damping == pytest.approx(1.0)
        with pytest.raises(InputError, match="no mode of this model moves a body"):
            draw_modes(tmp_path / "modes.png", linear, lag)
