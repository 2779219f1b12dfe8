"""Films of policies: side by side, whole or not at all, and a film where there is no ffmpeg."""

import numpy as np
import pytest

pytest.importorskip("imageio.v3")
pytest.importorskip("pygame")

import imageio.v3 as imageio

from agents.__main__ import main
from agents.commands import video as filmed
from agents.commands.video import BAND, Stage, band, pictures

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
    assert found.shape == (4, SIZE + BAND, 2 * SIZE, 3)
    assert [p.name for p in tmp_path.iterdir()] == ["a.mp4"]


def test_without_ffmpeg_it_is_a_gif(short, tmp_path, monkeypatch, capsys):
    import sys

    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    assert film(tmp_path / "a.mp4", "pid") == 0
    assert [p.name for p in tmp_path.iterdir()] == ["a.gif"] and "a.gif" in capsys.readouterr().out
    assert imageio.imread(tmp_path / "a.gif").shape[1:] == (SIZE + BAND, SIZE, 3)


def test_both_have_the_same_patient_and_one_that_ended_stands_still():
    from agents.policies.baselines import policy

    stages = [Stage(policy(name), "stroke_severe", 0) for name in ("none", "pid")]
    assert stages[0].info == {**stages[1].info, "initial_angle_deg": stages[0].info["initial_angle_deg"]}
    shown = pictures(stages)
    next(shown)
    stages[0].over = True
    first, second = next(shown), next(shown)
    assert np.array_equal(first[:, :SIZE], second[:, :SIZE])
    assert not np.array_equal(first[:, SIZE:], second[:, SIZE:])


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
