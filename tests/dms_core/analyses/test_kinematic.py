"""Driven mechanisms against closed forms; missing drivers and singular positions."""

from __future__ import annotations

import math

import numpy as np
import pytest

from dms_core import SolverOptions, simulate
from dms_core.analyses import driver_loads, kinematic
from dms_core.errors import InputError, ModelError, ModelWarning, SimulationError
from dms_core.model import (
    AngleDriver,
    Constant,
    Gear,
    Harmonic,
    Input,
    Lines,
    MinimumJerk,
    Samples,
    System,
    TorsionSpring,
    TurnCounter,
)
from tests.dms_core.analyses.mechanisms import four_bar, four_bar_angles, slider_crank
from tests.dms_core.model.constraints.wheels import axle, wheel

EXACT = 1e-10
"""Positions are closed to 1e-13; velocities and accelerations follow from linear equations of condition below 1e3."""
BARS = (0.1, 0.25, 0.22, 0.3)


class TestSliderCrank:
    def test_position_velocity_acceleration(self):
        """x = r cos t + sqrt(l^2 - r^2 sin^2 t) (Norton, Design of Machinery, eq. 13.1), with its derivatives."""
        r, length, omega = 0.1, 0.28, 7.0
        times = np.linspace(0.0, 2.0, 120)
        result = kinematic(slider_crank(r, length, Lines(times=(0.0, 2.5), values=(0.0, 2.5 * omega))), times).check()
        y = result.sensors()
        # The first time is a kink of the input: what holds behind it.
        t = times * omega
        s, c = np.sin(t), np.cos(t)
        root = np.sqrt(length**2 - (r * s) ** 2)
        x = r * c + root
        rate = -r * omega * s - r**2 * omega * s * c / root
        acceleration = (
            -r * omega**2 * c - r**2 * omega**2 * (c**2 - s**2) / root - r**4 * omega**2 * (s * c) ** 2 / root**3
        )
        np.testing.assert_allclose(y["place.position.x"], x, atol=EXACT)
        np.testing.assert_allclose(y["place.velocity.x"], rate, atol=EXACT)
        np.testing.assert_allclose(y["place.acceleration.x"], acceleration, atol=1e-8)
        assert result.singular == ()


class TestTurns:
    """Joints that turn more than once, for which poses do not hold the whole turns."""

    def wheels(self, *parts, turns: float, forces=(), inputs=()) -> System:
        """A wheel that is driven by so many turns in a second, and one beside it."""
        second = wheel("second", 0.05, 0.3)
        first = wheel("first", 0.02)
        course = Lines(times=(0.0, 1.0), values=(0.0, 2.0 * math.pi * turns))
        drive = AngleDriver(name="drive", joint="first_axle", input="course")
        return System(
            bodies=[first, second], constraints=[axle(first), axle(second), drive, *parts], forces=forces,
            inputs=[Input(name="course", signal=course), *inputs],
        )  # fmt: skip

    @pytest.mark.parametrize(("ratio", "turns"), [(-1.5, 7.0), (2.0 / 3.0, -4.0), (-3.0, 5.0)])
    def test_a_gear_turns_on_and_on(self, ratio, turns):
        gear = Gear(name="gear", joint_i="first_axle", joint_j="second_axle", ratio=ratio)
        counters = [TurnCounter(name=f"{n}_turns", joint=f"{n}_axle") for n in ("first", "second")]
        # Few samples: a turn and more between two of them.
        result = kinematic(self.wheels(gear, turns=turns, forces=counters), np.linspace(0.0, 1.0, 5)).check()
        first = 2.0 * math.pi * turns * result.t
        np.testing.assert_allclose(result.states.coordinate("first_turns.angle"), first, atol=1e-11)
        np.testing.assert_allclose(result.states.coordinate("second_turns.angle"), ratio * first, atol=1e-11)
        np.testing.assert_allclose(result.states.rate("second_turns.angle"), 2.0 * math.pi * turns * ratio, rtol=1e-11)
        # Wheels that turn evenly need no moment.
        assert np.abs(driver_loads(result.states.model, result.states)["drive"]).max() < 1e-10

    def test_a_spring_that_is_wound_up_loads_its_driver(self):
        """M = k theta after five turns, which the driver of a wheel that turns evenly gives."""
        spring = TorsionSpring(name="coil", joint="first_axle", stiffness=0.3, damping=0.01)
        hold = AngleDriver(name="hold", joint="second_axle", input="still")
        still = Input(name="still", signal=Constant(value=0.0))
        system = self.wheels(hold, turns=5.0, forces=[spring], inputs=[still])
        result = kinematic(system, np.linspace(0.0, 1.0, 21)).check()
        load = driver_loads(result.states.model, result.states)["drive"]
        w = 10.0 * math.pi
        np.testing.assert_allclose(load, 0.3 * w * result.t + 0.01 * w, atol=1e-8)


