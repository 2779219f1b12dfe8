"""The task of exo/HiddenIntent: what is hidden, what is shown, what is rewarded."""

import numpy as np
import pytest

from dms_core.errors import InputError
from exo_env.envs.hidden_intent import HiddenIntentEnv, NewPatientEnv
from exo_env.tables import STATUS
from exo_env.tasks.judgement.intent_rewards import INTENT_TERM, IntentWeights, opposing_power, opposition
from exo_env.tasks.judgement.rewards import TERM
from exo_env.world.kernels.control_period import observe, read

NOTHING = np.array([0.0, -1.0])


def seen_with_another_plan(groups):
    """Observations of one state, past and noise, with the plan as it is and with another one."""
    env = HiddenIntentEnv(observation=groups)
    env.reset(seed=3)
    for _ in range(40):
        env.step(NOTHING)
    tables, found = env.world.tables, []
    memory = tables.observer.memory.copy()
    for other in (False, True):
        tables.observer.memory[:] = memory
        if other:
            generator = np.random.default_rng(0)
            plan = tables.plan
            for array in (plan.course, plan.preview, plan.needed, plan.lacking, plan.movement, plan.coefficients):
                array[:] = generator.uniform(0.5, 1.5, array.shape)
            plan.starts[:] = np.sort(generator.uniform(0.0, 9.0, plan.starts.shape))
        read(env.packed.table)
        observe(env.packed.table, False)
        found.append(tables.observer.observation.copy())
    return found


def test_another_plan_gives_the_identical_observation():
    shown = seen_with_another_plan(["device", "emg", "imu"])
    np.testing.assert_array_equal(*shown)


def test_only_the_privileged_group_reveals_the_plan():
    one, other = seen_with_another_plan(["privileged"])
    assert (one != other).any()
    env = HiddenIntentEnv(observation=["privileged"])
    assert set(env.task.revealing) <= set(env.task.groups)
    hidden = {c.source for g, channels in env.task.groups.items() if g not in env.task.revealing for c in channels}
    assert not hidden & {"reference", "reference_rate", "preview", "error", "needed_moment", "lacking_moment", "load"}


def test_no_channel_is_a_clock():
    env = HiddenIntentEnv(observation=["device", "imu"])
    env.reset(seed=3)
    for _ in range(40):
        env.step(NOTHING)
    tables, found = env.world.tables, []
    tables.observer.noise[:] = 0.0
    memory = tables.observer.memory.copy()
    for step in (40, 300):
        tables.observer.memory[:], tables.status[STATUS.step] = memory, step
        read(env.packed.table)
        observe(env.packed.table, False)
        found.append(tables.observer.observation.copy())
    np.testing.assert_array_equal(*found)


def test_the_clock_is_a_group_of_its_own_that_no_fair_policy_sees():
    env = HiddenIntentEnv(observation=["clock"])
    assert env.reset(seed=3)[0] == 0.0
    for k in range(1, 30):
        assert env.step(NOTHING)[0] == pytest.approx(0.1 * k * env.period, rel=1e-6), "shown in tens of seconds"
    assert "clock" in env.task.revealing
    others = [c for name, channels in env.task.groups.items() if name != "clock" for c in channels]
    assert not any(c.source == "clock" for c in others)


def test_opposing_power():
    # Support of what arm and load need opposes nobody, up or down.
    assert opposing_power(3.0, 4.0, -1.0) == 0.0 and opposing_power(3.0, 4.0, 1.0) == 0.0
    assert opposing_power(6.0, 4.0, -0.5) == 1.0, "2 Nm more than is needed against a move down at 0.5 rad/s"
    assert opposing_power(-2.0, 4.0, 0.5) == 1.0, "2 Nm down against a move up at 0.5 rad/s"
    assert opposing_power(6.0, 4.0, 0.5) == 0.0 and opposing_power(-2.0, 4.0, -0.5) == 0.0
    assert opposing_power(1.0, -2.0, -1.0) == 1.0, "where nothing holds the arm up, each Nm opposes"
    assert opposition(2.0, 4.0) == -0.5 and opposition(1e9, 4.0) == -2.0


def test_terms_are_those_of_the_lift_and_one_more():
    assert INTENT_TERM._fields[: len(TERM)] == TERM._fields
    assert tuple(IntentWeights.model_fields) == INTENT_TERM._fields
    env = HiddenIntentEnv(observation=["device", "privileged"])
    env.reset(seed=5)
    for _ in range(200):
        _, reward, over, _, info = env.step(np.array([0.4, -0.8]))
        weights, found = info["reward_weights"], info["reward_terms"]
        assert reward == pytest.approx(sum(weights[k] * found[k] for k in weights))
        r = env.readings()
        power = opposing_power(r["exo_moment"], r["needed_moment"], r["reference_rate"])
        assert info["opposing_power"] == pytest.approx(power)
        if over:
            break


def test_channels_are_composed_by_name():
    env = HiddenIntentEnv(observation=["device.angle", "emg.emg", "imu.gyro"])
    assert [s.name for s in env.observation_structure] == ["angle", "emg", "gyro"]
    assert env.reset(seed=0)[0].shape == (1 + 6 + 1,)


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        ({"observation": ["device.reference"]}, "group 'device' has no channel 'reference'"),
        ({"observation": ["plan"]}, "group 'plan' is unknown"),
        ({"action_mode": "pid_setpoint"}, "the patient's plan is hidden: expected one of rope_tension"),
        ({"action_mode": "muscles"}, "expected one of"),
        ({"repetitions": 0}, "repetitions = 0"),
    ],
)
def test_bad_settings(settings, said):
    with pytest.raises(InputError, match=said):
        HiddenIntentEnv(**settings)


def test_the_inertial_sensor_shows_the_forearm():
    env = HiddenIntentEnv(observation=["imu"], noise=False)
    env.reset(seed=2)
    for _ in range(60):
        shown = env.step(np.array([0.3, -1.0]))[0]
    r = env.readings()
    # The elbow's axis is tilted by 6.7 deg, so that the z axis sees nearly all of the rate.
    assert shown[0] == pytest.approx(r["elbow_angle.rate"], rel=0.02)
    force = 10.0 * shown[1:]
    turn = r["elbow_angle.angle"]
    # Nearly at rest a specific force shows gravity, up in the ground's axes; some 2 m/s^2 are the forearm's own.
    np.testing.assert_allclose(force, 9.81 * np.array([np.sin(turn), np.cos(turn)]), atol=2.5)


def test_a_new_patient_stays_for_eight_windows():
    env = NewPatientEnv(observation=["emg"], patient="healthy")
    _, info = env.reset(seed=0)
    assert env.steps == 8 * 450 and info["patient"] == env.start_info()["patient"]
    course = env.episode.course
    for k in range(8):
        moved = np.ptp(course[450 * k : 450 * (k + 1), 0])
        assert moved > np.radians(5.0)
        # Each window ends at rest.
        assert abs(course[450 * (k + 1), 1]) < 1e-9
