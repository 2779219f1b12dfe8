"""Environments across processes and threads: forked, spawned, pickled, and called from two threads at once."""

import multiprocessing
import os
import threading

import gymnasium
import numpy as np
import pytest
from gymnasium.vector import AsyncVectorEnv

from exo_env.envs.elbow_lift import ElbowLiftEnv, ElbowLiftVectorEnv

ACTIONS = np.random.default_rng(0).uniform(-1.0, 1.0, (8, 4, 2))
START_METHODS = [
    pytest.param(name, marks=pytest.mark.slow if name == "spawn" else ())
    for name in ("fork", "forkserver", "spawn") if name in multiprocessing.get_all_start_methods()
]  # fmt: skip
needs_fork = pytest.mark.skipif(not hasattr(os, "fork"), reason="the system cannot fork")


def _made():
    return gymnasium.make("exo_env:exo/ElbowLift-v2", episode_duration=0.2)


def _in_a_fork(work):
    """What `work` gives in a forked process; fails where it does not come back within a minute."""
    context = multiprocessing.get_context("fork")
    ours, theirs = context.Pipe()
    child = context.Process(target=lambda: theirs.send(work()))
    child.start()
    try:
        assert ours.poll(60.0), "the forked process hangs"
        return ours.recv()
    finally:
        child.kill()
        child.join()


@needs_fork
@pytest.mark.filterwarnings("ignore:.*fork.*:DeprecationWarning")
def test_a_batch_goes_on_in_a_forked_process():
    worlds = ElbowLiftVectorEnv(4, threads=3)
    worlds.reset(seed=0)
    worlds.step(ACTIONS[0])

    def rest():
        found = [worlds.step(a)[0] for a in ACTIONS[1:]]
        worlds.reset(seed=1)
        worlds.close()
        return found

    forked = _in_a_fork(rest)
    np.testing.assert_array_equal(forked, [worlds.step(a)[0] for a in ACTIONS[1:]])
    # What the child does to its threads is nothing to those of the parent.
    worlds.step(ACTIONS[0])
    worlds.close()


@needs_fork
@pytest.mark.filterwarnings("ignore:.*fork.*:DeprecationWarning")
def test_a_process_that_is_forked_during_a_step_is_told():
    worlds = ElbowLiftVectorEnv(4, threads=2)
    worlds.reset(seed=0)

    def step():
        try:
            worlds.step(ACTIONS[0])
        except gymnasium.error.AlreadyPendingCallError as error:
            return str(error)
        return "stepped"

    with worlds._turn:
        told = _in_a_fork(step)
    assert "a vector environment for each thread" in told
    worlds.step(ACTIONS[0])
    worlds.close()


def test_two_threads_do_not_move_the_same_worlds():
    """One of two calls at the same time is refused, and the worlds go on as if it had not been made."""
    worlds, twin = (ElbowLiftVectorEnv(4, threads=2) for _ in range(2))
    worlds.reset(seed=0)
    twin.reset(seed=0)
    refused, begin = [], threading.Barrier(2)

    def steps():
        begin.wait()
        for _ in range(50):
            try:
                worlds.step(ACTIONS[0])
            except gymnasium.error.AlreadyPendingCallError as error:
                refused.append(error.name)

    others = [threading.Thread(target=steps) for _ in range(2)]
    for other in others:
        other.start()
    for other in others:
        other.join()
    done = 100 - len(refused)
    assert set(refused) <= {"step"}
    for _ in range(done):
        twin.step(ACTIONS[0])
    np.testing.assert_array_equal(worlds.step(ACTIONS[1])[0], twin.step(ACTIONS[1])[0])
    with worlds._turn, pytest.raises(gymnasium.error.AlreadyPendingCallError, match=r"^reset_each\(\)"):
        worlds.reset()
    worlds.close()
    twin.close()


def test_a_world_that_was_stepped_by_itself_is_named():
    worlds = ElbowLiftVectorEnv(2, episode_duration=0.1, threads=1)
    worlds.reset(seed=0)
    worlds.envs[1].step(np.zeros(2))
    with pytest.raises(gymnasium.error.ResetNeeded, match="World 1 was stepped by itself"):
        worlds.step(np.zeros((2, 2)))
    worlds.reset(seed=0)
    for _ in range(5):
        worlds.step(np.zeros((2, 2)))
    # The batch knows that its episode is over; so does the environment.
    with pytest.raises(gymnasium.error.ResetNeeded, match="over"):
        worlds.envs[1].step(np.zeros(2))
    worlds.close()


@pytest.mark.filterwarnings("ignore:.*fork.*:DeprecationWarning")
@pytest.mark.parametrize("context", START_METHODS)
def test_gymnasiums_processes(context):
    envs = AsyncVectorEnv([_made] * 2, context=context)
    try:
        alone = _made()
        first = envs.reset(seed=3)[0][0]
        np.testing.assert_array_equal(first, alone.reset(seed=3)[0])
        for action in ACTIONS[:, :2].astype(np.float32):
            np.testing.assert_array_equal(envs.step(action)[0][0], alone.step(action[0])[0])
    finally:
        envs.close()


@pytest.mark.filterwarnings("ignore:.*fork.*:DeprecationWarning")
@pytest.mark.parametrize("context", START_METHODS)
def test_processes_of_stable_baselines(context):
    vec_env = pytest.importorskip("stable_baselines3.common.vec_env")
    envs = vec_env.SubprocVecEnv([_made] * 2, start_method=context)
    try:
        envs.seed(3)
        alone = _made()
        np.testing.assert_array_equal(envs.reset()[0], alone.reset(seed=3)[0])
        for action in ACTIONS[:, :2].astype(np.float32):
            np.testing.assert_array_equal(envs.step(action)[0][0], alone.step(action[0])[0])
    finally:
        envs.close()


def test_wrappers_of_stable_baselines_around_the_batch():
    vec_env = pytest.importorskip("stable_baselines3.common.vec_env")
    from exo_env.envs.elbow_lift_sb3 import ElbowLiftVecEnv

    inner = ElbowLiftVecEnv(num_envs=4, episode_duration=0.1, threads=2)
    envs = vec_env.VecFrameStack(vec_env.VecNormalize(vec_env.VecMonitor(inner)), 2)
    assert envs.reset().shape == (4, 24)
    lengths = []
    for action in ACTIONS:
        *_, infos = envs.step(action)
        lengths += [info["episode"]["l"] for info in infos if "episode" in info]
    assert lengths == [5] * 4
    envs.close()


def _worker(env):
    observation, _ = env.reset()
    return observation


@pytest.mark.filterwarnings("ignore:.*fork.*:DeprecationWarning")
def test_a_pool_of_processes_takes_environments():
    """Each task pickles the environment, generator included."""
    env = ElbowLiftEnv()
    env.reset(seed=5)
    with multiprocessing.get_context(multiprocessing.get_all_start_methods()[0]).Pool(1) as pool:
        one, other = pool.map(_worker, [env, env])
    np.testing.assert_array_equal(one, other)
    np.testing.assert_array_equal(one, env.reset()[0])
