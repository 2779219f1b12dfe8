"""Policies over arrays: one world or many is the same, and each does what its name says."""

import copy
import pickle

import numpy as np
import pytest

from agents.environment import make, make_vector
from agents.evaluation.episodes.fair_play import begin
from agents.evaluation.search.tuning import numbers_at
from agents.policies.baselines import REFERENCE_FREE, policy
from agents.policies.reference_free.assist_moment import Seen
from agents.policies.reference_free.emg_proportional import EmgProportional
from agents.policies.reference_free.gravity import Gravity, GravityLoad
from agents.policies.reference_free.intent_pd import IntentPd
from agents.policies.reference_free.known import ANGLES, Known, at
from agents.policies.reference_free.lack_assist import LackAssist
from agents.policies.reference_free.mean_movement import MeanAngle, MeanClock
from agents.policies.reference_free.onset import Onset
from agents.policies.reference_free.oracle import Oracle
from dms_core.errors import InputError
from exo_env.ecosystem.ecosystem import Ecosystem

HIDDEN = "exo/HiddenIntent-v0"
TUNED = [name for name, kind in REFERENCE_FREE.items() if kind.ranges]


def settings(kind, **more):
    return {"action_mode": kind.action_mode, "observation": list(kind.observation), "episode_duration": 1.0, **more}


def middle(kind, **changes):
    """A policy with numbers from the middle of their ranges, some of them changed."""
    return kind(**numbers_at(kind.ranges, np.full(len(kind.ranges), 0.5)) | changes)


@pytest.mark.parametrize("name", REFERENCE_FREE)
def test_many_worlds_act_as_each_alone(name):
    kind, seeds = REFERENCE_FREE[name], [3, 4, 5]
    rows = [numbers_at(kind.ranges, np.full(len(kind.ranges), x)) for x in (0.2, 0.5, 0.8)]
    worlds = make_vector(HIDDEN, 3, **settings(kind))
    together = kind(**{key: np.array([row[key] for row in rows]) for key in kind.ranges})
    observations, _ = worlds.reset(seed=seeds)
    together.begin(worlds, 3)
    actions = []
    for _ in range(20):
        actions.append(together.act(observations))
        observations = worlds.step(actions[-1])[0]
    worlds.close()
    env = make(HIDDEN, **settings(kind))
    for k, (row, seed) in enumerate(zip(rows, seeds, strict=True)):
        alone = kind(**row)
        observation, info = env.reset(seed=seed)
        alone.reset(env)
        for expected in actions:
            action = alone(observation, info)
            assert action.shape == expected[k].shape and (np.abs(action) <= 1.0).all()
            # Round-off of sums over arrays of another size, which the worlds then carry on.
            np.testing.assert_allclose(action, expected[k], rtol=0.0, atol=1e-9)
            observation = env.step(action)[0]


@pytest.mark.parametrize("name", TUNED)
def test_an_episode_leaves_nothing_behind(name):
    used = policy(name)
    env = make(HIDDEN, **settings(type(used)))
    runs = []
    for seed in (1, 2, 1):
        observation, info = env.reset(seed=seed)
        used.reset(env)
        runs.append([])
        for _ in range(15):
            runs[-1].append(used(observation, info))
            observation = env.step(runs[-1][-1])[0]
    np.testing.assert_array_equal(runs[0], runs[2])
    assert not np.array_equal(runs[0], runs[1])
    again = pickle.loads(pickle.dumps(copy.deepcopy(policy(name))))
    assert again.numbers == used.numbers


@pytest.mark.parametrize("name", TUNED)
def test_numbers_matter_and_are_checked(name):
    kind = REFERENCE_FREE[name]
    for key, r in kind.ranges.items():
        with pytest.raises(InputError, match=f"policy '{name}': {key} = .*expected a number from"):
            kind(**{key: r.high + 1.0})
        with pytest.raises(InputError, match=f"policy '{name}': {key} = "):
            kind(**{key: np.array([r.low, r.high + 1.0])})
    with pytest.raises(InputError, match="its numbers are"):
        kind(patience=1.0)


def test_tables_are_those_of_device_and_average_arm():
    ecosystem = Ecosystem()
    known = Known(ecosystem)
    between = np.radians(np.linspace(20.0, 100.0, 41) + 0.7)
    exact = [ecosystem.device.moment_arm("agonist", x) for x in between]
    # Linear between points 2 deg apart.
    np.testing.assert_allclose(at(known.levers, between)[0], exact, atol=1e-4)
    # The forearm needs most near the horizontal, muscles pull the way they are named.
    assert 60.0 < np.degrees(ANGLES[np.argmax(known.own)]) < 120.0
    signs = np.sign(at(known.muscles, np.radians([60.0]))[:, 0])
    assert [s > 0 for s in signs] == [not m.startswith("TRI") for m in ecosystem.arm().muscles]
    # That of forearm and hand about the elbow is 0.06 to 0.08 kg m^2 (Winter 2009), then handle and link.
    assert 0.06 < known.inertia < 0.15


