"""Films of policies: side by side, whole or not at all, and a film where there is no ffmpeg."""

import numpy as np
import pytest

pytest.importorskip("imageio.v3")
pytest.importorskip("pygame")

import imageio.v3 as imageio

from agents.__main__ import main
from agents.commands.pictures import video as filmed
from agents.commands.pictures.video import BAND, Stage, band, grey, pictures
from exo_env.rendering.history import HEIGHT

SIZE = 480


@pytest.fixture
def short(monkeypatch):
    """Films of four pictures."""
    whole = filmed.pictures
    monkeypatch.setattr(filmed, "pictures", lambda stages: (p for _, p in zip(range(4), whole(stages), strict=False)))


def film(out, *names):
    return main(["video", "--policy", *names, "--out", str(out)])


def test_film_shows_both_side_by_side(short, tmp_path):
    pytest.importorskip("imageio_ffmpeg")
    assert film(tmp_path / "a.mp4", "none", "pid") == 0
    found = imageio.imread(tmp_path / "a.mp4")
    assert found.shape == (4, BAND + SIZE + HEIGHT, 2 * SIZE, 3)
    assert [p.name for p in tmp_path.iterdir()] == ["a.mp4"]


def test_without_ffmpeg_it_is_a_gif(short, tmp_path, monkeypatch, capsys):
    import sys

    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    assert film(tmp_path / "a.mp4", "pid") == 0
    assert [p.name for p in tmp_path.iterdir()] == ["a.gif"] and "a.gif" in capsys.readouterr().out
    assert imageio.imread(tmp_path / "a.gif").shape[1:] == (BAND + SIZE + HEIGHT, SIZE, 3)


def test_both_have_the_same_patient_and_one_that_ended_stands_still_in_grey():
    from agents.policies.baselines import policy

    stages = [Stage(policy(name), "stroke_severe", 0, episode_duration=0.4) for name in ("none", "pid")]
    first_drawn, second_drawn = (stage.playing.drawn for stage in stages)
    assert first_drawn == {**second_drawn, "initial_angle_deg": first_drawn["initial_angle_deg"]}
    shown = pictures(stages)
    first = next(shown)
    assert len(stages[0].scenes) == len(stages[1].scenes) == stages[0].length == 21
    stages[0].scenes, stages[0].event = stages[0].scenes[:3], "ended at 0.04 s: The elbow is at -0.2 deg."
    second, third, fourth = next(shown), next(shown), next(shown)
    assert not np.array_equal(first[:, SIZE:], second[:, SIZE:])
    assert not np.array_equal(third[BAND:, SIZE:], fourth[BAND:, SIZE:])
    assert np.array_equal(third[:, :SIZE], fourth[:, :SIZE])
    assert (np.ptp(second[BAND:, :SIZE], axis=-1) > 0).any() and (np.ptp(third[BAND:, :SIZE], axis=-1) == 0).all()


def test_a_long_title_is_whole():
    """Nothing of it is cut off at the edges, however long."""
    for title in ("oracle: PID that knows plan, load and ability of the patient", "W" * 60):
        shown = (band(SIZE, title, "") < 255).any(axis=(0, 2))
        assert not shown[0] and not shown[-1] and np.ptp(np.flatnonzero(shown)) > 0.8 * SIZE


def test_an_event_is_told_with_its_time():
    from agents.policies.baselines import policy

    stage = Stage(policy("pid"), "stroke_severe", 0, limits={"tension": 20.0}, episode_duration=0.4)
    stage.run()
    assert stage.event.startswith(f"ended at {stage.scenes[-1].time:.2f} s: A rope pulls with ")
    whole = Stage(policy("pid"), "stroke_severe", 0, episode_duration=0.4)
    whole.run()
    assert whole.event == "" and len(whole.scenes) == whole.length


def test_grey_is_lighter_and_has_no_colour():
    picture = np.zeros((2, 2, 3), np.uint8)
    picture[..., 0] = 200
    found = grey(picture)
    assert found.shape == picture.shape and found.dtype == np.uint8
    assert (np.ptp(found, axis=-1) == 0).all() and found.min() > picture.mean()


def test_films_of_a_hidden_plan(short, tmp_path):
    out = tmp_path / "a.gif"
    assert main(["video", "--policy", "none", "--env", "exo/HiddenIntent-v0", "--out", str(out)]) == 0
    assert imageio.imread(out).shape[1:] == (BAND + SIZE + HEIGHT, SIZE, 3)


def test_band_tells_what_ended_an_episode():
    quiet, told = band(SIZE, "PID", ""), band(SIZE, "PID", "The elbow is at -0.2 deg.")
    assert quiet.shape == (BAND, SIZE, 3) and np.array_equal(quiet[:24], told[:24])
    assert (quiet[26:] == 255).all() and not (told[26:] == 255).all()


@pytest.mark.parametrize(
    "said, name, policies",
    [
        ("expected a name that ends in .mp4 or .gif", "a.avi", ["pid"]),
        ("policies 'pid' and 'pid' are the same one", "a.gif", ["pid", "pid"]),
        ("expected one to 4 names, got 5", "a.gif", ["pid"] * 5),
        ("unknown policy 'nobody'", "a.gif", ["nobody"]),
    ],
)
def test_mistakes_are_one_message(said, name, policies, tmp_path, capsys):
    assert film(tmp_path / name, *policies) == 2
    errors = capsys.readouterr().err
    assert said in errors and errors.count("\n") == 1 and not list(tmp_path.iterdir())
