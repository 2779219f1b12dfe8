"""Evaluation, training and video in an environment that is not the default one: what cannot be measured is said."""

import json

import numpy as np
import pytest

from agents.__main__ import main
from agents.evaluation.comparison.evaluate import evaluate
from agents.evaluation.episodes.measures import MEASURES
from agents.evaluation.results.tables import left_out_lines, short_table, whole_table
from agents.policies.baselines import policy
from tests.agents import other_environments  # noqa: F401
from tests.agents.tiny import config_file

BLIND = "tests/NoReference-v0"
ALWAYS = {"return", "unsafe", "solver_failures", "length_s"}
NEED_MORE = {
    "tracking_rms_deg", "tracking_peak_deg", "device_work_share", "patient_work_share", "smoothness_sparc",
}  # fmt: skip


def test_measures_without_readings_are_left_out_and_named():
    found = evaluate([policy("none"), policy("pid")], "stroke_mild", 2, 0, environment=BLIND, episode_duration=0.4)
    assert found["environment"] == BLIND and set(found["left_out"]) == NEED_MORE
    usual = {m.name for m in MEASURES if not m.special}
    for p in found["policies"].values():
        assert set(p["summary"]) == usual - NEED_MORE | {f"reward.{t}" for t in TERMS}
        assert set(p["difference"]) == {"return", "peak_reaction_N"}
    (line,) = left_out_lines(found)
    assert "tracking, rms" in line and f"{BLIND} has no reading" in line and "elbow_angle.rate" in line
    assert line in whole_table(found) and "tracking" not in short_table(found)


TERMS = ("tracking", "assistance", "smoothness", "reaction", "unsafe")


def test_reward_terms_add_up_to_the_return():
    found = evaluate([policy("none")], "stroke_mild", 2, 0, episode_duration=0.4)
    assert found["left_out"] == {} and left_out_lines(found) == []
    for e in found["policies"]["none"]["episodes"]:
        m = e["measures"]
        # The same 20 numbers summed in another order.
        assert sum(m[f"reward.{t}"] for t in TERMS) == pytest.approx(m["return"], rel=1e-12)
        assert ALWAYS <= m.keys() and m["length_s"] == pytest.approx(0.4) and m["solver_failures"] == 0.0


def test_a_baseline_that_the_environment_does_not_allow_is_one_message(tmp_path, capsys):
    arguments = ["--policy", "pid", "--env", "tests/Nothing-v0", "--out", str(tmp_path)]
    assert main(["evaluate", *arguments]) == 2
    assert "environment 'tests/Nothing-v0' is not registered" in capsys.readouterr().err


def test_commands_take_an_environment_and_a_device(tmp_path, capsys):
    pytest.importorskip("matplotlib")
    device = json.dumps({"hinge_damping": 0.5})
    options = ["--policy", "pid", "--patients", "1", "--population", "stroke_mild"]
    returns = []
    for k, more in enumerate(([], ["--exoskeleton", device], ["--exoskeleton", "elbow"], ["--env", BLIND])):
        assert main(["evaluate", *options, *more, "--out", str(tmp_path / str(k))]) == 0
        found = json.loads((tmp_path / str(k) / "evaluation.json").read_text())
        returns.append(found["policies"]["pid"]["episodes"][0]["measures"]["return"])
    assert returns[0] == returns[2] == returns[3] != returns[1]
    assert "Left out: tracking, rms" in capsys.readouterr().out
    assert main(["report", str(tmp_path / "3"), "--out", str(tmp_path / "report")]) == 0
    text = (tmp_path / "report" / "report.md").read_text()
    assert "Left out" in text and "Worst patient of PID" in text and "pareto" not in text


@pytest.mark.parametrize(
    "text, said",
    [
        ("{bad", "expected a name, a YAML file or JSON"),
        ("[1]", "expected a mapping"),
        ("wings", "exoskeleton = 'wings'"),
    ],
)
def test_devices_that_are_none_are_named(text, said, tmp_path, capsys):
    assert main(["evaluate", "--policy", "pid", "--exoskeleton", text, "--out", str(tmp_path)]) == 2
    errors = capsys.readouterr().err
    assert said in errors and errors.count("\n") == 1


def test_a_training_in_another_environment(tmp_path):
    pytest.importorskip("sb3_contrib")
    from agents.policies.learned import find_policy
    from agents.training.files.run_folder import read_record

    path, out = config_file(tmp_path), tmp_path / "run"
    path.write_text(
        path.read_text().replace("exo/ElbowLift", "tests/Light").replace("-v0", "-v2").replace("-v1", "-v2")
    )
    assert main(["train", "--config", str(path), "--env", "tests/Light-v2", "--out", str(out)]) == 0
    assert main(["train", "--resume", str(out), "--set", "n_timesteps=160"]) == 0
    assert read_record(out)["environment"] == "tests/Light-v2"
    learned = find_policy(str(out))
    assert learned.description.environment == "tests/Light-v2"
    found = evaluate([learned], "stroke_mild", 1, 0, environment="tests/Light-v2", episode_duration=0.4)
    assert found["policies"][learned.name]["episodes"][0]["load"] == 0.6


def test_actions_of_another_length_are_refused(tmp_path, capsys):
    pytest.importorskip("sb3_contrib")
    for key in ("start", "against"):
        path = config_file(tmp_path, training={key: [0.0, 0.1, 0.2]})
        assert main(["train", "--config", str(path), "--out", str(tmp_path / key)]) == 2
        assert "expected 2 numbers" in capsys.readouterr().err


def test_films_and_tuning_take_an_environment_and_a_device():
    from agents.commands.pictures.video import Stage
    from agents.evaluation.search.tuning import tune

    pytest.importorskip("pygame")
    stage = Stage(policy("pid"), "stroke_mild", 0, "tests/Light-v2", exoskeleton={"hinge_damping": 0.5})
    assert stage.playing.drawn["load"] == 0.6
    stage.env.close()
    settings = {"episode_duration": 0.2, "exoskeleton": {"hinge_damping": 0.5}}
    tried = tune("pid_yielding", 2, 1, 0, environment=BLIND, **settings)
    assert set(tried[0].measures) == {"return", "peak_reaction_N", "unsafe"}
    assert np.isfinite(list(tried[0].measures.values())).all()
