"""What the figures of evaluations and reports show."""

import numpy as np
import pytest

pytest.importorskip("matplotlib")

from agents.evaluation.comparison.evaluate import evaluate
from agents.evaluation.episodes.measures import MEASURES
from agents.evaluation.episodes.time_course import TimeCourse, time_course
from agents.evaluation.figures import figure as evaluation_figure
from agents.evaluation.figures import patients_figure, report_figures
from agents.evaluation.figures.report_figures import Group, learning_curves
from agents.policies.baselines import policy

TIMES = np.linspace(0.0, 4.0, 201)


def course(name="a", shift=0.0, **changes):
    """A course in which the arm follows at a distance [deg], and the load grows at 2 s."""
    psi = 0.5 + 0.4 * np.sin(TIMES)
    columns = {
        "time": TIMES, "elbow_angle.angle": psi + np.radians(shift), "reference": psi,
        "agonist_tension": 20.0 + shift + psi, "antagonist_tension": 0.0 * psi, "exo_moment": 2.0 + psi + 0.1 * shift,
        "muscle_moment": 1.0 - psi, "effort": 1.0 - 0.1 * shift * TIMES, "load": np.where(TIMES < 2.0, 1.0, 1.6),
    }  # fmt: skip
    known = {"patient": {}, "load": 1.0, "columns": columns, "event": None, "measures": {}, "hidden": True}
    return TimeCourse(policy=name, **{**known, **changes})


@pytest.fixture
def saved(monkeypatch):
    """Figures, in place of files."""
    found = []
    for module in (evaluation_figure, patients_figure, report_figures):
        monkeypatch.setattr(module, "save", lambda figure, path: found.append(figure))
    return found


def test_measures_that_never_differ_are_told(saved, tmp_path):
    found = evaluate([policy("pid"), policy("none")], "stroke_mild", 2, 0, episode_duration=0.4)
    evaluation_figure.draw(tmp_path / "a.png", found)
    (figure,) = saved
    shown = [ax.get_title() for ax in figure.axes if ax.get_visible()]
    assert "tracking, rms [deg]" in shown and "solver failures" not in shown
    said = figure.get_supxlabel().replace("\n", " ")
    assert "solver failures 0" in said and "length of the episode 0.4 s" in said
    for m in (m for m in MEASURES if m.name in found["policies"]["pid"]["summary"]):
        assert m.label in said or any(title.startswith(m.label) for title in shown), m.name


def test_a_plan_is_dashed_and_load_steps_are_marked(saved, tmp_path):
    patients_figure.time_courses(tmp_path / "a.png", {"one": [course(), course("b", 10.0)]})
    (figure,) = saved
    above = figure.axes[0]
    (plan,) = [line for line in above.lines if line.get_label() == "plan, hidden from the device"]
    assert plan.is_dashed()
    for ax in figure.axes:
        assert [line.get_xdata()[0] for line in ax.lines if line.get_linestyle() == ":"] == pytest.approx([2.0])
    assert "+0.6 kg" in [text.get_text() for text in above.texts]


def test_a_reference_that_the_device_knows_is_none(saved, tmp_path):
    patients_figure.time_courses(tmp_path / "a.png", {"one": [course(hidden=False)]})
    labels = [line.get_label() for line in saved[0].axes[0].lines]
    assert "reference" in labels and not any("plan" in label for label in labels)
    assert not any("minus that of" in ax.get_ylabel() for ax in saved[0].axes)


def test_policies_that_look_alike_are_told_apart_by_moment_and_effort(saved, tmp_path):
    patients_figure.time_courses(tmp_path / "a.png", {"one": [course("a", 5.0), course("b", 5.2)]})
    (figure,) = saved
    said = figure.get_supxlabel().replace("\n", " ")
    assert "a: b on a (at most 0.2 deg apart)" in said
    (compared,) = [ax for ax in figure.axes if ax.get_ylabel().startswith("moment minus that of\na")]
    np.testing.assert_allclose(compared.lines[0].get_ydata(), 0.02, rtol=1e-9)
    assert figure.axes[-1].get_ylabel() == "effort of\nthe patient [-]" and len(figure.axes[-1].lines) > 1
    assert {text.get_text() for text in figure.legends[0].get_texts()} >= {"a", "b"}


def test_an_early_end_is_crossed_and_told(saved, tmp_path):
    event = "The elbow is at 160.00 deg, outside -60 to 150 deg."
    cut = {name: values[:51] for name, values in course().columns.items()}
    patients_figure.time_courses(tmp_path / "a.png", {"one": [course(), course("b", 9.0, columns=cut, event=event)]})
    said = saved[0].get_supxlabel().replace("\n", " ")
    assert f"one: b ended at 1.0 s (cross): {event}" in said
    assert [line.get_xdata()[0] for line in saved[0].axes[0].lines if line.get_marker() == "x"] == [1.0]


def test_a_course_knows_the_plan_its_loads_and_its_measures():
    found = time_course(
        policy("none"), "stroke_severe", 3, environment="exo/HiddenIntent-v0", reference={"load_changes": 1.0}
    )
    assert found.hidden and found.wanted == "plan" and found.load_steps
    time, change = found.load_steps[0]
    load = found.columns["load"]
    assert change == pytest.approx(load[round(50 * time)] - load[round(50 * time) - 1]) and change != 0.0
    error = np.degrees(found.columns["elbow_angle.angle"] - found.columns["reference"])
    assert found.measures["tracking_rms_deg"] == pytest.approx(np.sqrt(np.mean(error**2)), rel=1e-12)
    other = time_course(policy("none"), "stroke_severe", 3, episode_duration=0.4)
    assert not other.hidden and other.load_steps == []


@pytest.mark.parametrize("last, label, end", [(2_000_000, "[million]", 2.0), (5000, "[thousand]", 5.0), (80, "", 80.0)])
def test_decisions_are_counted_in_words(saved, tmp_path, last, label, end):
    curve = [{"steps": s, "return": 1.0, "tracking_rms_deg": 1.0} for s in (0, last)]
    learning_curves(tmp_path / "a.png", [Group("ppo", [curve, curve])])
    ax = saved[0].axes[0]
    assert ax.get_xlabel() == f"decisions {label}".strip() and ax.lines[0].get_xdata()[-1] == end
    assert [a.get_ylabel() for a in saved[0].axes] == ["return of an episode", "tracking error, rms [deg]"]
