"""A copy is the same environment: settings, attributes, generators, files and the episode, to the last bit."""

import copy
import os
import pickle
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import cloudpickle
import gymnasium
import numpy as np
import pytest
from gymnasium.wrappers import RecordEpisodeStatistics

from dms_core.errors import InputError
from dms_core.files.config_files import configs
from exo_env.clearing import Kept, arrays_of
from exo_env.envs.elbow_lift import ElbowLiftEnv, ElbowLiftVectorEnv

ALL = {
    "observation": ["device", "estimated", "emg", "privileged"],
    "noise": {"angle": {"deviation": 0.01, "delay": 0.05}},
}
HOLD = np.array([-0.3, -0.5])
WAYS = {
    "deepcopy": copy.deepcopy,
    "copy": copy.copy,
    "pickle": lambda env: pickle.loads(pickle.dumps(env)),
    "oldest pickle": lambda env: pickle.loads(pickle.dumps(env, protocol=2)),
    "cloudpickle": lambda env: cloudpickle.loads(cloudpickle.dumps(env)),
    "copy of a copy": lambda env: copy.deepcopy(pickle.loads(pickle.dumps(env))),
}


def held(env):
    """An action of the environment's mode that keeps the arm for a second or so."""
    known = {"assist_moment": np.array([0.2, -0.5]), "impedance": np.array([-0.3, -0.5, 0.0])}
    return known.get(env.unwrapped.action_mode, HOLD)


def rest_of(env, seed=9):
    """Everything that the rest of an episode shows under drawn actions."""
    actions, found = np.random.default_rng(seed), []
    while True:
        action = held(env) + actions.uniform(-0.3, 0.3, env.unwrapped.actions)
        observation, reward, terminated, truncated, info = env.step(action)
        found.append((observation.tobytes(), reward, info, env.unwrapped.readings()))
        if terminated or truncated:
            return [*found, (terminated, truncated)]


@pytest.mark.parametrize("steps", [0, 1, 40])
@pytest.mark.parametrize("mode", list(ElbowLiftEnv.drives))
@pytest.mark.parametrize("way", list(WAYS))
def test_a_copy_goes_on_to_the_last_bit(way, mode, steps):
    env = ElbowLiftEnv(action_mode=mode, episode_duration=1.0, render_mode="rgb_array", **ALL)
    _, told = env.reset(seed=steps, options={"initial_angle_deg": 40.0})
    for _ in range(steps):
        env.step(held(env))
    twin = WAYS[way](env)
    assert twin.start_info() == told
    if steps == 40:
        np.testing.assert_array_equal(twin.render(), env.render())
    assert rest_of(twin) == rest_of(env)
    with pytest.raises(gymnasium.error.ResetNeeded, match="over"):
        WAYS[way](twin).step(held(env))
    (a, one), (b, other) = env.reset(), twin.reset()
    np.testing.assert_array_equal(a, b)
    assert one == other and rest_of(twin) == rest_of(env)


def test_copies_and_original_do_not_touch_each_other():
    env = ElbowLiftEnv(episode_duration=0.5, **ALL)
    env.reset(seed=1)
    env.step(HOLD)
    twins = [copy.deepcopy(env) for _ in range(3)]
    for k, twin in enumerate(twins[:2]):
        rest_of(twin, seed=k)
        twin.reset(seed=k)
    assert rest_of(twins[2]) == rest_of(env)


def test_a_copy_keeps_equations_that_were_ordered_anew():
    env = ElbowLiftEnv(episode_duration=0.5)
    env.reset(seed=1)
    env.step(HOLD)
    assert env.world.dynamics.reorder()
    env.world.follow_dynamics()
    twin = pickle.loads(pickle.dumps(env))
    assert rest_of(twin) == rest_of(env)
    np.testing.assert_array_equal(env.reset()[0], twin.reset()[0])


def test_an_environment_that_needs_a_reset_is_copied_so():
    env = ElbowLiftEnv()
    for twin in (copy.deepcopy(env), pickle.loads(pickle.dumps(env))):
        with pytest.raises(gymnasium.error.ResetNeeded):
            twin.step(HOLD)
        np.testing.assert_array_equal(twin.reset(seed=3)[0], env.reset(seed=3)[0])
        env = ElbowLiftEnv()


def test_a_world_of_a_batch_can_be_copied():
    worlds = ElbowLiftVectorEnv(2, episode_duration=0.4, threads=1)
    worlds.reset(seed=0)
    worlds.step([HOLD, HOLD])
    twin = copy.deepcopy(worlds.envs[1])
    for _ in range(19):
        assert not twin._over
        np.testing.assert_array_equal(twin.step(HOLD)[0], worlds.step([HOLD, HOLD])[0][1])
    for over in (copy.deepcopy(worlds.envs[1]), twin):
        with pytest.raises(gymnasium.error.ResetNeeded, match="over"):
            over.step(HOLD)
    worlds.close()


