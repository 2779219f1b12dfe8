"""What users made with version 0.1.0 loads, goes on and is evaluated (before_the_move/README.md)."""

import json
import shutil
import subprocess
import sys
import tarfile
from pathlib import Path

import numpy as np
import pytest

from agents.__main__ import main
from agents.environment import ENVIRONMENT
from agents.evaluation.comparison.evaluate import evaluate
from agents.policies.learned import find_policy
from agents.training.settings.config import Config
from dms_core.errors import ModelWarning

FILES = Path(__file__).with_name("before_the_move")
ALGORITHMS = ("ppo", "sac", "tqc", "recurrent_ppo")
ROOT = Path(__file__).parents[2]


@pytest.fixture
def trainings(tmp_path):
    """Folders of the trainings, to be written to."""
    with tarfile.open(FILES / "trainings.tar.xz") as archive:
        archive.extractall(tmp_path, filter="data")
    return tmp_path


@pytest.mark.parametrize("algorithm", ALGORITHMS)
def test_configurations_are_read(algorithm):
    config = Config.read(FILES / f"{algorithm}.yml")
    assert config.environment == ENVIRONMENT and config.training.algorithm == algorithm
    if algorithm == "ppo":
        t = config.training
        assert (t.traces, t.hold, t.start, t.against) == ((0.1, 1.0), 2, (-0.05, 0.9), (-0.05, 1.0))


@pytest.mark.parametrize("algorithm", ALGORITHMS)
def test_trainings_go_on(algorithm, trainings, capsys):
    pytest.importorskip("sb3_contrib")
    folder = trainings / algorithm
    before = json.loads((folder / "evaluations.json").read_text())
    if algorithm == "ppo":
        # Its critic saw what is privileged, and patients have further traits since then.
        assert main(["train", "--resume", str(folder), "--set", "n_timesteps=128"]) == 2
        assert "other channels than the one that a training began with" in capsys.readouterr().err
        return
    assert main(["train", "--resume", str(folder), "--set", "n_timesteps=128"]) == 0
    curve = json.loads((folder / "evaluations.json").read_text())
    assert curve[: len(before)] == before and curve[-1]["steps"] == 128
    assert main(["export", str(folder), "--last", "--no-onnx", "--out", str(trainings / "out")]) == 0


@pytest.mark.parametrize("name", ["policy", "policy_lstm"])
def test_policies_act(name):
    with pytest.warns(ModelWarning, match=f"{name}' is of format 1.* export .*{name} --out"):
        one = find_policy(str(FILES / name))
    assert one.description.env_kwargs["patient"] == "stroke_mild"
    observation = np.random.default_rng(0).normal(size=12).astype(np.float32)
    assert np.abs(one.network(observation)).max() <= 1.0


def test_a_policy_from_a_training_and_a_population_file_are_evaluated(trainings, tmp_path):
    one = find_policy(str(trainings / "ppo"))
    found = evaluate([one], str(FILES / "population.yaml"), 1, 0, episode_duration=0.4)
    assert found["population"] == "weak and forgetful"
    (episode,) = found["policies"][one.name]["episodes"]
    assert episode["patient"]["slacking_rate"] == 0.6 and 0.5 <= episode["patient"]["strength"] <= 0.8


@pytest.mark.slow
def test_a_report_takes_evaluations_and_trainings(trainings, tmp_path, monkeypatch):
    pytest.importorskip("matplotlib")
    pytest.importorskip("sb3_contrib")
    shutil.copytree(FILES / "policy", tmp_path / "policy", dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)
    assert main(["report", str(FILES / "evaluation.json"), "ppo", "sac", "--out", "out"]) == 0
    text = (tmp_path / "out" / "report.md").read_text()
    assert "| ppo | ppo | 0 |" in text and "weak and forgetful" in text and "Worst patient" in text


def test_old_imports_work_with_a_warning():
    pytest.importorskip("sb3_contrib")
    names = {
        "learned": "policies.learned",
        "train": "training.run",
        "evaluate": "evaluation.comparison.evaluate",
        "evaluation.evaluate": "evaluation.comparison.evaluate",
        "training.config": "training.settings.config",
        "commands.video": "commands.pictures.video",
        "traces": "training.wrappers.low_pass",
        "rllib": "distributed.rllib",
    }
    code = (
        "import importlib, warnings\n"
        f"for old, new in {names}.items():\n"
        "    warnings.simplefilter('error', FutureWarning)\n"
        "    try: importlib.import_module('agents.' + old)\n"
        "    except FutureWarning as warning: print(warning)\n"
        "    warnings.simplefilter('ignore')\n"
        "    print(importlib.import_module('agents.' + old) is importlib.import_module('agents.' + new))"
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    said = [[f"'agents.{old}' is now 'agents.{new}'; import it by that name.", "True"] for old, new in names.items()]
    assert done.stdout.splitlines() == sum(said, [])


def test_a_module_that_moved_within_its_folder_comes_from_there():
    with pytest.warns(FutureWarning, match="'agents.evaluation.figure' is now 'agents.evaluation.figures.figure'"):
        from agents.evaluation import figure
    assert figure.__name__ == "agents.evaluation.figures.figure"


def test_every_old_module_is_somewhere():
    from importlib.util import find_spec

    from agents.old_names import MOVED

    for new in MOVED.values():
        assert find_spec(f"agents.{new}") is not None, new


@pytest.mark.parametrize(
    "module, name, said",
    [
        ("agents.policies.lagging_pid", "YieldingPid", "LaggingPid"),
        ("agents.training.wrappers.action_repeat", "Held", "ActionRepeat"),
        ("agents.evaluation.episodes.time_course", "course", "time_course"),
        ("agents.export", "from_zip", "agents.export.model_zip.from_zip"),
    ],
)
def test_names_that_are_gone_say_what_replaces_them(module, name, said):
    import importlib

    pytest.importorskip("stable_baselines3")
    with pytest.raises(ImportError, match=f"It is now {said}"):
        getattr(importlib.import_module(module), name)


def test_the_module_of_the_upper_bound_names_the_command():
    done = subprocess.run([sys.executable, "-m", "agents.ceiling"], cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 1
    assert done.stderr == "'python -m agents.ceiling' is now 'python -m agents upper-bound', with the same options.\n"
