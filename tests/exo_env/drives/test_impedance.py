"""The mode `impedance`: what the compliant law gives at rest, how its numbers change, and that it never breaks down."""

import math

import numpy as np
import pytest

from dms_core.errors import InputError
from exo_env.drives.impedance import Impedance, carried
from exo_env.ecosystem.arm import Arm
from exo_env.ecosystem.exoskeleton import Exoskeleton
from exo_env.envs.elbow_lift import ElbowLiftEnv
from tests.exo_env.drives.test_assist_moment import LIMP, STILL, with_ropes

DEVICE = Exoskeleton.named("elbow")
FIXED = {"relaxation_time": 1e4}


def made(angle=60.0, **settings):
    """An environment whose arm begins at an angle [deg]."""
    env = ElbowLiftEnv(**{"action_mode": "impedance", "patient": LIMP, "load": 1.0} | settings)
    env.reset(seed=0, options={"initial_angle_deg": angle})
    return env


def held(env, stiffness=0.0, damping=0.0, share=0.0, steps=30):
    """Readings after some control periods with numbers of the law."""
    drive = env.drive
    most = np.array([drive.max_stiffness, drive.max_damping, drive.max_gravity_share])
    for _ in range(steps):
        *_, terminated, _, info = env.step(2.0 * np.array([stiffness, damping, share]) / most - 1.0)
        assert not terminated, info
    return env.readings()


def carried_at(angle):
    """M_g at an angle of the hinge [rad] [Nm], written anew."""
    return DEVICE.own_moment(angle, float(np.linalg.norm(Arm().gravity))) - Arm().gravity_moment(angle)


@pytest.mark.parametrize("worn", [None, {"shift": [0.01, -0.02, 0.0], "tilt_deg": [0.0, 5.0]}])
@pytest.mark.parametrize("angle", [20.0, 60.0, 100.0])
def test_the_share_is_one_of_arm_and_link_of_an_average_person(angle, worn):
    env = made(angle, exoskeleton=STILL, misalignment=worn)
    for share in (1.0, 0.0, 2.5):
        r = held(env, share=share)
        # On a hinge that stands still; 0.1 N of co-contraction at a share of 0, where both motors smooth.
        assert r["exo_moment"] == pytest.approx(share * carried_at(r["exo_angle.angle"]), abs=5e-3)
        assert r["gravity_share"] == pytest.approx(share, abs=1e-12)


def test_m_g_is_that_of_the_default_person_whoever_wears_the_device():
    heavy = {"body_mass": 120.0, "height": 1.9, **LIMP}
    r = held(made(60.0, exoskeleton=STILL, patient=heavy), share=1.0)
    assert r["exo_moment"] == pytest.approx(carried_at(r["exo_angle.angle"]), abs=5e-3)
    assert carried(DEVICE)[1] == pytest.approx(carried_at(0.5 * math.pi), abs=1e-4)


@pytest.mark.parametrize("stiffness", [10.0, 30.0])
def test_a_fixed_zero_at_rest_is_deflected_by_the_load_over_the_stiffness(stiffness):
    """A limp arm with a kilogram lies in the spring, whose zero is where the episode began."""
    env = made(80.0, drive_settings=FIXED, episode_duration=10.0)
    start = env.readings()["exo_angle.angle"]
    r = held(env, stiffness, damping=3.0, share=1.0, steps=400)
    angle = r["exo_angle.angle"]
    wanted = stiffness * (start - angle) + carried_at(angle)
    assert start - angle > 0.05 and abs(r["exo_angle.rate"]) < 0.01
    # What is left of the swing of the handle moves the arm by 1e-3 rad, 0.03 Nm of the spring, within the motors' lag.
    assert r["exo_moment"] == pytest.approx(wanted, abs=0.02)


def test_a_zero_that_follows_gives_way():
    """The same load sinks, ever slower, against a damper of K T_0 + D.

    Where the rate dies out as exp(-n t), the stretch of the spring is T_0 / (1 - n T_0) times it, and what the motors
    give is 1 + n T times the present law's, by their lag T.
    """
    env = made(80.0, episode_duration=10.0, drive_settings={"relaxation_time": 0.1})
    before, r = (held(env, 20.0, damping=1.0, share=1.0, steps=k) for k in (60, 15))
    n = math.log(before["exo_angle.rate"] / r["exo_angle.rate"]) / 0.3
    assert r["exo_angle.rate"] < -0.1 and 0.5 < n < 3.0
    law = -(20.0 * 0.1 / (1.0 - 0.1 * n) + 1.0) * r["exo_angle.rate"] * (1.0 + 0.02 * n)
    assert r["exo_moment"] - carried_at(r["exo_angle.angle"]) == pytest.approx(law, rel=0.03)


def test_numbers_change_with_a_limited_rate_from_none():
    env = made()
    r = env.readings()
    assert (r["stiffness"], r["damping"]) == (0.0, 0.0) and 0.0 < r["gravity_share"] < 4.0
    for k in range(1, 8):
        env.step(np.ones(3))
        r = env.readings()
        # A tenth of the largest in 0.01 s: 0.2 a period.
        assert r["stiffness"] == pytest.approx(30.0 * min(0.2 * k, 1.0))
        assert r["damping"] == pytest.approx(3.0 * min(0.2 * k, 1.0))


