"""What the paper's figures show, and what they say of the rest."""

import numpy as np
import pytest

pytest.importorskip("matplotlib")

from dms_core.model.control.ziegler_nichols import Gains
from exo_env.paper import figures
from exo_env.paper.figures import FIGURES, rest_time, scenario_figures, step_response
from exo_env.paper.scenarios import Exercise, Scenario, run

EXERCISE = Exercise(
    times=(0.1, 0.9), angles_deg=(30.0, 60.0), duration=1.0, proprioception={"gain": 0.2, "delay": 0.06}
)
ALONE = Scenario(title="alone", maximum_activation=1.0, assistance=0.0, weight=1.0, expected_weight=1.0)
LIMP = ALONE.changed(title="limp", maximum_activation=0.0, assistance=1.0)
HALF = ALONE.changed(title="half", maximum_activation=0.5, assistance=1.0)
LABELS = ["1: alone", "2: limp", "3: half"]


@pytest.fixture(scope="module")
def runs():
    return [run(scenario, EXERCISE) for scenario in (ALONE, LIMP, HALF)]


@pytest.fixture
def saved(monkeypatch):
    """Figures by name, in place of files."""
    found = {}
    monkeypatch.setattr(figures, "save", lambda figure, path: found.update({path.name: figure}))
    return found


def legend_of(figure):
    return [text.get_text() for legend in figure.legends for text in legend.get_texts()]


def test_every_scenario_is_in_a_figure_or_in_its_note(runs, saved, tmp_path):
    scenario_figures(tmp_path, runs, LABELS)
    assert set(saved) == {"fig09_trajectories.png", *(figure.file for figure in FIGURES)}
    for name, figure in saved.items():
        told = legend_of(figure) + [figure.get_supxlabel()]
        assert all(any(label in text for text in told) for label in LABELS), name
    assert 'Not drawn: "2: limp", in which the subject commands no muscle.' in (
        saved["fig10_muscle_forces.png"].get_supxlabel()
    )
    assert 'Not drawn: "1: alone", in which the device does not assist.' in (
        saved["fig11_rope_tensions.png"].get_supxlabel()
    )


def test_no_panel_is_empty(runs, saved, tmp_path):
    """The antagonist stays slack: a sentence says so."""
    scenario_figures(tmp_path, runs, LABELS)
    for name, figure in saved.items():
        for ax in figure.axes:
            drawn = [line for line in ax.lines if not line.get_label().startswith("_")]
            assert drawn and max(np.ptp(line.get_ydata()) for line in drawn) > 0.0, name
    (only,) = saved["fig11_rope_tensions.png"].axes
    assert only.get_ylabel() == "agonist tension (PID 1) [N]"
    assert "antagonist tension (PID 2) is at most" in saved["fig11_rope_tensions.png"].get_supxlabel()


def test_axes_name_quantity_and_unit(runs, saved, tmp_path):
    scenario_figures(tmp_path, runs, LABELS)
    labels = [ax.get_ylabel() for figure in saved.values() for ax in figure.axes]
    assert "biceps force (long head) [N]" in labels and "elbow flexion [deg]" in labels
    assert all(label.endswith("]") and " " in label for label in labels)


def test_a_scenario_that_lies_on_another_one_is_shown_as_a_difference(runs, saved, tmp_path):
    scenario_figures(tmp_path, [runs[0], runs[2], runs[2]], ["1: alone", "2: half", "3: again"])
    figure = saved["fig12_joint_moments.png"]
    labels = [ax.get_ylabel() for ax in figure.axes]
    assert [label.count("difference to 2") for label in labels] == [0, 1] * 3
    assert "Not drawn in a, but in b: 3 on 2 (less than 0.01 Nm apart)." in figure.get_supxlabel()
    assert legend_of(figure) == ["1: alone", "2: half", "3: again"]


def test_gains_have_prefixes_and_the_rest_is_told(tmp_path, monkeypatch):
    shown = []
    monkeypatch.setattr(figures, "save", lambda figure, path: shown.append(figure))
    times = np.linspace(0.0, 2.0, 2001)
    angle = 1.2 - 0.2 * np.exp(-times / 0.02)
    step_response(tmp_path / "a.png", times, angle, 1.2, "critical gain", Gains(14742.0, 0.0, 0.0))
    (ax,) = shown[0].axes
    assert ax.get_title() == "critical gain: $K_p$ = 14.7 kN/rad"
    # 1 % of the way is left after ln(100) time constants.
    assert rest_time(times, angle) == pytest.approx(0.02 * np.log(100.0), abs=0.002)
    assert ax.get_xlim()[1] == pytest.approx(2.0 * rest_time(times, angle))
    assert "to 2 s it stays within" in shown[0].get_supxlabel()


def test_an_oscillation_is_shown_whole(tmp_path, monkeypatch):
    shown = []
    monkeypatch.setattr(figures, "save", lambda figure, path: shown.append(figure))
    times = np.linspace(0.0, 1.0, 1001)
    step_response(tmp_path / "a.png", times, 1.0 + np.sin(50.0 * times), 1.0, "critical gain", Gains(1.0, 0.0, 0.0))
    (ax,) = shown[0].axes
    assert ax.get_xlim()[1] > 1.0 and shown[0].get_supxlabel() == ""
