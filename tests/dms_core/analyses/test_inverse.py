"""Inverse dynamics gives back what made a motion; static optimisation against another solver and its own conditions."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import minimize

from dms_core import SolverOptions, simulate
from dms_core.analyses import inverse_dynamics, motion_of, static_optimisation
from dms_core.analyses.least_activations import least_activations
from dms_core.errors import InputError
from dms_core.model import (
    Constant,
    Gravity,
    Harmonic,
    Input,
    JointAngle,
    LumpedLoad,
    MuscleSensor,
    System,
    ThelenMuscle,
)
from dms_core.model.smoothing import low_pass
from tests.dms_core.analyses.mechanisms import G, double_pendulum, hinge, rod


def torques() -> System:
    """A double pendulum with a torque on each rod; that on the lower one acts on the upper one in return."""
    return double_pendulum(
        0.5, (0.3, 0.5),
        forces=[
            LumpedLoad(name="upper_torque", body="upper", moment=(0.0, 0.0, 1.0), input="first"),
            LumpedLoad(name="lower_torque", body="lower", moment=(0.0, 0.0, 1.0), input="second"),
            LumpedLoad(name="reaction", body="upper", moment=(0.0, 0.0, -1.0), input="second"),
        ],
        sensors=[JointAngle(name="raise", joint="shoulder")],
        inputs=[Input(name="first", signal=Harmonic(amplitude=3.0, frequency=0.8)),
                Input(name="second", signal=Harmonic(amplitude=1.0, frequency=1.3, phase=1.0))],
    )  # fmt: skip


class TestInverseDynamics:
    def test_it_gives_back_the_torques_of_a_run(self):
        run = simulate(torques(), 1.5, SolverOptions(rtol=1e-9)).check()
        motion = motion_of(run, ["raise", "bend"], 0.01)
        times = np.linspace(0.1, 1.4, 27)
        result = inverse_dynamics(torques(), times, motion, leave_out=["upper_torque", "lower_torque", "reaction"])
        w = 2.0 * np.pi
        for name, torque in (
            ("raise", 3.0 * np.sin(0.8 * w * times)), ("bend", np.sin(1.3 * w * times + 1.0)),
        ):  # fmt: skip
            error = np.abs(result.loads[name] - torque)
            # Dense output errs by up to 1e-6 rad where a step is far longer than the one before it; differentiated
            # twice over samples of 0.01 s that is 1e-2 rad/s^2. Elsewhere it is a thousandth of that.
            assert error.max() < 4e-2
            assert np.median(error) < 1e-4
        assert result.left_out == ("upper_torque", "lower_torque", "reaction")

    def test_nothing_is_missing_where_the_torques_stay_in(self):
        run = simulate(torques(), 1.0, SolverOptions(rtol=1e-9)).check()
        times = np.linspace(0.1, 0.9, 9)
        loads = inverse_dynamics(torques(), times, motion_of(run, ["raise", "bend"], 0.01)).loads
        np.testing.assert_allclose(loads["raise"], 0.0, atol=1e-2)
        np.testing.assert_allclose(loads["bend"], 0.0, atol=1e-2)

    def test_a_joint_that_is_not_there(self):
        with pytest.raises(InputError, match="motion: 'knee' is no revolute joint, slider or joint_angle sensor"):
            inverse_dynamics(torques(), np.array([0.0, 1.0]), {"knee": Constant(value=0.0)})
        run = simulate(torques(), 0.1)
        with pytest.raises(InputError, match="'knee' is no revolute joint or joint_angle sensor. There are: bend"):
            motion_of(run, ["knee"], 0.01)


class TestFilter:
    def test_half_of_the_power_passes_at_the_cut_off(self):
        t = np.arange(0.0, 20.0, 0.005)
        middle = slice(1000, 3000)
        for frequency, share in ((0.5, 1.0), (6.0, np.sqrt(0.5)), (60.0, 0.0)):
            x = np.sin(2.0 * np.pi * frequency * t)
            passed = low_pass(t, x, 6.0, "test")[middle]
            # In phase, so that the share is the whole of it: what is left of 60 Hz is (6 / 60)^4 by theory.
            np.testing.assert_allclose(passed, share * x[middle], atol=3e-4)

    def test_noise_is_taken_out_of_accelerations(self):
        rng = np.random.default_rng(1)
        run = simulate(torques(), 1.5, SolverOptions(rtol=1e-8)).check()
        clean = motion_of(run, ["raise", "bend"], 0.01)
        noisy = {
            name: signal.model_copy(update={"values": tuple(np.array(signal.values) + 1e-3 * rng.normal(size=151))})
            for name, signal in clean.items()
        }
        filtered = {name: signal.model_copy(update={"cutoff": 6.0}) for name, signal in noisy.items()}
        times = np.linspace(0.3, 1.2, 46)
        out = ["upper_torque", "lower_torque", "reaction"]
        right = np.sin(1.3 * 2.0 * np.pi * times + 1.0)
        error = [
            np.std(inverse_dynamics(torques(), times, m, leave_out=out).loads["bend"] - right)
            for m in (noisy, filtered)
        ]
        # The cut-off also takes a part of the motion itself, so that not all of the error goes.
        assert error[1] < 0.15 * error[0]


class TestLeastActivations:
    @pytest.mark.parametrize("seed", range(6))
    def test_against_slsqp_and_the_conditions_of_karush_kuhn_and_tucker(self, seed):
        rng = np.random.default_rng(seed)
        d, m = int(rng.integers(1, 4)), 8
        F = rng.normal(size=(d, m)) * 20.0
        b = F @ rng.uniform(0.01, 1.0, m) * rng.uniform(0.3, 1.0)
        found = least_activations(F, b, 0.01, 1.0)
        a, nu = found.activations, found.multipliers
        np.testing.assert_allclose(F @ a, b, atol=1e-7)
        x = F.T @ nu
        np.testing.assert_allclose(a, np.clip(x, 0.01, 1.0), atol=1e-12)  # stationary; bounds push inwards
        other = minimize(
            lambda a: a @ a, np.full(m, 0.3), jac=lambda a: 2.0 * a, method="SLSQP", bounds=[(0.01, 1.0)] * m,
            constraints={"type": "eq", "fun": lambda a: F @ a - b, "jac": lambda a: F}, options={"ftol": 1e-14},
        )  # fmt: skip
        assert a @ a <= other.fun * (1.0 + 1e-9)
        np.testing.assert_allclose(a, other.x, atol=1e-5)  # as near as SLSQP comes

    def test_what_nobody_can_give_is_the_shortage(self):
        found = least_activations(np.array([[10.0, 5.0, -3.0]]), np.array([40.0]), 0.01, 1.0)
        np.testing.assert_allclose(found.activations, [1.0, 1.0, 0.01])
        np.testing.assert_allclose(found.shortage, [40.0 - 15.0 + 0.03])

    def test_nothing_wanted(self):
        found = least_activations(np.array([[10.0, -10.0]]), np.array([0.0]), 0.01, 1.0)
        np.testing.assert_allclose(found.activations, [0.01, 0.01])


def two_muscles(excitations=(0.3, 0.1)) -> System:
    """A rod that two muscles of one side raise."""
    common = {"optimal_fibre_length": 0.12, "max_contraction_velocity": 10.0}
    return System(
        "two muscles",
        bodies=[rod("rod", 0.3, 1.0, angle=-0.6)],
        constraints=[hinge("joint", "ground", "rod", (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))],
        forces=[
            Gravity(name="weight", acceleration=(0.0, -G, 0.0)),
            ThelenMuscle(name="strong", path=[{"point": (0.0, 0.25, 0.0)}, {"body": "rod", "point": (0.05, 0.0, 0.0)}],
                         excitation="e1", max_isometric_force=400.0, tendon_slack_length=0.15, **common),
            ThelenMuscle(name="weak", path=[{"point": (-0.02, 0.28, 0.0)}, {"body": "rod", "point": (0.03, 0.0, 0.0)}],
                         excitation="e2", max_isometric_force=300.0, tendon_slack_length=0.18, **common),
        ],
        sensors=[JointAngle(name="angle", joint="joint")],
        inputs=[Input(name=f"e{k + 1}", signal=Constant(value=e)) for k, e in enumerate(excitations)],
    )  # fmt: skip


class TestMuscles:
    def test_against_slsqp_at_rest_with_tendons_in_equilibrium(self):
        """At rest each muscle's force follows from its activation by `ThelenMuscle.equilibrium`: a small programme."""
        system = two_muscles()
        times = np.linspace(0.0, 0.5, 11)
        inverse = inverse_dynamics(system, times, {"angle": Constant(value=-0.5)})
        result = static_optimisation(system, inverse)
        moment = inverse.loads["angle"][0]
        assert moment == pytest.approx(0.15 * G * np.cos(0.5), rel=1e-9)
        muscles = [system.element(name) for name in ("strong", "weak")]
        tip = [np.array([x * np.cos(-0.5), x * np.sin(-0.5)]) for x in (0.05, 0.03)]
        root = [np.array([0.0, 0.25]), np.array([-0.02, 0.28])]
        ways = [r - t for r, t in zip(root, tip, strict=True)]
        arms = [(t[0] * w[1] - t[1] * w[0]) / np.linalg.norm(w) for t, w in zip(tip, ways, strict=True)]
        np.testing.assert_allclose(result.arms[0, 0], arms, rtol=1e-9)

        def force(i: int, a: float) -> float:
            length = float(np.linalg.norm(ways[i]))
            return muscles[i].tension(length, muscles[i].equilibrium(length, a))

        other = minimize(
            lambda a: a @ a, [0.1, 0.1], method="SLSQP", bounds=[(0.01, 1.0)] * 2, options={"ftol": 1e-13},
            constraints={"type": "eq", "fun": lambda a: sum(arms[i] * force(i, a[i]) for i in range(2)) - moment},
        )  # fmt: skip
        # It takes the force at full activation at the fibre's present length, as static optimisation does by custom,
        # and not its change with activation; the sum of squares is flat there.
        assert result.activations[5] @ result.activations[5] == pytest.approx(other.fun, rel=2e-2)
        given = sum(arms[i] * force(i, result.activations[5, i]) for i in range(2))
        assert given == pytest.approx(moment, rel=1e-3)
        assert np.abs(result.shortage).max() < 1e-6

    def test_one_muscle_has_no_choice_and_gets_its_activation_back(self):
        """Fibre, tendon and activation dynamics in a moving joint: what a run did is found from its angle alone."""
        both = two_muscles()
        command = Input(name="e1", signal=Harmonic(amplitude=0.1, frequency=0.7, offset=0.25))
        alone = System(
            "one muscle", bodies=both.bodies, constraints=both.constraints,
            forces=[f for f in both.forces if f.name != "weak"], inputs=[command],
            sensors=[*both.sensors, MuscleSensor(name="sensed", muscle="strong")],
        )  # fmt: skip
        run = simulate(alone, 3.0, SolverOptions(rtol=1e-8)).check()
        times = np.arange(0.0, 3.0, 0.02)
        inverse = inverse_dynamics(alone, times, motion_of(run, ["angle"], 0.005))
        result = static_optimisation(alone, inverse)
        y = run.sensors(times)
        # It falls onto its tendon at first, faster than differences over 0.02 s can tell.
        late = times > 1.0
        np.testing.assert_allclose(result.activations[late, 0], y["sensed.activation"][late], atol=5e-3)
        np.testing.assert_allclose(result.forces[late, 0], y["sensed.tendon_force"][late], atol=0.5)

    @pytest.mark.parametrize(
        ("arguments", "said"),
        [
            ({"bounds": (0.5, 0.2)}, "bounds: Expected two activations from 0.01 to 1 in rising order"),
            ({"loads": {"hip": np.zeros(11)}}, "loads: 'hip' is no driver of the motion. Drivers: angle."),
            ({"muscles": []}, "muscles: Expected a model with muscles, got none."),
        ],
    )
    def test_wrong_arguments(self, arguments, said):
        system = two_muscles()
        inverse = inverse_dynamics(system, np.linspace(0.0, 0.5, 11), {"angle": Constant(value=-0.5)})
        with pytest.raises(InputError) as error:
            static_optimisation(system, inverse, **arguments)
        assert said in str(error.value)
