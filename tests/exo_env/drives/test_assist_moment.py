"""The mode `assist_moment`: the ropes give the moment that was asked for, whatever angle the hinge has."""

import copy
import math

import numpy as np
import pytest

from dms_core.errors import InputError
from exo_env.drives.assist_moment import AssistMoment, shared_tensions
from exo_env.ecosystem.exoskeleton import Exoskeleton
from exo_env.envs.elbow_lift import ElbowLiftEnv

DEVICE = Exoskeleton.named("elbow")
LIMP = {"maximum_activation_flexors": 0.0, "maximum_activation_extensors": 0.0}
STILL = {"hinge_damping": 1e5}
"""A hinge so stiff to move that 10 Nm turn it by 1e-4 rad/s: a bench on which moments are read at a fixed angle."""
ALL = [20.0, 45.0, 70.0, 100.0]


def made(angle=60.0, **settings):
    """An environment whose arm begins at an angle [deg]."""
    env = ElbowLiftEnv(**{"action_mode": "assist_moment", "patient": LIMP, "load": 1.0} | settings)
    env.reset(seed=0, options={"initial_angle_deg": angle})
    return env


def held(env, moment, co_tension=0.0, steps=15):
    """Readings after so many lags of the motors that what is left of the past is below 1e-6."""
    for _ in range(steps):
        *_, terminated, _, info = env.step(env.drive.action_of(moment, co_tension))
        assert not terminated, info
    return env.readings()


@pytest.mark.parametrize("angle", ALL)
def test_at_rest_the_moment_is_what_was_asked_for(angle):
    env = made(angle, exoskeleton=STILL)
    for moment, co_tension in ((8.0, 0.0), (3.0, 30.0), (0.0, 0.0), (0.0, 20.0), (-2.0, 10.0), (-5.0, 0.0)):
        r = held(env, moment, co_tension)
        # A moment arm of 0.08 m turns the 0.01 N which the motors are apart after 15 lags into 1e-3 Nm.
        assert r["exo_moment"] == pytest.approx(moment, abs=1e-3), (moment, co_tension)
        added = [r["agonist_tension"], r["antagonist_tension"]]
        added[0 if moment > 0.0 else 1] -= moment / DEVICE.moment_arm(
            "agonist" if moment > 0.0 else "antagonist", r["exo_angle.angle"]
        )
        assert np.mean(added) == pytest.approx(co_tension, abs=0.05)
        assert min(r["agonist_tension"], r["antagonist_tension"]) > -1e-6


@pytest.mark.parametrize("angle", ALL)
def test_the_measured_angle_is_that_of_the_hinge_also_where_it_is_not_the_elbows(angle):
    env = made(angle, exoskeleton=STILL, misalignment={"shift": [0.01, -0.02, 0.0], "tilt_deg": [0.0, 5.0]})
    r = held(env, 6.0)
    assert abs(r["exo_angle.angle"] - r["elbow_angle.angle"]) > 1e-3
    assert r["exo_moment"] == pytest.approx(6.0, abs=1e-3)


def test_beyond_reach_a_rope_gives_what_it_can_and_co_tension_costs_nothing():
    env = made(20.0, exoskeleton=STILL)
    most = 200.0 * DEVICE.moment_arm("agonist", env.readings()["exo_angle.angle"])
    for moment, co_tension in ((15.0, 0.0), (15.0, 40.0), (most - 0.05, 40.0)):
        r = held(env, moment, co_tension)
        assert r["exo_moment"] == pytest.approx(min(moment, most), abs=2e-3)
        assert r["agonist_command"] <= 200.0 and r["antagonist_command"] <= 100.0


def test_tensions_keep_their_limits_and_their_moment_everywhere():
    draw = np.random.default_rng(0)
    for _ in range(2000):
        moment, co_tension = draw.uniform(-20.0, 20.0), draw.uniform(0.0, 300.0)
        arms, most = draw.uniform(0.001, 0.1, 2), draw.uniform(1.0, 300.0, 2) * (draw.uniform(size=2) < 0.9)
        flexor, extensor = shared_tensions.py_func(moment, co_tension, *arms, *most)
        assert 0.0 <= flexor <= most[0] and 0.0 <= extensor <= most[1]
        reached = min(max(moment, -arms[1] * most[1]), arms[0] * most[0])
        assert arms[0] * flexor - arms[1] * extensor == pytest.approx(reached, abs=1e-12)


def test_zeros_ask_for_no_moment_and_small_actions_for_small_ones():
    env = made(exoskeleton=STILL)
    found = []
    for a in (-0.02, -0.01, 0.0, 0.01, 0.02):
        for _ in range(15):
            env.step(np.array([a, 0.0]))
        found.append(env.readings()["exo_moment"])
    # 0.01 of 15 Nm; the co-tension of zeros is half of the largest and gives none.
    np.testing.assert_allclose(found, [-0.3, -0.15, 0.0, 0.15, 0.3], atol=1e-3)