@pytest.mark.parametrize("mode", ["NextStep", "SameStep"])
@pytest.mark.parametrize("way", list(WAYS))
def test_a_batch_is_copied_as_a_whole(way, mode):
    worlds = ElbowLiftVectorEnv(3, episode_duration=0.3, autoreset_mode=mode, threads=2, **ALL)
    worlds.action_space.seed(3)
    fresh = WAYS[way](worlds)
    np.testing.assert_array_equal(worlds.reset(seed=0)[0], fresh.reset(seed=0)[0])
    worlds.reset(seed=4)
    actions = np.random.default_rng(0).uniform(-1.0, 0.0, (30, 3, 2))
    worlds.envs[2].note = "kept"
    for action in actions[:11]:
        worlds.step(action)
    # The second world has begun another episode, a step behind the others.
    worlds.reset(options={"reset_mask": np.array([False, True, False])})
    twin = WAYS[way](worlds)
    assert twin.envs[2].note == "kept"
    for action in actions[11:]:
        ours, theirs = worlds.step(action), twin.step(action)
        for one, other in zip(ours[:4], theirs[:4], strict=True):
            np.testing.assert_array_equal(one, other)
        assert repr(ours[4]) == repr(theirs[4])
    np.testing.assert_array_equal(worlds.action_space.sample(), twin.action_space.sample())
    np.testing.assert_array_equal(worlds.reset()[0], twin.reset()[0])
    worlds.close()
    # What one closes is the other's no more.
    twin.step(actions[0])
    twin.close()


def test_nothing_that_is_kept_changes_in_an_episode():
    """A copy takes over what a reset fills and clears; any other array must be the same in all episodes."""
    env = ElbowLiftEnv(**ALL)
    env.reset(seed=0, options={"patient": {"sex": "male"}})
    env.reset(options={"patient": {"sex": "female"}})
    before = [(name, array.copy()) for name, array in arrays_of(env.world.tables, Kept)]
    assert len(before) > 30
    for seed in range(3):
        env.reset(seed=seed, options={"initial_angle_deg": 30.0 + seed})
        for _ in range(5):
            env.step(HOLD)
    for (name, old), (_, new) in zip(before, arrays_of(env.world.tables, Kept), strict=True):
        np.testing.assert_array_equal(old, new, err_msg=name)


class Mine(ElbowLiftEnv):
    """A subclass with a required argument, attributes and slots of its own."""

    __slots__ = ("kept", "never_set")

    def __init__(self, bonus, *, note, **settings):
        super().__init__(**settings)
        self.bonus, self.note, self.kept = bonus, note, [1, 2]

    def step(self, action):
        observation, reward, *rest = super().step(action)
        return (observation, reward + self.bonus, *rest)


@pytest.mark.parametrize("way", list(WAYS))
def test_what_a_subclass_has_goes_along(way):
    env = Mine(2.0, note={"deep": []}, patient={"strength": 0.7})
    env.reset(seed=1)
    env.later = "set from outside"
    twin = WAYS[way](env)
    assert type(twin) is Mine and (twin.bonus, twin.note, twin.kept) == (2.0, {"deep": []}, [1, 2])
    assert twin.later == "set from outside" and not hasattr(twin, "never_set")
    assert twin.kept is not env.kept and twin.note["deep"] is not env.note["deep"]
    assert twin.step(HOLD)[1] == env.step(HOLD)[1]


@pytest.mark.parametrize("way", list(WAYS))
def test_generators_go_along_and_are_the_copys_own(way):
    env = ElbowLiftEnv()
    env.reset(seed=4)
    env.action_space.seed(5)
    env.observation_space.seed(6)
    twin, third = WAYS[way](env), WAYS[way](env)
    for name in ("action_space", "observation_space"):
        drawn = [getattr(env, name).sample() for _ in range(3)]
        np.testing.assert_array_equal([getattr(twin, name).sample() for _ in range(3)], drawn)
        np.testing.assert_array_equal(getattr(third, name).sample(), drawn[0])
    assert twin.np_random_seed == 4
    assert twin.reset()[1] == env.reset()[1] == third.reset()[1]


@pytest.mark.parametrize("way", ["deepcopy", "pickle", "cloudpickle"])
def test_wrappers_go_along(way):
    env = RecordEpisodeStatistics(gymnasium.make("exo/ElbowLift-v2", episode_duration=0.4, max_episode_steps=15))
    env.reset(seed=0)
    for _ in range(6):
        env.step(HOLD.astype(np.float32))
    twin = WAYS[way](env)
    ours, theirs = rest_of(env), rest_of(twin)
    assert len(ours) == len(theirs) == 10
    for info in (ours[-2][2], theirs[-2][2]):
        assert info["episode"].pop("l") == 15
        info["episode"].pop("t")
    assert ours == theirs and twin.spec == env.spec


