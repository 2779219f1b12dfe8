"""The compiled batch: every world is the single environment, whatever its neighbours, threads and resets."""

import threading
import time

import gymnasium
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode, SyncVectorEnv

from dms_core.compiled import threads as threads_module
from dms_core.errors import InputError, SimulationError
from exo_env.envs.elbow_lift import ElbowLiftEnv, ElbowLiftVectorEnv
from exo_env.world import batch as batch_module
from exo_env.world.batch import Batch

ENV = "exo_env:exo/ElbowLift-v2"
SHORT = {"episode_duration": 0.5, "observation": ["device", "estimated", "emg", "privileged"]}


def _same(a, b, where=""):
    """Equal infos: keys, in no order; kinds of values and of numbers; arrays to the last bit."""
    assert a.keys() == b.keys(), (where, a.keys() ^ b.keys())
    for name, x in a.items():
        y, here = b[name], f"{where}.{name}"
        assert type(x) is type(y), (here, type(x), type(y))
        if isinstance(x, dict):
            _same(x, y, here)
            continue
        assert (x.dtype, x.shape) == (y.dtype, y.shape), here
        if x.dtype == object:
            for one, other in zip(x, y, strict=True):
                assert type(one) is type(other), (here, one, other)
                np.testing.assert_array_equal(one, other, err_msg=here)
                assert getattr(one, "dtype", None) == getattr(other, "dtype", None), here
        else:
            np.testing.assert_array_equal(x, y, err_msg=here)


@pytest.mark.parametrize("mode", list(ElbowLiftEnv.drives))
@pytest.mark.parametrize("autoreset", list(AutoresetMode))
def test_a_batch_is_gymnasiums_own_loop_to_the_last_bit(mode, autoreset):
    settings = SHORT | {"action_mode": mode}
    batch = ElbowLiftVectorEnv(5, autoreset_mode=autoreset, threads=2, **settings)
    loop = SyncVectorEnv([lambda: ElbowLiftEnv(**settings)] * 5, autoreset_mode=autoreset)
    (a, told_a), (b, told_b) = batch.reset(seed=3), loop.reset(seed=3)
    np.testing.assert_array_equal(a, b)
    _same(told_a, told_b)
    actions, ended = np.random.default_rng(0), 0
    for _ in range(60):
        action = actions.uniform(-1.0, 1.0, batch.action_space.shape).astype(np.float32)
        one, other = batch.step(action), loop.step(action)
        for x, y in zip(one[:4], other[:4], strict=True):
            np.testing.assert_array_equal(x, y)
            assert x.dtype == y.dtype
        _same(one[4], other[4])
        over = one[2] | one[3]
        ended += over.sum()
        if autoreset is AutoresetMode.DISABLED and over.any():
            for x, y in zip(*(w.reset(options={"reset_mask": over, "load": 1.0}) for w in (batch, loop)), strict=True):
                _same(x if isinstance(x, dict) else {"seen": x}, y if isinstance(y, dict) else {"seen": y})
    # Two repetitions of half a second each in 60 periods, and some that random tensions end early.
    assert ended >= 10
    batch.close()


def test_threads_and_neighbours_change_nothing():
    found = []
    for size, threads in ((7, 1), (7, 2), (3, 2)):
        batch = ElbowLiftVectorEnv(size, threads=threads, **SHORT)
        batch.reset(seed=0)
        actions = np.random.default_rng(1).uniform(-1.0, 1.0, (20, 7, 2))
        found.append([batch.step(a[:size])[0][:3] for a in actions])
        batch.close()
    np.testing.assert_array_equal(found[0], found[1])
    np.testing.assert_array_equal(found[0], found[2])


def test_make_vec_gives_the_batch_and_a_spec():
    made = gymnasium.make_vec(ENV, num_envs=3, patient="stroke_mild", threads=1)
    assert isinstance(made.unwrapped, ElbowLiftVectorEnv) and made.num_envs == 3
    assert made.observation_space.shape == (3, 12) and made.action_space.shape == (3, 2)
    again = gymnasium.make_vec(made.spec)
    assert isinstance(again.unwrapped, ElbowLiftVectorEnv) and again.num_envs == 3
    made.close()
    again.close()


def test_disabled_autoreset_wants_a_mask():
    batch = ElbowLiftVectorEnv(2, autoreset_mode="Disabled", episode_duration=0.1)
    with pytest.raises(gymnasium.error.ResetNeeded):
        batch.step(np.zeros((2, 2)))
    batch.reset(seed=0)
    for _ in range(5):
        *_, truncated, _ = batch.step(np.zeros((2, 2)))
    assert truncated.all()
    with pytest.raises(gymnasium.error.ResetNeeded, match="over"):
        batch.step(np.zeros((2, 2)))
    batch.reset(options={"reset_mask": np.array([True, False])})
    with pytest.raises(gymnasium.error.ResetNeeded):
        batch.step(np.zeros((2, 2)))
    batch.reset(options={"reset_mask": np.array([False, True]), "load": 1.25})
    assert batch.envs[1].episode.ecosystem.weight == 1.25
    batch.step(np.zeros((2, 2)))
    batch.close()


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"num_envs": 0}, "num_envs = 0"),
        ({"num_envs": 2, "threads": 0}, "threads = 0"),
        ({"num_envs": 2, "autoreset_mode": "now"}, "autoreset_mode = 'now'"),
        ({"num_envs": 2, "patient": "nobody"}, "nobody"),
    ],
)
def test_bad_settings(settings, words):
    with pytest.raises(InputError, match=words):
        ElbowLiftVectorEnv(**settings)


