"""Stops of the elbow: where they are, what they hold, that they bring an arm to rest, and subjects without them."""

from __future__ import annotations

import math

import numpy as np
import pytest
import yaml

from dms_core.errors import InputError
from dms_core.files.config_files import config_file
from exo_env.ecosystem.arm import ELBOW_STOP, Arm
from exo_env.ecosystem.person import MASS_0, Person
from exo_env.envs.elbow_lift import ElbowLiftEnv
from exo_env.tasks.judgement.limits import Limits

LIMP = {"maximum_activation_flexors": 0.0, "maximum_activation_extensors": 0.0}
HEAVY, LIGHT = {"body_mass": 250.0, "height": 2.3}, {"body_mass": 20.0, "height": 1.0, "sex": "female"}
SLACK, DOWN, UP = (-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0)


def subject_file(tmp_path, stop):
    """The path of a subject that is arm26 with other stops; None for none."""
    facts = yaml.safe_load(config_file("subject/arm26.yaml").read_text())
    elbow = facts["joints"]["r_elbow"]
    del elbow["stop"]
    if stop is not None:
        elbow["stop"] = stop
    path = tmp_path / "mine.yaml"
    path.write_text(yaml.safe_dump(facts))
    return str(path)


def moved(env, action, **options):
    """Angles [deg] and rates [deg/s] of an episode under one action, which nothing ends early."""
    env.reset(seed=0, options=options)
    found, over = [], False
    while not over:
        _, _, terminated, over, info = env.step(np.array(action))
        assert not terminated, info
        r = env.readings()
        found.append((math.degrees(r["elbow_angle.angle"]), math.degrees(r["elbow_angle.rate"])))
    return np.array(found).T


@pytest.mark.parametrize("person", [{}, HEAVY, LIGHT])
@pytest.mark.parametrize("action", [SLACK, DOWN])
@pytest.mark.parametrize("start", [100.0, 142.0])
def test_an_arm_that_falls_straight_is_stopped_and_rests(person, action, start):
    env = ElbowLiftEnv(patient=LIMP | person, load=2.0)
    angle, rate = moved(env, action, initial_angle_deg=start)
    # The promise of limits.py: less than 3 deg into the stop.
    assert -3.0 < angle.min()
    # At rest within the accuracy of an episode, some 0.05 deg, for its last second.
    assert np.ptp(angle[-50:]) < 0.05 and np.abs(rate[-50:]).max() < 0.5
    if action == DOWN and not person:
        assert angle[-1] < 0.0


def test_an_arm_that_is_bent_to_the_end_rests_there():
    angle, rate = moved(ElbowLiftEnv(patient=LIMP, load=0.5), UP, initial_angle_deg=60.0)
    assert 142.0 < angle[-1] < 143.0 and angle.max() < 145.0
    assert np.abs(rate[-50:]).max() < 0.5


@pytest.mark.parametrize("start", [0.0, 142.0])
def test_an_episode_may_begin_at_either_stop(start):
    env = ElbowLiftEnv(patient={}, load=1.0)
    env.reset(seed=0, options={"initial_angle_deg": start})
    for _ in range(20):
        *_, terminated, _, info = env.step(np.array(SLACK))
        assert not terminated, info


@pytest.mark.parametrize("load", [0.05, 50.0])
def test_the_least_and_the_greatest_load_meet_the_stop(load):
    """A load of 50 kg may pass the limit, but the solver does not fail."""
    env = ElbowLiftEnv(patient=LIMP, load=load)
    env.reset(seed=0, options={"initial_angle_deg": 142.0})
    over = False
    while not over:
        _, _, terminated, truncated, info = env.step(np.array(DOWN))
        over = terminated or truncated
    assert not info["solver_failed"]


@pytest.mark.parametrize("name", ["mixed", "evaluation"])
def test_without_help_no_patient_is_unsafe(name):
    """Before there were stops a third of these episodes ended where the arm was straight."""
    env = ElbowLiftEnv(patient=name)
    env.reset(seed=1)
    for _ in range(12):
        over = False
        while not over:
            _, _, terminated, over, info = env.step(np.array(SLACK))
            assert not terminated, info
        env.reset()


