"""The command `scenarios` with a device, a subject, an exercise and scenarios of the user's own."""

import csv
import json

import numpy as np
import pytest
import yaml

from dms_core.files.config_files import config_file
from exo_env.__main__ import main
from exo_env.ecosystem.ecosystem import Ecosystem
from exo_env.paper.figures import scenario_figures
from exo_env.paper.scenarios import Exercise, Scenario, load_scenarios, run
from exo_env.rendering.panels import COLOURS, DASHES

EXERCISE = {
    "times": [0.1, 0.9],
    "angles_deg": [30.0, 60.0],
    "duration": 1.0,
    "proprioception": {"gain": 0.2, "delay": 0.06},
}
SCENARIO = {"title": "mine", "maximum_activation": 0.4, "assistance": 1.0, "weight": 2.0, "expected_weight": 1.0}


def written(path, content) -> str:
    path.write_text(yaml.safe_dump(content))
    return str(path)


def shipped(name: str) -> dict:
    return yaml.safe_load(config_file(name).read_text())


def test_own_scenarios_on_an_own_exercise(tmp_path, capsys):
    exercise = written(tmp_path / "lift.yaml", EXERCISE)
    files = [
        written(tmp_path / f"{name}.yaml", {**SCENARIO, "weight": kg}) for name, kg in (("light", 0.5), ("dear", 3.0))
    ]
    out = tmp_path / "out"
    assert main(["scenarios", "--out", str(out), "--exercise", exercise, "--scenarios", *files]) == 0
    assert {"light.csv", "dear.csv", "fig09_trajectories.png", "fig10_muscle_forces.png"} < {
        p.name for p in out.iterdir()
    }
    report = json.loads((out / "scenarios.json").read_text())
    assert [s["name"] for s in report["scenarios"]] == ["light", "dear"] and report["orderings"] == []
    assert report["scenarios"][0]["reference_peak_angle_deg"] == pytest.approx(60.0, abs=1e-6)
    assert report["scenarios"][0]["peak_agonist_rope_N"] < report["scenarios"][1]["peak_agonist_rope_N"]
    with (out / "dear.csv").open(newline="") as file:
        header, *rows = csv.reader(file)
    assert header[0] == "time_s" and float(rows[-1][0]) == pytest.approx(1.0)
    printed = capsys.readouterr().out
    assert "none is judged here" in printed and "left out" not in printed


def test_a_rope_that_pushes_is_told(tmp_path, capsys):
    """A weight of 10.00 kg, its point forgotten: nobody holds it, and the arm is thrown about."""
    heavy = written(tmp_path / "heavy.yaml", {**SCENARIO, "weight": 1000.0})
    exercise = written(tmp_path / "lift.yaml", EXERCISE)
    assert main(["scenarios", "--out", str(tmp_path / "out"), "--exercise", exercise, "--scenarios", heavy]) == 0
    assert "note   heavy: rope_length 'gym_rope': its tension was negative" in capsys.readouterr().out


def test_figures_without_anything_to_show_are_left_out_with_a_sentence(tmp_path, capsys):
    exercise = written(tmp_path / "lift.yaml", EXERCISE)
    limp = written(tmp_path / "limp.yaml", {**SCENARIO, "maximum_activation": 0.0})
    assert main(["scenarios", "--out", str(tmp_path / "out"), "--exercise", exercise, "--scenarios", limp]) == 0
    assert "fig10_muscle_forces.png is left out: no scenario has a maximum_activation above 0." in (
        capsys.readouterr().out
    )
    names = {path.name for path in (tmp_path / "out").iterdir()}
    assert "fig10_muscle_forces.png" not in names and "fig11_rope_tensions.png" in names


def test_subject_and_device_of_other_muscles_and_ropes(tmp_path, capsys):
    """What has other names is simulated; figures and numbers of the missing ones are left out."""
    facts = yaml.safe_load(json.dumps(shipped("subject/arm26.yaml")).replace("TRIlong", "triceps_of_mine"))
    device = yaml.safe_load(json.dumps(shipped("exoskeletons/elbow.yaml")).replace('"antagonist"', '"lowering"'))
    arguments = [
        "scenarios", "--out", str(tmp_path / "out"), "--subject", written(tmp_path / "me.yaml", facts),
        "--exoskeleton", written(tmp_path / "device.yaml", device),
        "--exercise", written(tmp_path / "lift.yaml", EXERCISE), "--scenarios", written(tmp_path / "a.yaml", SCENARIO),
    ]  # fmt: skip
    assert main(arguments) == 0
    printed = capsys.readouterr().out
    assert "fig10_muscle_forces.png is left out: subject and device have no TRIlong.sensor.tendon_force." in printed
    assert "fig11_rope_tensions.png is left out: subject and device have no antagonist_tension." in printed
    numbers = json.loads((tmp_path / "out" / "scenarios.json").read_text())["scenarios"][0]
    assert "peak_biceps_long_N" in numbers and "peak_triceps_long_N" not in numbers
    assert "peak_agonist_rope_N" in numbers and "peak_antagonist_rope_N" not in numbers
    assert "lowering_tension_N" in (tmp_path / "out" / "a.csv").read_text().splitlines()[0]