def test_bad_actions_name_the_world():
    batch = ElbowLiftVectorEnv(3, threads=1)
    batch.reset(seed=0)
    with pytest.raises(InputError, match=r"shape \(2,\)"):
        batch.step(np.zeros(2))
    bad = np.zeros((3, 2))
    bad[1, 0] = np.nan
    with pytest.raises(InputError, match=r"actions\[1\]"):
        batch.step(bad)
    with pytest.raises(InputError, match="2 seeds for 3 worlds"):
        batch.reset(seed=[1, 2])


def test_a_world_fits_into_256_kib():
    """What a world owns beside the elimination orders that all worlds share."""
    batch = ElbowLiftVectorEnv(2, threads=1)
    batch.reset(seed=0)

    def arrays(values):
        for value in values:
            if hasattr(value, "values") and not isinstance(value, np.ndarray):
                yield from arrays(value.values)
            elif isinstance(value, tuple):
                yield from arrays(value)
            elif isinstance(value, np.ndarray):
                yield value

    one, other = ({id(a): a.nbytes for a in arrays([env.packed.values])} for env in batch.envs)
    own = sum(size for key, size in one.items() if key not in other)
    assert own < 256 * 1024, own


def test_sb3_sees_terminal_observations_and_time_limits():
    pytest.importorskip("stable_baselines3")
    from exo_env.envs.elbow_lift_sb3 import ElbowLiftVecEnv

    worlds = ElbowLiftVecEnv(4, threads=1, episode_duration=0.3, limits={"lowest_deg": 20.0})
    worlds.seed(0)
    first = worlds.reset()
    assert first.shape == (4, 12) and first.dtype == np.float32
    twin = [ElbowLiftEnv(episode_duration=0.3, limits={"lowest_deg": 20.0}) for _ in range(4)]
    for k, env in enumerate(twin):
        np.testing.assert_array_equal(env.reset(seed=k)[0], first[k])
    actions, ends = np.random.default_rng(2), []
    for _ in range(40):
        action = actions.uniform(-1.0, -0.2, (4, 2))
        seen, rewards, over, infos = worlds.step(action)
        for k, env in enumerate(twin):
            observation, reward, terminated, truncated, _ = env.step(action[k])
            assert rewards[k] == np.float32(reward) and over[k] == (terminated or truncated)
            if over[k]:
                np.testing.assert_array_equal(infos[k]["terminal_observation"], observation)
                assert infos[k]["TimeLimit.truncated"] == (truncated and not terminated)
                ends.append(infos[k]["TimeLimit.truncated"])
                observation, _ = env.reset()
            np.testing.assert_array_equal(seen[k], observation)
    assert True in ends and False in ends
    worlds.close()


def test_a_step_that_breaks_off_leaves_nothing_to_step(monkeypatch):
    """A world that ends in the very step in which the begin of another fails must not go on past its last row."""
    batch = ElbowLiftVectorEnv(2, episode_duration=0.1, threads=2)
    batch.reset(seed=0)
    batch.step(np.zeros((2, 2)))
    # World 0 begins anew, and is now a step behind world 1.
    batch.reset(seed=1, options={"reset_mask": np.array([False, True])})
    for _ in range(4):
        batch.step(np.zeros((2, 2)))
    monkeypatch.setattr(batch.envs[0], "begun", lambda code: (_ for _ in ()).throw(SimulationError("broken")))
    with pytest.raises(SimulationError, match="broken"):
        batch.step(np.zeros((2, 2)))
    with pytest.raises(gymnasium.error.ResetNeeded):
        batch.step(np.zeros((2, 2)))
    with pytest.raises(gymnasium.error.ResetNeeded, match="all worlds"):
        batch.reset(options={"reset_mask": np.array([True, False])})
    monkeypatch.undo()
    batch.reset(seed=0)
    batch.step(np.zeros((2, 2)))
    batch.close()


def test_an_interrupt_waits_for_the_threads(monkeypatch):
    """The caller is interrupted twice, in its own work and while it waits; no thread writes behind its back."""
    batch, done = Batch(4, 12, 5, np.zeros(0, np.int64), threads=2), []

    def slow(*_):
        if threading.current_thread() is threading.main_thread():
            time.sleep(0.05)
            raise KeyboardInterrupt
        time.sleep(0.3)
        done.append(True)

    calls, real = [], threads_module.wait

    def interrupted(jobs):
        calls.append(jobs)
        if len(calls) == 1:
            raise KeyboardInterrupt
        return real(jobs)

    monkeypatch.setattr(threads_module, "wait", interrupted)
    monkeypatch.setattr(batch_module, "run_some", slow)
    with pytest.raises(KeyboardInterrupt):
        batch.run(np.arange(2), np.zeros((4, 2)))
    assert done == [True] and len(calls) == 2
    batch.close()
