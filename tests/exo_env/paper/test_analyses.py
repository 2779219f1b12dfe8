"""The paper's system at rest, in inverse dynamics, and its modes."""

from __future__ import annotations

import numpy as np
import pytest

from dms_core import Model, SolverOptions
from dms_core.analyses import inverse_dynamics, linearise, motion_of, static_equilibrium, static_optimisation
from dms_core.model import Constant
from exo_env.ecosystem.ecosystem import Ecosystem
from exo_env.paper.scenarios import load_scenarios, run


def resting(weight: float, assistance: float, biceps: float = 0.01):
    """The ecosystem at 60 degrees, its reference too, under a weight."""
    angle = Constant(value=np.radians(60.0))
    drive = {m: Constant(value=biceps) for m in ("BIClong", "BICshort", "BRA")}
    system = Ecosystem(weight=weight).system(np.radians(60.0), angle, drive, assistance=assistance)
    return static_equilibrium(Model(system))


class TestElbowAtRest:
    @pytest.mark.parametrize("weight", [1.0, 10.0])
    def test_the_device_holds_every_load_at_its_reference(self, weight):
        """An integral leaves no error, so that the elbow rests at 60 degrees and the moments are in balance."""
        result = resting(weight, 1.0)
        y = {name: x[-1] for name, x in result.states().sensors().items()}
        assert np.degrees(y["elbow_angle.angle"]) == pytest.approx(60.0, abs=1e-6)
        assert result.last.stable
        assert y["gym_rope_tension"] == pytest.approx(weight * 9.8066, rel=1e-6)
        assert y["exo_moment"] > 0.0

    def test_a_heavier_weight_leaves_the_elbow_lower_where_only_muscles_hold_it(self):
        angles = []
        for weight in (1.0, 2.0, 4.0):
            result = resting(weight, 0.0, biceps=0.3)
            y = {name: x[-1] for name, x in result.states().sensors().items()}
            angles.append(np.degrees(y["elbow_angle.angle"]))
            assert result.last.stable
        assert angles[0] > angles[1] > angles[2]

    def test_a_run_comes_to_rest_there(self):
        from dms_core import simulate

        result = resting(1.0, 0.0, biceps=0.1)
        at_rest = result.states().sensors()["elbow_angle.angle"][-1]
        run_ = simulate(result.last.model, 8.0, SolverOptions(rtol=1e-5)).check()
        # Swings have died out to 1e-4 of their size by then.
        assert run_.sensors()["elbow_angle.angle"][-1] == pytest.approx(at_rest, abs=1e-3)


class TestScenario3:
    @pytest.fixture(scope="class")
    @staticmethod
    def found():
        exercise, scenarios = load_scenarios()
        done = run(scenarios[2], exercise, options=SolverOptions(rtol=1e-6))
        system = done.trajectory.model.system
        times = np.arange(0.0, exercise.duration + 1e-9, 0.02)
        motion = motion_of(done.trajectory, ["elbow_angle", "grip"], 0.005)
        ropes = [force.name for force in system.forces if force.kind == "rope_force"]
        inverse = inverse_dynamics(system, times, motion, leave_out=ropes)
        y = done.trajectory.sensors(np.minimum(times, done.trajectory.t[-1]))
        return system, times, inverse, y

    def test_inverse_dynamics_gives_back_the_net_joint_moment(self, found):
        _, _, inverse, y = found
        net = y["muscle_moment"] + y["exo_moment"]
        error = inverse.loads["elbow_angle"] - net
        # Single samples err where a kink of the command lies between two of them; 8.3 Nm is the peak.
        assert np.sqrt(np.mean(error**2)) < 3e-3
        assert np.abs(error).max() < 5e-2
        # Nothing drives the handle's swing.
        assert np.abs(inverse.loads["grip"]).max() < 1e-3

    def test_static_optimisation_gives_back_the_muscle_command(self, found):
        """The patient's command is half of an optimal one plus a reflex: optimal to a few thousandths."""
        system, _, inverse, y = found
        muscles = inverse.loads["elbow_angle"] - y["exo_moment"]
        result = static_optimisation(system, inverse, loads={"elbow_angle": muscles})
        assert result.joints == ("elbow_angle",)
        assert np.abs(result.shortage).max() < 1e-4
        for k, name in enumerate(result.muscles):
            error = result.activations[:, k] - y[f"{name}.sensor.activation"]
            assert np.sqrt(np.mean(error**2)) < 3e-3
            assert np.abs(error).max() < 1e-2


class TestModes:
    def test_arm_with_device(self):
        """A relaxed arm that hangs on the device: stable, and the reference moves the elbow by as much."""
        last = resting(1.0, 1.0).last
        linear = last.linearisation
        assert linear.stable
        outputs = [name for name, _ in linear.outputs]
        elbow, psi = outputs.index("elbow_angle.angle"), linear.inputs.index("psi")
        # Static gain C (-A)^-1 B + D of a controller with an integral is 1.
        gain = linear.C[elbow] @ np.linalg.solve(-linear.A, linear.B[:, psi]) + linear.D[elbow, psi]
        assert gain == pytest.approx(1.0, abs=1e-4)
        assert any("elbow" in mode.words for mode in linear.modes())

    def test_about_a_moving_state_of_a_run(self):
        from dms_core import World

        world = World(resting(1.0, 0.0).last.model)
        world.advance(0.2)
        world.settle()
        linear = linearise(world.model, world.operating_point(behind=True))
        assert np.isfinite(linear.A).all() and len(linear.states) == len(linear.A)