def test_between_the_stops_nothing_acts(tmp_path):
    """Until a stop is touched the readings are those of an arm without one."""
    envs = [ElbowLiftEnv(patient=LIMP, load=2.0, subject=s) for s in ("arm26", subject_file(tmp_path, None))]
    for env in envs:
        env.reset(seed=3, options={"initial_angle_deg": 90.0})
    periods, angle = 0, 1.0
    while angle > 0.0:
        with_stop, without = (env.readings()["elbow_angle.angle"] for env in envs)
        # Rounding: the elements are others, and so may be the order of the elimination.
        assert with_stop == pytest.approx(without, abs=1e-9)
        for env in envs:
            env.step(np.array(SLACK))
        periods, angle = periods + 1, envs[0].readings()["elbow_angle.angle"]
    assert periods > 10


def test_stiffness_goes_with_the_mass_and_the_angles_stay():
    (light,), (heavy,) = (Arm(Person(body_mass=f * MASS_0)).forces() for f in (1.0, 2.0))
    assert light.name == ELBOW_STOP and heavy.stiffness == pytest.approx(2.0 * light.stiffness, rel=1e-15)
    assert (light.lowest, light.highest, light.dissipation) == (heavy.lowest, heavy.highest, heavy.dissipation)


def test_at_the_limits_the_stop_holds_twice_what_the_muscles_can():
    """The reason for the default limits; muscles at their greatest isometric forces and present moment arms."""
    arm, limits = Arm(), Limits()
    (stop,) = arm.forces()
    for angle, sign in ((limits.lowest_deg, -1.0), (limits.highest_deg, 1.0)):
        lowest, highest = (math.degrees(x) for x in (stop.lowest, stop.highest))
        depth = math.radians(max(lowest - angle, angle - highest))
        pulls = sum(
            arm.muscle(m).max_isometric_force * max(sign * arm.muscle_geometry(m, math.radians(angle))[1], 0.0)
            for m in arm.muscles
        )
        assert stop.stiffness * depth**1.5 > 1.9 * pulls > 50.0


def test_a_subject_without_stops_is_what_it_was(tmp_path):
    path = subject_file(tmp_path, None)
    arm = Arm(subject=path)
    assert arm.stop is None and arm.forces() == []
    assert arm.within_stops(-5.0, 147.0) == (0.0, 142.0)
    env = ElbowLiftEnv(patient=LIMP, load=2.0, subject=path)
    env.reset(seed=0, options={"initial_angle_deg": 90.0})
    over, info = False, {}
    while not over:
        _, _, over, truncated, info = env.step(np.array(DOWN))
        assert not truncated
    assert "outside -5 to 147 deg" in info["event"]


def test_stops_of_ones_own_say_where_an_episode_may_begin(tmp_path):
    """A contracture: 15 to 110 deg."""
    stop = {"lowest": math.radians(15.0), "highest": math.radians(110.0), "stiffness": 4000.0, "dissipation": 1.0}
    env = ElbowLiftEnv(patient=LIMP, load=1.0, subject=subject_file(tmp_path, stop))
    with pytest.raises(InputError, match="initial_angle_deg = 10.0: expected a number from 15 to 110"):
        env.reset(seed=0, options={"initial_angle_deg": 10.0})
    angle, _ = moved(env, SLACK, initial_angle_deg=60.0)
    assert 12.0 < angle.min() < 15.0 and angle[-1] == pytest.approx(15.0, abs=1.0)


@pytest.mark.parametrize("limits", [{}, {"lowest_deg": -10.0, "highest_deg": 160.0}])
def test_wider_limits_let_no_episode_begin_beyond_a_stop(limits):
    env = ElbowLiftEnv(limits=limits)
    for angle in (-1.0, 143.0):
        with pytest.raises(InputError, match="expected a number from 0 to 142"):
            env.reset(seed=0, options={"initial_angle_deg": angle})
