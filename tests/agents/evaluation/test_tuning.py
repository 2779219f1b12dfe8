"""Tuned numbers: their ranges, who reads them, and a search that finds better ones with the same seed."""

import csv
import inspect

import numpy as np
import pytest

from agents.__main__ import main
from agents.environment import ENVIRONMENT, make, patient_seeds
from agents.evaluation.search.tuning import POPULATION, STREAM, trial, tunable, tune
from agents.policies.assist_as_needed import AssistAsNeeded
from agents.policies.baselines import POLICIES, policy
from agents.policies.lagging_pid import LaggingPid
from agents.policies.tuned import Range, numbers
from dms_core.errors import InputError
from dms_core.files.config_files import configs
from dms_core.files.yaml_text import read_yaml

SHORT = {"episode_duration": 0.6}


def test_places_in_a_range():
    linear, logarithmic = Range(-1.0, 3.0), Range(0.01, 1.0, True)
    assert [linear.at(x) for x in (-0.1, 0.0, 0.5, 1.0, 1.1)] == [-1.0, -1.0, 1.0, 3.0, 3.0]
    assert [logarithmic.at(x) for x in (0.0, 0.5, 1.0)] == [0.01, 0.1, 1.0]


def test_shipped_numbers_are_complete_and_within_their_ranges():
    shipped = read_yaml(configs() / "baselines/baselines.yml")
    assert shipped.keys() == tunable().keys()
    for name, ranges in tunable().items():
        assert shipped[name].keys() == ranges.keys()
        assert all(r.low <= shipped[name][key] <= r.high for key, r in ranges.items())
        policy(name)


def test_shipped_numbers_are_the_best_of_the_table_of_tries():
    shipped = read_yaml(configs() / "baselines/baselines.yml")
    with (configs() / "baselines/baselines_tries.csv").open() as file:
        rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
    for name in tunable():
        best = max((r for r in rows if r["policy"] == name), key=lambda r: float(r["return"]))
        found = dict(pair.split("=") for pair in best["numbers"].split())
        assert {key: float(x) for key, x in found.items()} == shipped[name]


def test_given_numbers_replace_the_tuned_ones():
    used = AssistAsNeeded(memory=2.5)
    assert used.memory == 2.5 and used.gain == numbers("assist_as_needed", AssistAsNeeded.ranges, {})["gain"]
    with pytest.raises(InputError, match="authority = 2.0: expected a number from 0.02 to 1"):
        LaggingPid(authority=2.0)
    with pytest.raises(InputError, match="its numbers are authority, lag_deg, got authority, lag_deg, patience"):
        LaggingPid(patience=1.0)


def test_search_is_repeatable_and_ranked():
    progress = []
    found = tune("pid_yielding", 6, 1, 3, progress=progress.append, **SHORT)
    assert found == tune("pid_yielding", 6, 1, 3, **SHORT)
    assert len(found) == 6 == len(progress)
    returns = [one.measures["return"] for one in found]
    assert returns == sorted(returns, reverse=True) and returns[0] > returns[-1]
    # A try can be had again by its numbers.
    assert trial("pid_yielding", found[0].numbers, POPULATION, patient_seeds(STREAM + 3, 1), SHORT) == found[0]


def test_patients_of_the_search_are_not_those_of_an_evaluation():
    assert not set(patient_seeds(STREAM, 50)) & set(patient_seeds(0, 50))


@pytest.mark.parametrize(
    ("arguments", "said"),
    [(("pid", 4, 1, 0), "nothing to tune"), (("pid_yielding", 1, 1, 0), "tries = 1"),
     (("pid_yielding", 4, 0, 0), "patients = 0"), (("pid_yielding", 4, 1, -1), "seed = -1")],
)  # fmt: skip
def test_mistakes_are_named(arguments, said):
    with pytest.raises(InputError, match=said):
        tune(*arguments)


def test_command_writes_what_the_policies_read(tmp_path, capsys, monkeypatch):
    signature = inspect.signature(tune)
    assert list(signature.parameters)[:4] == ["policy", "tries", "patients", "seed"]
    monkeypatch.setattr("agents.commands.search.tune_baselines.tune", lambda *a, **given: tune(*a, **given, **SHORT))
    assert main(["tune-baselines", "--tries", "2", "--patients", "1", "--out", str(tmp_path)]) == 0
    assert "pid_yielding" in capsys.readouterr().out
    written = read_yaml(tmp_path / "baselines.yml")
    for name, found in written.items():
        POLICIES[name](**found)
    assert written.keys() == tunable().keys()
    lines = (tmp_path / "baselines_tries.csv").read_text().splitlines()
    assert lines[0].startswith("# python -m agents tune-baselines --tries 2") and len(lines) == 2 + 2 * len(tunable())


def test_command_tunes_on_the_population_that_is_named(tmp_path, monkeypatch):
    asked = []

    def seen(*given, **more):
        asked.append(more["population"])
        return tune(*given, **more, **SHORT)

    monkeypatch.setattr("agents.commands.search.tune_baselines.tune", seen)
    command = ["tune-baselines", "--tries", "2", "--patients", "1", "--population", "wide", "--out", str(tmp_path)]
    assert main(command) == 0
    assert asked == ["wide"] * len(tunable())
    head = (tmp_path / "baselines.yml").read_text()
    assert "best mean return on 'wide'" in head and "--population wide" in head


def test_an_unknown_population_is_named():
    with pytest.raises(InputError, match="unknown population 'martians'"):
        tune("pid_yielding", 2, 1, 0, population="martians")


def test_yielding_pid_acts_as_its_numbers_say():
    used = LaggingPid(authority=0.3, lag_deg=2.0)
    env = make(ENVIRONMENT, action_mode="pid_setpoint")
    observation, info = env.reset(seed=0)
    used.reset(env)
    np.testing.assert_allclose(used(observation, info), [-np.radians(2.0) / 0.2, -0.4], rtol=1e-12)
