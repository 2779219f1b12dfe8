"""Pictures of the environment: size, repeatability, and what their colours tell; no display is needed."""

from __future__ import annotations

import gymnasium
import numpy as np
import pytest

import exo_env  # noqa: F401

pytest.importorskip("pygame")


@pytest.fixture
def env(monkeypatch):
    monkeypatch.delenv("DISPLAY", raising=False)
    settings = {"render_mode": "rgb_array", "patient": "stroke_mild", "action_mode": "pid_setpoint"}
    made = gymnasium.make("exo/ElbowLift-v2", **settings)
    yield made
    made.close()


def test_a_frame_is_a_square_of_bytes_and_repeats_bit_by_bit(env):
    env.reset(seed=3)
    frame = env.render()
    assert frame.shape == (480, 480, 3) and frame.dtype == np.uint8
    assert np.array_equal(frame, env.render()), "the same state must give the same picture"
    assert len(np.unique(frame.reshape(-1, 3), axis=0)) > 50, "an empty canvas has few colours"


def test_the_picture_follows_the_arm(env):
    env.reset(seed=3)
    before = env.render()
    for _ in range(40):
        env.step(np.array([0.5, 1.0], np.float32))
    assert np.mean(np.any(env.render() != before, axis=-1)) > 0.02, "a moved forearm changes many pixels"


def test_a_scene_holds_who_does_how_much(env):
    env.reset(seed=3)
    env.step(np.zeros(2, np.float32))
    world = env.unwrapped
    scene, r = world.scene(), world.readings()
    assert (scene.muscle_moment, scene.device_moment) == (r["muscle_moment"], r["exo_moment"])
    assert scene.effort == r["effort"] and scene.error_deg == pytest.approx(np.degrees(r["tracking_error"]))
    assert [tension for _, tension in scene.ropes] == [
        max(r[f"{rope}_tension"], 0.0) for rope in ("agonist", "antagonist")
    ]
