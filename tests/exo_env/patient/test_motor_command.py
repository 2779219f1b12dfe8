"""Static optimisation: the least squares, their moment, and what they do on an arm that is as the subject believes."""

import numpy as np
import pytest
from scipy.optimize import minimize

from dms_core import simulate
from dms_core.errors import InputError, SimulationError
from exo_env.ecosystem.arm import Arm
from exo_env.ecosystem.ecosystem import Ecosystem, Proprioception
from exo_env.ecosystem.exoskeleton import Exoskeleton
from exo_env.ecosystem.gym_machine import GymMachine
from exo_env.paper.scenarios import build, load_scenarios
from exo_env.patient.excitation import motor_command
from exo_env.patient.excitation.motor_command import InternalModel, plan, plan_course
from exo_env.patient.excitation.static_optimisation import least_squares


@pytest.fixture(scope="module")
def command():
    exercise, _ = load_scenarios()
    machine = GymMachine.from_config("gym_machine/pulley.yaml")
    return plan(InternalModel.of(Arm(), machine, 1.0), exercise.course, exercise.duration)


@pytest.mark.parametrize("wanted", [5.0, 0.3, -4.0])
def test_least_squares_against_a_general_optimiser(wanted):
    full = np.array([-16.0, -12.0, -11.0, 22.0, 14.0, 16.0])
    found = np.zeros(6)
    left = least_squares(wanted, full, found)
    other = minimize(
        lambda a: a @ a, np.full(6, 0.2), jac=lambda a: 2 * a, bounds=[(0.01, 1.0)] * 6, method="SLSQP",
        constraints={"type": "eq", "fun": lambda a: full @ a - wanted, "jac": lambda a: full}, options={"ftol": 1e-14},
    )  # fmt: skip
    assert other.success and left == pytest.approx(0.0, abs=1e-9)
    # SLSQP stops within about the square root of its ftol.
    np.testing.assert_allclose(found, other.x, atol=1e-6)


def test_a_moment_out_of_reach_is_reported():
    found = np.zeros(6)
    left = least_squares(100.0, np.array([-16.0, -12.0, -11.0, 22.0, 14.0, 16.0]), found)
    np.testing.assert_allclose(found, [0.01] * 3 + [1.0] * 3)
    assert left == pytest.approx(52.0 - 0.01 * 39.0 - 100.0)


def test_a_command_that_does_not_settle_is_an_error(monkeypatch):
    """Six iterations are needed; three are too few."""
    monkeypatch.setattr(motor_command, "SWEEPS", 3)
    exercise, _ = load_scenarios()
    model = InternalModel.of(Arm(), GymMachine.from_config("gym_machine/pulley.yaml"), 1.0)
    with pytest.raises(SimulationError, match="does not settle: after 3 iterations .* may still be wrong by 0"):
        plan(model, exercise.course, exercise.duration)


@pytest.mark.parametrize("time", [0.2, 2.75, 5.3])
def test_the_command_holds_the_arm_at_rest(command, time):
    """Where the reference rests, muscles in static equilibrium at these activations give the wanted moment."""
    exercise, _ = load_scenarios()
    arm, k = Arm(), int(np.argmin(np.abs(command.times - time)))
    psi = exercise.course(command.times[k])[0]
    moment = 0.0
    for a, m in zip(command.activations[k], command.muscles, strict=True):
        length, lever = arm.muscle_geometry(m, psi)
        muscle = arm.muscle(m)
        moment += lever * muscle.tension(length, muscle.equilibrium(length, a))
    # The iteration between tendon and activation stops at 1e-4 of activation: 0.01 Nm of 60 Nm, twice that is allowed.
    assert moment == pytest.approx(command.moment[k], abs=0.02)


def test_wanted_moment_at_rest_is_weight_times_lever(command):
    """At 100 deg: forearm by the reference's own gravity, weight and handle by the geometry of the machine."""
    arm, machine, k = (
        Arm(),
        GymMachine.from_config("gym_machine/pulley.yaml"),
        int(np.argmin(np.abs(command.times - 2.75))),
    )
    psi = np.radians(100.0)
    grip = arm.rotation(psi) @ arm.grip
    to_pulley = np.array(machine.low_pulley) - arm.elbow - grip
    pull = 9.8066 * to_pulley / np.linalg.norm(to_pulley) + machine.handle.mass * np.array(arm.gravity)
    outside = arm.axis @ np.cross(grip, pull) + arm.gravity_moment(psi)
    # Both exact; the reference has come to rest to rounding.
    assert command.moment[k] == pytest.approx(-outside, abs=1e-9)


def test_a_coarse_table_of_times_gives_the_same_command(command):
    """The environment plans every 50 ms, which keeps a reset short."""
    exercise, _ = load_scenarios()
    machine = GymMachine.from_config("gym_machine/pulley.yaml")
    times = np.linspace(0.0, exercise.duration, 111)
    coarse = plan_course(InternalModel.of(Arm(), machine, 1.0), times, np.array([exercise.course(t) for t in times]))
    for k in range(6):
        # Linear between points 50 ms apart, along a movement whose fastest part lasts a second; 0.0018 was measured.
        drawn = np.interp(command.times, times, coarse.activations[:, k])
        np.testing.assert_allclose(drawn, command.activations[:, k], atol=4e-3)


def test_a_subject_that_is_right_about_everything_follows():
    """On a device without weight and friction the command alone leads the arm along the reference."""
    exercise, scenarios = load_scenarios()
    device = Exoskeleton.from_config("exoskeletons/elbow.yaml")
    link = device.lower_link.changed(mass=1e-3 * device.lower_link.mass, inertia=(1e-6, 1e-6, 1e-6))
    weightless = device.changed(hinge_damping=0.0, upper_link=link, lower_link=link)
    alone = exercise.changed(proprioception=Proprioception(gain=0.0))
    model, command = build(scenarios[0], alone, Ecosystem(device=weightless))
    times = np.linspace(0.0, exercise.duration, 111)
    angle = simulate(model, exercise.duration).check().sensors(times)["elbow_angle.angle"]
    error = np.degrees(angle - [exercise.course(t)[0] for t in times])
    assert command.shortage < 1e-6
    # 3.3 deg; nothing pulls the arm back, and the command does not foresee activation dynamics. On the real device,
    # whose weight and friction the subject does not know, the same command misses by 17 deg.
    assert np.sqrt(np.mean(error**2)) < 4.0


def test_scaling(command):
    half = command.excitations(0.5)
    at = int(np.argmax(command.activations[:, 3]))
    assert half["BIClong"].values[at] == pytest.approx(0.5 * command.activations[at, 3])
    assert set(command.excitations(0.0)["BRA"].values) == {0.01}
    with pytest.raises(InputError, match="maximum activation = 1.5"):
        command.excitations(1.5)
    most = np.linspace(0.2, 1.0, len(command.muscles))
    for k, (name, curve) in enumerate(command.excitations(most).items()):
        assert curve == command.excitations(float(most[k]))[name]
        assert command.start_activation(most)[name] == curve.values[0]
    with pytest.raises(InputError, match="from 0 to 1"):
        command.excitations(np.where(most < 1.0, most, np.nan))
