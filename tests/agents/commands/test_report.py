"""Reports: what is drawn is what was measured, and a wrong path is one sentence."""

import json
import math

import numpy as np
import pytest

pytest.importorskip("matplotlib")

from agents.__main__ import main
from agents.commands.pictures.report import _again
from agents.commands.pictures.report_input import collected, grouped
from agents.evaluation.comparison.by_patient import by_patient
from agents.evaluation.comparison.evaluate import evaluate
from agents.evaluation.comparison.pooling import pooled
from agents.evaluation.comparison.statistics import interquartile_mean
from agents.evaluation.episodes.time_course import time_course
from agents.evaluation.figures.report_figures import on_common_steps
from agents.policies.baselines import policy
from dms_core.files.outputs import MANIFEST
from tests.agents.tiny import config_file

PICTURES = {"learning_curves.png", "pareto.png", "patients.png", "worst_patient.png"}


@pytest.fixture(scope="module")
def evaluated(tmp_path_factory):
    """An evaluation of two baselines on two patients."""
    out = tmp_path_factory.mktemp("evaluation")
    assert main(["evaluate", "--policy", "pid", "none", "--patients", "2", "--out", str(out)]) == 0
    return out


def test_curves_of_seeds_meet_on_common_steps():
    def curve(*pairs):
        return [{"steps": s, "return": r} for s, r in pairs]

    steps, values = on_common_steps(
        [curve((0, 0.0), (10, 1.0), (20, 2.0)), curve((0, 4.0), (5, None), (15, 1.0))], "return"
    )
    assert steps.tolist() == [0.0, 10.0, 15.0]
    # The second curve's gap is bridged from 4 at 0 to 1 at 15.
    np.testing.assert_allclose(values, [[0.0, 1.0, 1.5], [4.0, 2.0, 1.0]], rtol=1e-12)


def test_a_course_is_the_episode_that_was_measured(evaluated):
    found = json.loads((evaluated / "evaluation.json").read_text())
    one = found["policies"]["none"]["episodes"][1]
    again = _again(policy("none"), one, found)
    error = np.degrees(again.columns["elbow_angle.angle"] - again.columns["reference"])
    assert math.sqrt(np.mean(error**2)) == pytest.approx(one["measures"]["tracking_rms_deg"], rel=1e-12)
    assert again.event == one["event"] and again.patient == one["patient"]


def test_a_course_of_an_unknown_population_keeps_patient_load_and_repetition():
    found = evaluate([policy("pid")], {"base": "stroke_mild", "title": "mine", "fields": {"strength": 0.7}}, 1, 0)
    one = found["policies"]["pid"]["episodes"][0]
    again = _again(policy("pid"), one, found)
    assert again.patient == pytest.approx(one["patient"]) and again.load == one["load"]
    assert np.degrees(again.columns["reference"].max()) == pytest.approx(
        one["reference"]["start_deg"] + one["reference"]["amplitude_deg"], abs=0.01
    )


def test_a_course_has_the_load_that_was_lifted():
    found = evaluate([policy("pid")], "stroke_mild", 1, 0, loads=(0.6, 1.4))
    for one in found["policies"]["pid"]["episodes"]:
        again = _again(policy("pid"), one, found)
        assert again.load == one["load"] and again.patient == one["patient"]


def test_same_seed_is_the_same_patient_for_all_policies():
    one, other = (time_course(policy(n), "stroke_severe", 3) for n in ("pid", "none"))
    assert one.patient == other.patient and one.load == other.load and one.columns["time"][-1] == pytest.approx(6.0)


def test_command_writes_all_pictures_and_tables(evaluated, tmp_path, capsys):
    pytest.importorskip("sb3_contrib")
    runs = [tmp_path / f"seed{seed}" for seed in (0, 1)]
    for seed, run in enumerate(runs):
        # Whole episodes: the policy has to fit the environment of an evaluation, not only that of its training.
        path = config_file(tmp_path, env_kwargs={"patient": "stroke_mild"})
        assert main(["train", "--config", str(path), "--seed", str(seed), "--out", str(run)]) == 0
    out = tmp_path / "report"
    assert main(["report", *map(str, runs), str(evaluated), "--out", str(out)]) == 0
    assert {p.name for p in out.iterdir()} == PICTURES | {"report.md", MANIFEST}
    text = (out / "report.md").read_text()
    assert "seed0 | ppo | 0" in text and "seed1 | ppo | 1" in text and "Worst patient of PID" in text
    assert all(f"({name})" in text for name in PICTURES)
    trainings, _ = collected(runs)
    (group,) = grouped(trainings)
    assert len(group.curves) == 2


def test_evaluations_of_the_same_patients_are_one(evaluated, tmp_path):
    arguments = ["evaluate", "--policy", "assist_as_needed", "--patients", "2", "--out", str(tmp_path)]
    assert main(arguments) == 0
    _, (one,) = collected([evaluated, tmp_path / "evaluation.json"])
    assert list(one["policies"]) == ["pid", "none", "assist_as_needed"]
    # Every difference is to the first policy of all, not of its own file.
    for name, found in one["policies"].items():
        means = [found["summary"]["return"], one["policies"]["pid"]["summary"]["return"]]
        assert found["difference"]["return"]["value"] == pytest.approx(means[0]["value"] - means[1]["value"]), name


def test_trainings_that_differ_in_the_seed_are_pooled(evaluated):
    found = json.loads((evaluated / "evaluation.json").read_text())["policies"]
    twins = {f"run{k}": {**found[name], "title": f"PPO, seed {k}"} for k, name in enumerate(("pid", "none"))}
    assert pooled(found | {"run0": twins["run0"]}, 0) == {}
    # Another network, or the same seed twice, is no further training of the same.
    assert pooled(found | {"run0": twins["run0"], "run1": twins["run1"] | {"training": "other"}}, 0) == {}
    again = {"run0": twins["run0"], "run1": twins["run1"] | {"title": "PPO, seed 0 (run1)"}}
    assert pooled(found | again, 0) == {}
    both = pooled(found | twins, 0)
    assert list(both) == ["PPO, 2 seeds"] and both["PPO, 2 seeds"]["trainings"] == 2
    one, other = (by_patient(found[name]["episodes"], "return") for name in ("pid", "none"))
    value = both["PPO, 2 seeds"]["summary"]["return"]["value"]
    assert value == pytest.approx(interquartile_mean((one + other) / 2))


def test_evaluations_with_other_loads_stay_apart(evaluated, tmp_path):
    assert main(["evaluate", "--policy", "pid", "--patients", "2", "--loads", "1.0", "--out", str(tmp_path)]) == 0
    _, found = collected([evaluated, tmp_path])
    assert [one["loads"] for one in found] == [[], [1.0]]


@pytest.mark.parametrize(
    "said, arguments",
    [
        ("is neither the folder of a training nor an evaluation", ["nowhere"]),
        ("is no JSON", ["{folder}/evaluation.json"]),
        ("expected folders of trainings or evaluation.json files", []),
        ("expected two different names", ["{evaluated}", "--policies", "pid"]),
        ("unknown population", ["{evaluated}", "--mild", "martians"]),
    ],
)
def test_mistakes_are_one_message(said, arguments, evaluated, tmp_path, capsys):
    (tmp_path / "evaluation.json").write_text("{")
    given = [a.format(folder=tmp_path, evaluated=evaluated) for a in arguments]
    assert main(["report", *given, "--out", str(tmp_path / "out")]) == 2
    errors = capsys.readouterr().err
    assert said in errors and errors.startswith("error: ") and errors.count("\n") == 1
