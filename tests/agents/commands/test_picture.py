"""The picture of one patient under several policies."""

import numpy as np
import pytest

pytest.importorskip("matplotlib")

from agents.__main__ import main
from agents.evaluation.figures import policy_picture as drawing
from agents.evaluation.figures.policy_picture import in_words, policy_picture
from tests.agents.evaluation.test_figures import course

MEASURES = {"device_work_share": 0.642, "tracking_rms_deg": 8.34}


@pytest.mark.parametrize("ending", ["png", "svg"])
def test_command_writes_a_picture(ending, tmp_path):
    out = tmp_path / f"a.{ending}"
    assert main(["picture", "--policy", "none", "--seed", "3", "--out", str(out)]) == 0
    assert [p.name for p in tmp_path.iterdir()] == [out.name] and out.stat().st_size > 10_000


def test_another_environment_and_a_second_policy(tmp_path):
    out = tmp_path / "a.png"
    options = ["--env", "exo/ElbowLift-v2", "--patient", "stroke_mild", "--out", str(out)]
    assert main(["picture", "--policy", "none", "pid", *options]) == 0 and out.exists()


def test_a_column_a_policy_with_share_and_error_in_words(tmp_path, monkeypatch):
    shown = []
    monkeypatch.setattr(drawing, "save", lambda figure, path: shown.append(figure))
    event = "A rope pulls with 210 N; 200 N is the limit."
    cut = {name: values[:101] for name, values in course().columns.items()}
    ones = [course("none", measures=MEASURES), course("best", 9.0, columns=cut, event=event, measures=MEASURES)]
    policy_picture(tmp_path / "a.png", ones, "One patient")
    (figure,) = shown
    above, below = figure.axes[:2], figure.axes[2:]
    assert [ax.get_title() for ax in above] == [
        f"{name}\ndevice does 64 % of the work\n8.3 deg off the plan (rms)" for name in ("none", "best")
    ]
    for ax in above:
        plan, arm = ax.lines[:2]
        assert plan.is_dashed() and not arm.is_dashed() and len(plan.get_xdata()) == 201
    for ax in below:
        labels = [line.get_label() for line in ax.lines if not line.get_label().startswith("_")]
        assert labels == ["moment of the device", "moment of the muscles"]
    assert "+0.6 kg" in [text.get_text() for text in above[0].texts]
    said = figure.get_supxlabel().replace("\n", " ")
    assert "dotted: the load changes" in said and f"best ended at 2.0 s (cross): {event}" in said
    assert len(figure.legends[0].get_texts()) == 4


def test_long_titles_do_not_leave_their_column(tmp_path, monkeypatch):
    shown = []
    monkeypatch.setattr(drawing, "save", lambda figure, path: shown.append(figure))
    policy_picture(tmp_path / "a.png", [course("a policy of many words " * 3, measures=MEASURES)] * 3, "One patient")
    (figure,) = shown
    figure.canvas.draw()
    for ax in figure.axes[:3]:
        title, box = ax.title.get_window_extent(), ax.get_window_extent()
        assert title.width < box.width + 20.0


def test_words_where_nobody_moves():
    still = course(measures={"device_work_share": np.nan, "tracking_rms_deg": 0.0}, hidden=False)
    assert in_words(still) == "nobody moves\n0.0 deg off the reference (rms)"


@pytest.mark.parametrize(
    "said, name, more",
    [
        ("expected a name that ends in .png, .svg, .pdf", "a.jpg", ["--policy", "none"]),
        ("expected one to 6 names, got 7", "a.png", ["--policy", *["none"] * 7]),
        ("unknown policy 'nobody'", "a.png", ["--policy", "nobody"]),
        ("unknown population 'martians'", "a.png", ["--policy", "none", "--patient", "martians"]),
        ("the patient's plan is hidden", "a.png", ["--policy", "pid"]),
        ("expected one with the readings", "a.png", ["--policy", "none", "--env", "tests/NoReference-v0"]),
    ],
)
def test_mistakes_are_one_message(said, name, more, tmp_path, capsys):
    from tests.agents import other_environments  # noqa: F401

    assert main(["picture", *more, "--out", str(tmp_path / name)]) == 2
    errors = capsys.readouterr().err
    assert said in errors and errors.count("\n") == 1 and not list(tmp_path.iterdir())