def test_what_an_owner_changes_afterwards_changes_no_copy():
    given = {
        "patient": {"strength": 0.7}, "load": {"uniform": [1.0, 1.0]},
        "reference": {"duration": {"uniform": [2.0, 2.0]}}, "exoskeleton": {"lower_link": {"mass": 1.0}},
        "noise": {"angle": {"deviation": 0.0}},
    }  # fmt: skip
    env = ElbowLiftEnv(**given)
    known = ElbowLiftEnv(**copy.deepcopy(given))
    given["patient"]["strength"] = 0.1
    given["load"]["uniform"][:] = [3.0, 3.0]
    given["reference"]["duration"]["uniform"][:] = [1.0, 1.0]
    given["exoskeleton"]["lower_link"]["mass"] = 2.0
    for twin in (env, copy.deepcopy(env), pickle.loads(pickle.dumps(env))):
        np.testing.assert_array_equal(twin.reset(seed=0)[0], known.reset(seed=0)[0])
        assert twin.start_info() == known.start_info()


FILES = {
    "patient": ("stroke_mild", "patients/stroke_mild.yaml"),
    "exoskeleton": ("elbow", "exoskeletons/elbow.yaml"),
    "subject": ("arm26", "subject/arm26.yaml"),
}
ELSEWHERE = """
import os, pickle, sys
env = pickle.load(open(sys.argv[1], "rb"))
os.chdir(sys.argv[2])
print(env.step([-0.3, -0.5])[0].tobytes().hex(), env.reset(seed=1)[0].tobytes().hex())
"""


@pytest.fixture
def files(tmp_path, monkeypatch):
    """A folder with a file for each setting that takes one, which is the present folder."""
    monkeypatch.chdir(tmp_path)
    for name, source in FILES.values():
        Path(f"{name}.yaml").write_bytes((configs() / source).read_bytes())
    return {key: f"{name}.yaml" for key, (name, _) in FILES.items()}


def _elsewhere(tmp_path):
    """Files of these names with nothing right in them, in another folder, which becomes the present one."""
    (tmp_path / "other").mkdir()
    os.chdir(tmp_path / "other")
    for name, _ in FILES.values():
        Path(f"{name}.yaml").write_text("wrong: 1\n")
        (tmp_path / f"{name}.yaml").write_text("wrong: 1\n")


def test_files_are_read_when_an_environment_is_made(files, tmp_path):
    env = ElbowLiftEnv(**files)
    env.set_reset_options({"patient": files["patient"]})
    started = env.reset(seed=1)[0].tobytes().hex()
    twin = copy.deepcopy(env)
    pickled = tmp_path / "env.pickle"
    pickled.write_bytes(pickle.dumps(env))
    _elsewhere(tmp_path)
    stepped = env.step(HOLD)[0].tobytes().hex()
    for other in (twin, pickle.loads(pickled.read_bytes())):
        assert other.step(HOLD)[0].tobytes().hex() == stepped
        assert other.reset(seed=1)[0].tobytes().hex() == started
    done = subprocess.run(
        [sys.executable, "-c", ELSEWHERE, pickled, tmp_path / "other"], capture_output=True, text=True, check=True,
        env={**os.environ, "PYTHONPATH": str(configs().parent)}, cwd="/",
    )  # fmt: skip
    assert done.stdout.split() == [stepped, started]


@pytest.mark.parametrize("vector", [False, True])
def test_a_spec_names_files_by_their_whole_paths(files, tmp_path, monkeypatch, vector):
    make = gymnasium.make_vec if vector else gymnasium.make
    first = make("exo/ElbowLift-v2", **files)
    assert first.spec.kwargs | {k: str(tmp_path / f) for k, f in files.items()} == first.spec.kwargs
    (tmp_path / "other").mkdir()
    monkeypatch.chdir(tmp_path / "other")
    again = make(first.spec)
    np.testing.assert_array_equal(again.reset(seed=2)[0], first.reset(seed=2)[0])
    again.close()
    first.close()


def test_an_episode_of_another_version_needs_a_reset():
    env = ElbowLiftEnv()
    env.reset(seed=0)
    state = copy.deepcopy(env.__getstate__())
    state["_held"] = replace(state["_held"], arrays=state["_held"].arrays[1:])
    twin = ElbowLiftEnv.__new__(ElbowLiftEnv)
    twin.__setstate__(state)
    with pytest.raises(InputError, match=r"another version of exo_env.* expected a reset\(\) first"):
        twin.step(HOLD)
    np.testing.assert_array_equal(twin.reset()[0], env.reset()[0])


def test_what_cannot_be_copied_says_so():
    env = ElbowLiftEnv()
    env.reset(seed=0)
    env.mine = env.episode
    with pytest.raises(TypeError, match="addresses of this process"):
        copy.deepcopy(env)