class TestFourBar:
    def course(self):
        return Harmonic(amplitude=1.3, frequency=0.5, offset=1.0)

    def test_position_velocity_acceleration(self):
        """Loop closure a e^(i t) + b e^(i beta) = d + c e^(i theta), twice differentiated (Norton, sect. 6.7, 7.3)."""
        a, b, c, _ = BARS
        times = np.linspace(0.0, 2.0, 90)
        y = kinematic(four_bar(BARS, self.course()), times).check().sensors()
        w = math.pi
        t2 = 1.0 + 1.3 * np.sin(w * times)
        o2, a2 = 1.3 * w * np.cos(w * times), -1.3 * w * w * np.sin(w * times)
        t3, t4 = np.array([four_bar_angles(BARS, x) for x in t2]).T
        o3 = a * o2 * np.sin(t4 - t2) / (b * np.sin(t3 - t4))
        o4 = a * o2 * np.sin(t2 - t3) / (c * np.sin(t4 - t3))
        # Real and imaginary part of the second derivative, for the two accelerations.
        right = a * (1j * a2 - o2**2) * np.exp(1j * t2) - b * o3**2 * np.exp(1j * t3) + c * o4**2 * np.exp(1j * t4)
        a4 = [
            np.linalg.solve(
                [[-b * math.sin(p), c * math.sin(q)], [b * math.cos(p), -c * math.cos(q)]], [-x.real, -x.imag]
            )[1]
            for p, q, x in zip(t3, t4, right, strict=True)
        ]
        np.testing.assert_allclose(np.unwrap(y["rocker_angle.angle"]), t4, atol=EXACT)
        np.testing.assert_allclose(y["rocker_angle.rate"], o4, atol=1e-9)
        np.testing.assert_allclose(y["rocker_angle.acceleration"], a4, atol=1e-7)

    def test_drivers_load_is_that_of_a_run_in_time(self):
        times = np.linspace(0.0, 1.0, 21)
        model = four_bar(BARS, MinimumJerk(times=(0.0, 1.0), values=(1.0, 2.5)))
        load = driver_loads(*(lambda r: (r.states.model, r.states))(kinematic(model, times)))["motor"]
        run = simulate(model, 1.0, SolverOptions(rtol=1e-8)).check()
        row = run.model.layout.row_names.index("motor.angle")
        # A run at rtol 1e-8 has multipliers of order 2: about 1e-5 of their size.
        np.testing.assert_allclose(load, -run.at(times).lam[:, row], atol=2e-4 * np.abs(load).max())


