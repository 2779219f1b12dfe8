"""What films show of an episode: scales, the strip below the arm, words, and a plan that is hidden."""

from __future__ import annotations

import gymnasium
import numpy as np
import pytest

import exo_env  # noqa: F401

pytest.importorskip("pygame")

from exo_env.rendering.canvas import Canvas
from exo_env.rendering.history import CHARTS, HEIGHT, History
from exo_env.rendering.picture import REFERENCE
from exo_env.rendering.renderer import Renderer
from exo_env.rendering.scales import Scales


@pytest.fixture(scope="module")
def scenes():
    """An episode of 0.4 s under a strong moment, with a load that changes."""
    settings = {"patient": "stroke_severe", "reference": {"load_changes": 1.0, "targets": 4}}
    env = gymnasium.make("exo/HiddenIntent-v0", disable_env_checker=True, **settings)
    found, world = [], env.unwrapped
    env.reset(seed=3)
    found.append(world.scene())
    for _ in range(450):
        env.step(np.array([0.6, -1.0], np.float32))
        found.append(world.scene())
    env.close()
    return found


@pytest.fixture
def words(monkeypatch):
    """All words that are drawn, in turn."""
    said, known = [], Canvas.words

    def drawn(self, text, *given, **more):
        said.append(text)
        known(self, text, *given, **more)

    monkeypatch.setattr(Canvas, "words", drawn)
    return said


def test_the_weight_is_the_one_at_the_time(scenes):
    assert len({scene.weight_mass for scene in scenes}) > 1


def test_a_hidden_plan_is_called_so(scenes, words):
    renderer = Renderer("rgb_array", 50)
    renderer.draw(scenes[0])
    assert scenes[0].plan_hidden and "plan (hidden)" in words and "reference" not in words
    env = gymnasium.make("exo/ElbowLift-v2", disable_env_checker=True)
    env.reset(seed=0)
    words.clear()
    renderer.draw(env.unwrapped.scene())
    assert "reference" in words and "plan (hidden)" not in words


def test_no_zero_has_a_minus(scenes, words):
    from dataclasses import replace

    nothing = {"elbow_angle": -1e-6, "error_deg": -0.01, "muscle_moment": -0.04, "device_moment": -0.0}
    Renderer("rgb_array", 50).draw(replace(scenes[0], **nothing))
    assert "0.0\u00b0" in words and "0.0 Nm" in words
    assert not [text for text in words if text.startswith("-0")]


def test_colours_span_what_happens(scenes, words):
    scales = Scales.spanning(scenes)
    most = max(tension for scene in scenes for _, tension in scene.ropes)
    assert most <= scales.tension <= 2.0 * most and 0.1 <= scales.activation <= 1.0
    renderer = Renderer("rgb_array", 50, scales=scales)
    strongest = max(scenes, key=lambda scene: max(tension for _, tension in scene.ropes))
    assert not np.array_equal(renderer.draw(strongest), Renderer("rgb_array", 50).draw(strongest))
    assert f"{scales.tension:g}" in words and f"{scales.activation:g}" in words


def test_scales_of_nothing_are_not_empty(scenes):
    from dataclasses import replace

    idle = replace(scenes[0], ropes=(), muscles=())
    assert min(Scales.spanning([idle])) > 0.0


def test_the_strip_grows_with_time_and_tells_policies_apart(scenes, words):
    history = History(480, scenes, [scenes])
    begin, end = history.draw(1), history.draw(len(scenes))
    assert begin.shape == end.shape == (HEIGHT, 480, 3)
    assert not np.array_equal(begin, end)
    assert {chart.title for chart in CHARTS} == {"flexion [deg]", "moment [Nm]", "effort [-]"}
    assert {"device", "muscles", "of the patient", "wanted", "arm"} <= set(words)


def test_what_is_wanted_is_dashed(scenes):
    """A dashed line at rest covers a part of its way, a solid one would cover it all."""
    rows = History(480, scenes[:40], [scenes]).draw(40)[:60]
    # Where it is drawn: pixels near its colour, by column.
    near = (np.abs(rows.astype(int) - REFERENCE).sum(axis=-1) < 90).any(axis=0)
    columns = np.flatnonzero(near)
    columns = columns[columns < 100]
    assert columns.size and not near[columns[0] : columns[-1] + 1].all()


def test_strips_of_compared_episodes_have_the_same_axes(scenes, words):
    History(480, scenes[:3], [scenes[:3], scenes]).draw(3)
    short = list(words)
    words.clear()
    History(480, scenes, [scenes[:3], scenes]).draw(3)
    assert short == words