def test_an_episode_begins_as_with_commanded_tensions():
    for patient in (LIMP, "stroke_severe", "healthy"):
        one, other = made(patient=patient), made(patient=patient, action_mode="rope_tension")
        # Only the last action's meaning differs, so that all sensors agree to the bit.
        a, b = one.readings(), other.readings()
        assert a["agonist_tension"] > 0.0 or patient == "healthy"
        assert {k: a[k] for k in one.world.names} == {k: b[k] for k in other.world.names}


def test_moving_the_moment_stays_near():
    """The arm moves on within a period: 0.1 rad/s or so of a slow lift turn the moment arms by a thousandth."""
    env = made(40.0, load=1.0)
    found = [env.readings()["exo_moment"] for _ in range(20) if env.step(env.drive.action_of(4.0)) or True]
    assert np.abs(np.array(found[5:]) - 4.0).max() < 0.2


class TestActions:
    drive = AssistMoment()

    def test_of_numbers(self):
        np.testing.assert_array_equal(self.drive.action_of(7.5), [0.5, -1.0])
        np.testing.assert_array_equal(self.drive.action_of(-15.0, 40.0), [-1.0, 1.0])

    def test_of_arrays(self):
        moments = np.array([[0.0, 3.0, 15.0], [-3.0, -15.0, 99.0]])
        found = self.drive.action_of(moments, np.array([0.0, 20.0, 40.0]))
        assert found.shape == (2, 3, 2)
        np.testing.assert_allclose(found[..., 0], [[0.0, 0.2, 1.0], [-0.2, -1.0, 1.0]])
        np.testing.assert_array_equal(found[..., 1], [[-1.0, 0.0, 1.0]] * 2)
        assert self.drive.action_of(moments[:0]).shape == (0, 3, 2)

    def test_by_the_settings(self):
        np.testing.assert_array_equal(
            AssistMoment(max_moment=10.0, max_co_tension=8.0).action_of(5.0, 2.0), [0.5, -0.5]
        )

    def test_what_is_not_finite_is_refused_by_a_step(self):
        with pytest.raises(InputError, match="expected finite numbers"):
            made().step(self.drive.action_of(math.nan))


@pytest.mark.parametrize(
    ("settings", "complaint"),
    [
        ({"max_moment": -1.0}, "max_moment = -1.0: Expected a number above 0"),
        ({"max_moment": math.nan}, "max_moment = nan: Expected a finite number"),
        ({"max_moment": [1.0]}, "max_moment = .*: Expected a number"),
        ({"max_co_tension": 0.0}, "max_co_tension = 0.0: Expected a number above 0"),
        ({"max_co_tension": math.inf}, "max_co_tension = inf: Expected a finite number"),
        ({"max_tension": [200.0]}, "max_tension has 1 numbers; expected one for each of the device's 2 ropes"),
        ({"max_tension": [200.0, -5.0]}, "expected numbers above 1 and up to 1500 N"),
        ({"rate_limit": 0.0}, "rate_limit = 0.0: Expected a number above 0"),
        ({"time_constant": -0.02}, "time_constant = -0.02: Expected a number of at least 0.001"),
        ({"moment": 3.0}, "moment"),
    ],
)
def test_wrong_settings(settings, complaint):
    with pytest.raises(InputError, match=complaint):
        ElbowLiftEnv(action_mode="assist_moment", drive_settings=settings)


def test_an_action_of_another_shape_is_refused():
    with pytest.raises(InputError, match=r"action has shape \(3,\): expected 2 numbers"):
        made().step(np.zeros(3))


def with_ropes(tmp_path, **ropes):
    """A file of the default device with other ropes."""
    import yaml

    facts = copy.deepcopy(DEVICE.model_dump(mode="json"))
    facts["ropes"] = {name: facts["ropes"][of] for name, of in ropes.items()}
    path = tmp_path / "device.yaml"
    path.write_text(yaml.safe_dump(facts | STILL))
    return str(path)


def test_a_device_of_one_rope_gives_no_extending_moment_and_no_co_tension(tmp_path):
    env = made(exoskeleton=with_ropes(tmp_path, lift="agonist"), drive_settings={"max_tension": [150.0]})
    for moment, given in ((5.0, 5.0), (-5.0, 0.0), (0.0, 0.0)):
        assert held(env, moment, 30.0)["exo_moment"] == pytest.approx(given, abs=1e-3)


def test_of_three_ropes_the_first_of_each_way_pull(tmp_path):
    ropes = {"lower": "antagonist", "lift": "agonist", "spare": "agonist"}
    env = made(exoskeleton=with_ropes(tmp_path, **ropes), drive_settings={"max_tension": [100.0, 200.0, 300.0]})
    for moment in (5.0, -4.0):
        r = held(env, moment, 10.0)
        assert r["exo_moment"] == pytest.approx(moment, abs=1e-3)
        assert r["spare_tension"] == 0.0 and min(r["lift_tension"], r["lower_tension"]) > 5.0