class TestSingularPositions:
    def test_a_rocker_driven_beyond_its_reach_is_named(self):
        """The rocker's limit is where crank and coupler lie in a line: a circle about its bearing meets |b +- a|."""
        a, b, c, d = BARS
        start = four_bar_angles(BARS, 1.0)[1]
        # At the limit crank and coupler are one line of length b + a or b - a between ground and the rocker's pin.
        limits = [math.pi - math.acos((c * c + d * d - x * x) / (2.0 * c * d)) for x in (b + a, b - a)]
        low = min(limits)
        speed = -0.5
        system = four_bar(BARS, Lines(times=(0.0, 5.0), values=(start, start + 5.0 * speed)), driven="rocker")
        result = kinematic(system, np.linspace(0.0, 5.0, 101))
        reached = (low - start) / speed
        assert 0.0 < reached < 5.0
        assert "cannot reach beyond t = " in result.failure
        t = float(result.failure.partition("t = ")[2].split()[0])
        # Near the limit the crank goes as the square root of the time that is left.
        assert t == pytest.approx(reached, abs=1e-6)
        assert "'crank' turns about (0, 0, 1)" in result.failure
        assert result.t[-1] <= reached < result.t[-1] + 0.05
        with pytest.raises(SimulationError, match="singular position"):
            result.check()

    def test_a_parallelogram_goes_through_its_flat_position_and_says_so(self):
        bars = (0.1, 0.3, 0.1, 0.3)
        system = four_bar(bars, Lines(times=(0.0, 1.0), values=(1.0, 5.0)))
        result = kinematic(system, np.linspace(0.0, 1.0, 42)).check()
        # It stays a parallelogram: rocker and crank are parallel, whereas the crossed branch meets it at pi.
        y = result.sensors()
        turn = np.unwrap(y["rocker_angle.angle"]) - np.unwrap(y["crank_angle.angle"])
        np.testing.assert_allclose(turn - turn[0], 0.0, atol=1e-8)
        (flat,) = result.singular
        assert flat.t == pytest.approx((math.pi - 1.0) / 4.0, abs=1e-6)
        assert flat.sentence.startswith("singular position at t = 0.5353981")


class TestDrivers:
    def test_a_missing_driver_is_named_by_the_motion(self):
        with pytest.raises(ModelError) as error:
            kinematic(four_bar(BARS, None), np.linspace(0.0, 1.0, 3))
        assert "1 driver is missing: nothing determines that 'crank' turns about (0, 0, 1)" in str(error.value)
        assert "at revolute 'main_bearing'" in str(error.value)

    def test_two_drivers_of_one_coordinate_are_named(self):
        rocker = AngleDriver(name="second", joint="rocker_bearing", input="rock")
        angle = four_bar_angles(BARS, 1.0)[1]
        system = four_bar(
            BARS, Constant(value=1.0), constraints=[rocker], inputs=[Input(name="rock", signal=Constant(value=angle))]
        )
        with (
            pytest.warns(ModelWarning, match="drive more than the joints leave free"),
            pytest.raises(ModelError, match="the drivers 'motor', 'second' move the same coordinate"),
        ):
            kinematic(system, np.linspace(0.0, 1.0, 3))

    @pytest.mark.parametrize("times", [[], [0.0, 0.0], [1.0, 0.5], [-1.0, 0.0], [0.0, math.nan]])
    def test_times_must_rise(self, times):
        with pytest.raises(InputError, match="times: Expected finite, rising times from 0 s on"):
            kinematic(four_bar(BARS, Constant(value=1.0)), times)

    def test_recorded_samples_drive_a_joint(self):
        """A quintic spline through a sine errs by h^6 / 7! of it in value and by h^4 / 5! in acceleration, at most."""
        t = np.linspace(0.0, 2.0, 101)
        course = Samples(times=tuple(t), values=tuple(1.0 + 0.2 * np.sin(3.0 * t)), interpolation="quintic")
        y = kinematic(four_bar(BARS, course), times := np.linspace(0.0, 2.0, 37)).check().sensors()
        np.testing.assert_allclose(y["crank_angle.angle"], 1.0 + 0.2 * np.sin(3.0 * times), atol=1e-8)
        np.testing.assert_allclose(y["crank_angle.acceleration"], -1.8 * np.sin(3.0 * times), atol=1e-4)


def test_other_systems_stay_as_they_are():
    """A driven model is a model like any other: its declarations are not changed."""
    system = four_bar(BARS, Constant(value=1.0))
    assert isinstance(system, System)
    kinematic(system, np.array([0.0, 1.0]))
    assert [c.name for c in system.constraints if c.kind == "angle_driver"] == ["motor"]
