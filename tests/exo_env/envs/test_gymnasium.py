"""The environment as Gymnasium wants it: checker, spec, seeds, pickles, wrappers. Vectors: test_vector.py."""

import json
import subprocess
import sys
import warnings

import gymnasium
import numpy as np
import pytest
from gymnasium.envs.registration import EnvSpec
from gymnasium.utils.env_checker import check_env
from gymnasium.wrappers import RecordEpisodeStatistics, RecordVideo

from exo_env.envs.elbow_lift import ElbowLiftEnv

ID = "exo/ElbowLift-v2"
ACTION = np.array([-0.4, -0.9], np.float32)


@pytest.mark.parametrize("mode", list(ElbowLiftEnv.drives))
@pytest.mark.parametrize("groups", [["device"], ["privileged", "emg", "device"]])
def test_checker_finds_nothing(make, mode, groups):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        # Pictures have tests of their own.
        check_env(make(action_mode=mode, observation=groups).unwrapped, skip_render_check=True)


def test_spec_goes_through_json(make):
    settings = {
        "patient": {"base": "healthy", "fields": {"strength": {"uniform": [0.8, 1.0]}}},
        "load": {"choice": [0.5, 1.0]},
        "reference": {"duration": 1.8},
        "noise": {"angle": {"deviation": 0.01}},
        "reward_weights": {"tracking": 2.0},
        "control_rate": 100.0,
    }
    spec = EnvSpec.from_json(make(**settings).spec.to_json())
    assert spec.kwargs == json.loads(json.dumps(settings))
    one, other = gymnasium.make(spec), make(**settings)
    np.testing.assert_array_equal(one.reset(seed=3)[0], other.reset(seed=3)[0])
    assert one.unwrapped.period == 0.01


RUN = """
import numpy as np, gymnasium, exo_env, sys
env = gymnasium.make("exo/ElbowLift-v2", observation=["device", "emg", "privileged"]).unwrapped
{before}
found = [env.reset(seed=int(sys.argv[1]))[0]]
for k in range(30):
    o, r, *_ = env.step(np.array([-0.4 + 0.01 * k, -0.9]))
    found += [o, [r]]
print(np.concatenate(found).astype(np.float64).tobytes().hex())
"""


def _bits(seed, before=""):
    done = subprocess.run(
        [sys.executable, "-c", RUN.format(before=before), str(seed)], capture_output=True, text=True, check=True
    )
    return done.stdout


@pytest.mark.slow
def test_a_seed_gives_the_same_bits_in_every_process():
    first = _bits(7)
    # What was simulated before must not matter.
    assert first == _bits(7, "env.reset(seed=1); env.step(np.zeros(2))")
    assert first != _bits(8)


def test_other_seeds_are_other_patients(env):
    patients = [env.reset(seed=k)[1]["patient"]["body_mass"] for k in range(5)]
    assert len(set(patients)) == 5
    assert env.reset(seed=2)[1]["patient"]["body_mass"] == patients[2]


def test_without_a_seed_the_generator_goes_on(env):
    env.reset(seed=2)
    second = env.reset()[1]
    env.reset(seed=2)
    assert second == env.reset()[1]


def test_episode_statistics(make):
    env = RecordEpisodeStatistics(make(action_mode="pid_setpoint", episode_duration=0.2))
    env.reset(seed=0)
    rewards, over, info = [], False, {}
    while not over:
        _, reward, terminated, truncated, info = env.step(np.zeros(2, np.float32))
        rewards.append(reward)
        over = terminated or truncated
    assert info["episode"]["l"] == len(rewards) == 10
    assert info["episode"]["r"] == pytest.approx(sum(rewards))


def test_a_video_is_recorded_without_a_display(make, monkeypatch, tmp_path):
    """RecordVideo writes mp4 with moviepy, which brings its own encoder; the pictures need no screen."""
    imageio = pytest.importorskip("imageio")
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        inner = make(render_mode="rgb_array", episode_duration=0.2)
        env = RecordVideo(inner, str(tmp_path / "videos"), episode_trigger=lambda _: True)
        env.reset(seed=0)
        while not env.step(np.zeros(2, np.float32))[3]:
            pass
        env.close()
    (video,) = tmp_path.glob("videos/*.mp4")
    with imageio.get_reader(video) as reader:
        frames = [np.asarray(frame) for frame in reader]
        assert reader.get_meta_data()["fps"] == 50.0
    # The reset and ten periods; the encoder, which counts by duration, may drop the last.
    assert len(frames) in (10, 11) and frames[0].shape == (480, 480, 3)


def test_memory_is_not_shared(env):
    first, info = env.reset(seed=0)
    kept = first.copy()
    after = env.step(ACTION)[0]
    np.testing.assert_array_equal(first, kept)
    assert not np.shares_memory(first, after)