def test_the_papers_scenarios_on_an_own_subject_are_judged_as_far_as_they_can_be(tmp_path, capsys):
    facts = yaml.safe_load(json.dumps(shipped("subject/arm26.yaml")).replace("TRIlong", "triceps_of_mine"))
    subject = written(tmp_path / "me.yaml", facts)
    assert main(["scenarios", "--out", str(tmp_path / "out"), "--subject", subject]) == 0
    assert "Left out: 1 of 15, on muscles or ropes" in capsys.readouterr().out
    orderings = json.loads((tmp_path / "out" / "scenarios.json").read_text())["orderings"]
    assert len(orderings) == 14
    assert all("of another subject" in o["why_not"] for o in orderings if not o["holds"])


def test_the_command_is_planned_for_the_own_subject(tmp_path):
    """Muscles of half the force need twice the activation, about; a plan for arm26 would be the same for both."""
    facts = shipped("subject/arm26.yaml")
    for muscle in facts["muscles"].values():
        muscle["max_isometric_force"] *= 0.5
    weak = Ecosystem(subject=written(tmp_path / "weak.yaml", facts))
    _, (scenario, *_) = load_scenarios()
    strongest, weakest = (run(scenario, Exercise(**EXERCISE), e).command.activations.max() for e in (None, weak))
    assert weakest > 1.5 * strongest


def test_many_scenarios_have_lines_of_their_own(tmp_path):
    done = run(Scenario(**SCENARIO), Exercise(**EXERCISE))
    assert scenario_figures(tmp_path, [done] * 9, [str(k) for k in range(9)]) == []
    styles = {(COLOURS[k % len(COLOURS)], DASHES[k % len(DASHES)]) for k in range(28)}
    assert len(styles) == 28
    assert (tmp_path / "fig09_trajectories.png").stat().st_size > 20_000


@pytest.mark.parametrize(
    ("option", "content", "complaint"),
    [
        ("--exercise", {**EXERCISE, "duration": 0.5}, "wrong.yaml: Exercise: duration = 0.5: expected at least"),
        ("--exercise", {**EXERCISE, "times": [0.9, 0.1]}, r"wrong.yaml: Exercise: times = [0.9, 0.1]: expected"),
        ("--exercise", {**EXERCISE, "angles_deg": [30.0]}, "wrong.yaml: Exercise: angles_deg = [30.0]: expected 2"),
        ("--exercise", {**EXERCISE, "angles_deg": [30.0, 190.0]}, "angles_deg = [30.0, 190.0]: expected angles from 0"),
        ("--scenarios", {**SCENARIO, "assistance": 2.0}, "wrong.yaml: Scenario: assistance = 2.0"),
        ("--scenarios", {**SCENARIO, "mass": 1.0}, "wrong.yaml: Scenario: unknown key 'mass'"),
        ("--exoskeleton", {"hinge_damping": 1.0}, "wrong.yaml: Exoskeleton: 'upper_link' is missing"),
        ("--subject", {"gravity": [0.0, -9.8, 0.0]}, "wrong.yaml: SubjectFacts: 'roles' is missing"),
    ],
)
def test_a_wrong_file_is_named_with_key_and_value(tmp_path, capsys, option, content, complaint):
    path = written(tmp_path / "wrong.yaml", content)
    assert main(["scenarios", "--out", str(tmp_path / "out"), option, path]) == 2
    assert complaint in capsys.readouterr().err


def test_two_scenarios_of_one_name_are_refused(tmp_path, capsys):
    (tmp_path / "other").mkdir()
    files = [written(tmp_path / "a.yaml", SCENARIO), written(tmp_path / "other" / "a.yaml", SCENARIO)]
    assert main(["scenarios", "--out", str(tmp_path), "--scenarios", *files]) == 2
    assert "expected files of different names, got 'a' twice" in capsys.readouterr().err


def test_course_of_an_exercise_is_that_of_its_knots():
    exercise = Exercise(**EXERCISE)
    assert exercise.course(0.0) == (np.radians(30.0), 0.0, 0.0)
    psi, rate, acceleration = exercise.course(exercise.turning)
    # Amid a move of minimum jerk: half of the way, 15/8 of the mean rate, no acceleration.
    assert psi == pytest.approx(np.radians(45.0)) and rate == pytest.approx(1.875 * np.radians(30.0) / 0.8)
    assert acceleration == pytest.approx(0.0, abs=1e-12)
