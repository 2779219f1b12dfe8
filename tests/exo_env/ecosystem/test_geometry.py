"""The joined system: size, rank, moment arms, the three guides, a device that sits badly."""

import math

import numpy as np
import pytest

from dms_core import Model, Result, SolverOptions, World, simulate
from dms_core.errors import InputError
from dms_core.model import Constant
from exo_env.ecosystem.arm import Arm
from exo_env.ecosystem.ecosystem import Ecosystem
from exo_env.ecosystem.exoskeleton import Exoskeleton
from exo_env.ecosystem.worn_exoskeleton import Misalignment
from exo_env.paper.scenarios import build, load_scenarios

START = math.radians(20.0)


@pytest.fixture(scope="module")
def device() -> Exoskeleton:
    return Exoskeleton.from_config("exoskeletons/elbow.yaml")


def at_rest(**changes) -> Model:
    return Model(Ecosystem(**changes).system(START, Constant(value=START)))


def test_the_default_system_is_the_papers():
    model = at_rest()
    bodies = [c for c in model.layout.names if c.rpartition(".")[0] in {b.name for b in model.system.bodies}]
    assert (len(model.system.bodies), len(bodies)) == (7, 49)
    assert (model.n_phi, len(model.active_rows), model.redundant_rows) == (47, 47, [])
    # Elbow and handle, and the controller's integral, which is a second-order coordinate too.
    assert model.degrees_of_freedom == 2
    # 0.141 is found; a model near a lost rank would fall far below.
    assert model.start.singular_values.min() > 0.1


@pytest.mark.parametrize(
    ("guide", "rows", "redundant"),
    [
        ("line", 48, {"guide.off_f"}),
        ("slider", 51, {"guide.off_f", "guide.off_g", "guide.turn_a", "guide.turn_g"}),
    ],
)
def test_stronger_guides_are_redundant_by_name(guide, rows, redundant):
    model = at_rest(guide=guide)
    assert (model.n_phi, len(model.active_rows)) == (rows, 47)
    assert set(model.redundant_rows) == redundant


def test_both_ropes_keep_their_sign(device):
    arms = np.array([[device.moment_arm(r, math.radians(d)) for r in ("agonist", "antagonist")] for d in range(0, 131)])
    # At least 24 mm of leverage from 0 to 130 deg, and 43 mm where the exercise is.
    assert arms[:, 0].min() > 0.024 and arms[:, 1].max() < -0.024
    assert arms[20:101, 0].min() > 0.043 and arms[20:101, 1].max() < -0.051


@pytest.mark.parametrize("rope", ["agonist", "antagonist"])
def test_the_moment_arm_is_that_of_the_system(device, rope):
    """Moment by the compiled elements under a tension of 100 N, against the plane formula."""
    angle = math.radians(70.0)
    stiff = device.changed(actuator=device.actuator.changed(pretension=100.0))
    system = Ecosystem(device=stiff).system(angle, Constant(value=angle), assistance=0.0)
    moment = simulate(system, 1e-4).sensors()["exo_moment"][0]
    both = sum(100.0 * device.moment_arm(r, angle) for r in ("agonist", "antagonist"))
    # The smoothed positive part of a command of 0 adds 3/32 N to both ropes; horns are rounded to 0.1 mm in the file.
    assert moment == pytest.approx(both * (100.0 + 3.0 / 32.0) / 100.0, rel=1e-9)
    length = lambda a: _length(device, rope, a)  # noqa: E731
    # Central difference of 1e-5 rad: its error is 1e-10 of the third derivative, below 1 m.
    assert device.moment_arm(rope, angle) == pytest.approx(
        -(length(angle + 1e-5) - length(angle - 1e-5)) / 2e-5, abs=1e-9
    )


def _length(device: Exoskeleton, rope: str, angle: float) -> float:
    ends = device.ropes[rope]
    turn = np.array([[math.cos(angle), -math.sin(angle), 0], [math.sin(angle), math.cos(angle), 0], [0, 0, 1]])
    return float(np.linalg.norm(turn @ ends.lower - np.array(ends.upper)))


def test_muscles_have_leverage_over_the_exercise():
    exercise, _ = load_scenarios()
    for deg in np.linspace(min(exercise.angles_deg), max(exercise.angles_deg), 9):
        for m in ("BIClong", "BICshort", "BRA"):
            assert Arm().muscle_geometry(m, math.radians(deg))[1] > 4e-3
        for m in ("TRIlong", "TRIlat", "TRImed"):
            assert Arm().muscle_geometry(m, math.radians(deg))[1] < -14e-3


@pytest.fixture(scope="module")
def shared_exercise():
    """Elbow angles of the first 1.5 s of scenario 3 by guide, at equal fixed steps."""
    exercise, scenarios = load_scenarios()
    times = np.linspace(0.0, 1.5, 151)

    def angles(guide: str) -> np.ndarray:
        model, _ = build(scenarios[2], exercise, Ecosystem(guide=guide))
        options = SolverOptions(fixed_step=2e-3, newton_tol=1e-4)
        return simulate(model, 1.5, options).check().sensors(times)["elbow_angle.angle"]

    return {guide: angles(guide) for guide in ("plane", "line", "slider")}


@pytest.mark.parametrize("guide", ["line", "slider"])
def test_redundant_guides_move_as_the_default(shared_exercise, guide):
    assert np.ptp(shared_exercise["plane"]) > 0.5
    # What is asked for; Newton's remainder makes 5e-11.
    np.testing.assert_allclose(shared_exercise[guide], shared_exercise["plane"], atol=1e-8, rtol=0.0)


def test_a_misaligned_device_runs():
    exercise, scenarios = load_scenarios()
    worn = Misalignment(shift=(0.004, -0.003, 0.002), tilt_deg=(3.0, -2.0))
    model, _ = build(scenarios[2], exercise, Ecosystem(misalignment=worn))
    assert (model.n_phi, len(model.active_rows)) == (47, 47)
    trajectory = simulate(model, exercise.duration).check()
    y = trajectory.sensors(np.linspace(0.0, exercise.duration, 101))
    # Hinge and elbow no longer agree: 0.004 m over a guide of 0.16 m are 1.4 deg.
    gap = np.degrees(np.abs(y["elbow_angle.angle"] - y["exo_angle.angle"]).max())
    assert 0.3 < gap < 3.0
    assert trajectory.stats.largest_phi < 1e-9
    # The controller still leads the hinge to the top of the exercise.
    assert np.degrees(y["exo_angle.angle"].max()) == pytest.approx(100.0, abs=1.0)


def test_a_guide_that_would_lock_a_misaligned_elbow_is_refused():
    with pytest.raises(InputError, match="locks the elbow"):
        Ecosystem(guide="slider", misalignment=Misalignment(shift=(0.004, 0.0, 0.0)))


def test_a_run_starts_from_any_angle():
    # At 0.4 rad the first order of elimination that was tried has a pivot of rounding size; another must be found.
    for angle in (0.3, 0.35, 0.4, 0.45, 1.0, 2.0):
        world = World(Model(Ecosystem().system(angle, Constant(value=angle))), SolverOptions(rtol=1e-3))
        assert world.advance(0.02) is Result.SUCCESS, angle