@pytest.mark.parametrize("angle", [20.0, 60.0, 100.0])
@pytest.mark.parametrize("worn", [None, {"shift": [0.01, -0.02, 0.0]}])
def test_at_the_start_the_share_holds_the_arm(angle, worn):
    env = made(angle, load=0.5, misalignment=worn)
    r = env.readings()
    assert r["exo_moment"] == pytest.approx(r["gravity_share"] * carried_at(r["exo_angle.angle"]), abs=1e-9)
    assert abs(r["elbow_angle.acceleration"]) < 0.3
    # What only the handle swings by.
    assert abs(held(env, share=r["gravity_share"], steps=5)["elbow_angle.angle"] - math.radians(angle)) < 2e-3


@pytest.mark.parametrize("angle", [0.0, 1.0])
def test_a_straight_arm_begins_without_a_share(angle):
    """There is nearly nothing to carry: what holds the arm over next to nothing would be any share."""
    r = made(angle).readings()
    assert r["gravity_share"] == 0.0 and r["agonist_tension"] == 0.0


def test_a_load_beyond_the_largest_share_begins_with_that():
    r = made(80.0, load=5.0).readings()
    assert r["gravity_share"] == 4.0 and r["agonist_tension"] > 100.0


@pytest.mark.parametrize("action", [[-1.0] * 3, [1.0] * 3, [1.0, -1.0, 1.0], [-1.0, 1.0, -1.0]])
@pytest.mark.parametrize("rate", [5.0, 50.0, 500.0])
def test_the_ends_of_the_box_are_no_singular_matrices(action, rate):
    """The largest stiffness without damping is stable by the friction of the hinge alone, at any control rate."""
    env = made(60.0, control_rate=rate, drive_settings=FIXED, load=0.5)
    rates = []
    for _ in range(round(1.5 * rate)):
        *_, terminated, _, info = env.step(np.array(action))
        assert not info["solver_failed"], info
        rates.append(abs(env.readings()["exo_angle.rate"]))
        if terminated:
            break
    assert env.readings()["solver.restarts"] <= 5.0
    if action[0] > 0.0:
        assert np.mean(rates[-len(rates) // 5 :]) < 0.5 * max(rates)


def test_the_law_lies_within_the_period_and_not_at_its_ends():
    """At 5 Hz a falling arm meets the spring at once: the period of the action is none of the law."""
    found = {}
    for rate in (5.0, 200.0):
        env = made(60.0, control_rate=rate, rtol=1e-5, drive_settings={"change_rate": 1e3}, noise=False)
        # A constant action: after the first period both laws are the same.
        for _ in range(round(1.0 * rate)):
            env.step(np.array([0.0, 0.0, 0.2]))
        found[rate] = env.readings()["exo_angle.angle"]
    assert found[5.0] == pytest.approx(found[200.0], abs=0.03)


@pytest.mark.parametrize(
    ("settings", "complaint"),
    [
        ({"max_stiffness": -1.0}, "max_stiffness = -1.0: Expected a number above 0"),
        ({"max_damping": math.nan}, "max_damping = nan: Expected a finite number"),
        ({"max_gravity_share": 0.0}, "max_gravity_share = 0.0: Expected a number above 0"),
        ({"relaxation_time": 0.0}, "relaxation_time = 0.0: Expected a number of at least 0.001"),
        ({"change_rate": -1.0}, "change_rate = -1.0: Expected a number above 0"),
        ({"max_tension": [200.0]}, "max_tension has 1 numbers; expected one for each of the device's 2 ropes"),
        ({"rate_limit": 5.0}, "unknown key 'rate_limit'"),
        ({"time_constant": "fast"}, "time_constant = 'fast': Expected a number"),
    ],
)
def test_wrong_settings(settings, complaint):
    with pytest.raises(InputError, match=complaint):
        ElbowLiftEnv(action_mode="impedance", drive_settings=settings)


@pytest.mark.parametrize("action", [np.zeros(2), np.full(3, np.nan), [0.0, 0.0, math.inf]])
def test_wrong_actions(action):
    with pytest.raises(InputError, match="action"):
        made().step(action)


def test_other_devices(tmp_path):
    ropes = {"lower": "antagonist", "lift": "agonist", "spare": "agonist"}
    path = with_ropes(tmp_path, **ropes)
    env = made(exoskeleton=path, drive_settings={"max_tension": [100.0, 200.0, 300.0]})
    r = held(env, share=2.0)
    assert r["exo_moment"] == pytest.approx(2.0 * carried_at(r["exo_angle.angle"]), abs=5e-3)
    assert r["spare_tension"] == 0.0 and r["lift_tension"] > 10.0
    one = made(exoskeleton=with_ropes(tmp_path, lift="agonist"), drive_settings={"max_tension": [150.0]})
    assert held(one, share=1.0)["exo_moment"] == pytest.approx(carried_at(math.radians(60.0)), abs=5e-3)


def test_the_default_share_holds_two_kilograms_in_a_limp_arm():
    for angle in (40.0, 60.0, 80.0, 100.0):
        assert 1.0 < made(angle, load=2.0).readings()["gravity_share"] < Impedance().max_gravity_share