def begun(used, n=1, seed=0, **more):
    """A policy in n worlds that have been reset, with their observations."""
    worlds = make_vector(HIDDEN, n, **settings(type(used), noise=False, **more))
    observations, _ = worlds.reset(seed=seed)
    used.begin(worlds, n)
    return worlds, observations


def test_gravity_is_what_the_table_says():
    used = middle(Gravity, share=1.2, damping=0.0)
    _, observations = begun(used)
    used.act(observations)
    seen = Seen(np.radians([30.0, 90.0]), np.array([1.0, 0.0]), np.zeros(2))
    np.testing.assert_allclose(used.wanted(observations, seen), 1.2 * at(used.known.own, seen.angle))


def test_an_estimated_load_is_what_hangs_in_the_ropes():
    used = middle(GravityLoad, share=0.2, carried=1.0, memory=0.1, damping=0.0, still=0.5)
    _, observations = begun(used)
    used.act(observations)
    angle = np.radians([60.0])
    held = 0.2 * at(used.known.own, angle) + 0.7 * used.usual(angle)
    for _ in range(100):
        moment = used.wanted(observations, Seen(angle, np.zeros(1), held))
    # 2 s are twenty time constants.
    np.testing.assert_allclose(used.hanging, 0.7, rtol=1e-6)
    np.testing.assert_allclose(moment, held, rtol=1e-6)
    # An arm that moves tells nothing.
    used.wanted(observations, Seen(angle, np.ones(1), 0.0 * held))
    np.testing.assert_allclose(used.hanging, 0.7, rtol=1e-6)


def test_what_the_ropes_hold_at_the_start_goes_on_without_a_jump():
    used = middle(MeanAngle, share=0.0, carried=1.0, stiffness=0.3, damping=0.05)
    _, observations = begun(used)
    used.act(observations)
    seen = used._seen(observations)
    np.testing.assert_allclose(used.weight(seen.angle), np.clip(seen.held, 0.0, None), rtol=1e-6)


def test_emg_is_amplified_beyond_the_dead_zone():
    used = middle(EmgProportional, gain=0.5, dead=0.1, filtering=0.01, share=0.0, carried=0.0, damping=0.0)
    worlds, observations = begun(used)
    used.act(observations)
    (part,) = [x for x in worlds.observation_structure if x.name == "emg"]
    flexor = part.start + part.labels.index("BRA")
    seen, moments = Seen(np.radians([60.0]), np.zeros(1), np.zeros(1)), []
    for level in (0.05, 0.3, 0.5):
        observations[:] = 0.0
        observations[0, flexor] = level / part.scale
        for _ in range(50):
            moment = used.wanted(observations, seen)
        moments.append(float(moment[0]))
    assert moments[0] == 0.0 and moments[1] > 0.0
    assert moments[2] == pytest.approx(2.0 * moments[1], rel=1e-5)


def test_an_onset_is_completed_and_then_let_go():
    used = middle(
        Onset, threshold=0.2, amplitude_deg=40.0, duration=1.0, trust=0.0, stiffness=10.0, damping=0.05, share=0.0,
        carried=0.0,
    )  # fmt: skip
    _, observations = begun(used)
    used.act(observations)
    used.start(observations, Seen(np.zeros(1), np.zeros(1), np.zeros(1)))
    angle, moments = np.radians([30.0]), []
    rates = [0.0] * 10 + [0.5] * 60 + [0.0] * 20
    for rate in rates:
        moments.append(float(used.wanted(observations, Seen(angle, np.array([rate]), np.zeros(1)))[0]))
    assert not any(moments[:10])
    # The arm is held, so the whole amplitude is missing at the end of the movement: 10 Nm/rad times 40 deg.
    assert max(moments) == pytest.approx(10.0 * np.radians(40.0), rel=0.02)
    assert not any(moments[-9:])


def told(used, observations, **estimates):
    """Observations in which the device's filter says something."""
    changed = observations.copy()
    for part in used.channels._slices.values():
        if part.group == "estimated":
            changed[:, part.start] = estimates.get(part.name, 0.0) / part.scale
    return changed


def test_the_estimated_lack_is_given():
    used = middle(LackAssist, gain=1.0, filtering=0.02, share=0.0, boost=0.5, stiffness=2.0, damping=0.0)
    _, observations = begun(used)
    used.act(observations)
    seen = Seen(np.radians([60.0]), np.zeros(1), np.zeros(1))
    # At rest the patient leaves 3 Nm to the device, which gives them and holds its own link.
    at_rest = told(used, observations, others_moment=-3.0)
    for _ in range(50):
        moment = used.wanted(at_rest, seen)
    assert moment == pytest.approx(3.0 + used.link(seen.angle), rel=1e-5)
    # A moment that is to move the arm is no lack less, and is helped by half.
    moved = used.wanted(told(used, observations, others_moment=-2.0, intended_moment=1.0), seen)
    assert moved == pytest.approx(moment + 0.5, rel=1e-5)
    higher = Seen(np.radians([90.0]), np.zeros(1), np.zeros(1))
    pulled = used.wanted(at_rest, higher) - used.link(higher.angle) - used._lack
    assert pulled == pytest.approx(-2.0 * np.radians(30.0), rel=1e-5)
    # Who is believed to lack nothing gets a share of an average arm, by (1 - gain).
    shy = middle(LackAssist, gain=0.0, filtering=0.02, share=1.0, boost=0.0, stiffness=2.0, damping=0.0)
    _, observations = begun(shy)
    shy.act(observations)
    assert shy.wanted(told(shy, observations, others_moment=-3.0), seen) == pytest.approx(
        at(shy.known.own, seen.angle), rel=1e-5
    )


def test_the_estimated_intention_moves_the_virtual_joint():
    used = middle(IntentPd, mass=0.05, drag=1.0, dead=0.2, stiffness=10.0, damping=0.05, share=0.0, carried=0.0)
    _, observations = begun(used)
    used.act(observations)
    seen = Seen(np.radians([60.0]), np.zeros(1), np.zeros(1))
    used.start(observations, seen)
    for _ in range(20):
        still = used.wanted(told(used, observations, intended_moment=0.1), seen)
    assert still == 0.0
    for _ in range(10):
        up = used.wanted(told(used, observations, intended_moment=1.2), seen)
    # 1 Nm beyond the dead zone moves 1 N m s/rad by nearly 0.2 rad in 0.2 s: less what the mass takes to start.
    assert 0.1 < (up / 10.0).item() < 0.2
    down = middle(IntentPd, mass=0.05, drag=1.0, dead=0.2, stiffness=10.0, damping=0.05, share=0.0, carried=0.0)
    _, observations = begun(down)
    down.act(observations)
    down.start(observations, seen)
    for _ in range(10):
        moment = down.wanted(told(down, observations, intended_moment=-1.2), seen)
    assert moment == pytest.approx(-up)


def test_the_mean_movement_is_that_of_many_episodes_and_of_no_single_one():
    clock, angle = middle(MeanClock), middle(MeanAngle)
    env = make(HIDDEN, **settings(MeanClock, episode_duration=9.0))
    for used in (clock, angle):
        env.reset(seed=7)
        used.reset(env)
    course = clock._course
    assert course.shape[1] == 2 and angle._course.shape == (1, 2)
    assert angle._course[0, 0] == pytest.approx(course[:, 0].mean())
    # Plans begin anywhere from 20 to 100 deg, and their mean is the same at all times.
    assert course[0, 0] == pytest.approx(np.radians(60.0), abs=np.radians(1.5)) and course[0, 1] == 0.0
    plan = env.unwrapped.world.tables.plan.course
    assert np.abs(course[:, 1]).max() < 0.5 * np.abs(plan[:, 1]).max()


def test_the_oracle_knows_the_plan_and_says_so():
    used = middle(Oracle, share=1.0, smoothing=0.005, lead=0.0)
    worlds, observations = begun(used)
    world = worlds.envs[0]
    assert [n for n in REFERENCE_FREE if REFERENCE_FREE[n].informed] == ["oracle", "soft_oracle"]
    used.act(observations)
    at_rest = used.wanted(observations, Seen(np.zeros(1), np.zeros(1), np.zeros(1)))
    # At the start the arm rests on the plan.
    assert at_rest[0] == pytest.approx(world.readings()["lacking_moment"], rel=1e-5)


def test_policies_begin_with_settings_only():
    env = make(HIDDEN, **settings(Gravity))
    env.reset(seed=1)
    given = []

    class Curious(Gravity):
        name = "curious"

        def begin(self, env, n):
            given.append(env.unwrapped)

    begin(Curious(share=1.0, damping=0.0, smoothing=0.1), env)
    assert given[0] is not env.unwrapped and not given[0].under_way and given[0].settings == env.unwrapped.settings
