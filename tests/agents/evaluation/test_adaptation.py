"""Adaptation to a new patient: returns of windows, regret, windows needed, and the command."""

import csv
import math

import numpy as np
import pytest

from agents.__main__ import main
from agents.evaluation.comparison.evaluate import Plan
from agents.evaluation.episodes.episode import episode, world_of
from agents.evaluation.studies.adaptation import (
    adaptation,
    best_of,
    hindsight_set,
    near_regret,
    near_return,
    parts,
    window_returns,
    windows_of,
)
from agents.policies.baselines import REFERENCE_FREE, policy
from agents.policies.policy import Policy
from dms_core.errors import InputError

NEW = "exo/NewPatient-v0"
SHORT = {"episode_duration": 3.2}
PLAN = Plan("evaluation", 2, 5, (), NEW, SHORT)


class Alone(Policy):
    """What `none` does, as a policy of a user's own."""

    name, title, action_mode = "alone", "alone", "rope_tension"

    def reset(self, env):
        """Nothing."""

    def __call__(self, observation, info):
        """Slack ropes."""
        return np.array([-1.0, -1.0])


def test_parts_are_exact_and_an_ended_episode_gives_nothing_more():
    rewards = [1e16, 1.0, -1e16, 0.1, 0.1, 0.1, 0.1]
    assert parts(rewards, 4, 12) == [1.0, math.fsum([0.1] * 3), 0.1, 0.0]


def test_windows_add_up_to_the_return_of_the_episode():
    for one in (policy("gravity"), Alone()):
        env = world_of(one, PLAN.patient, NEW, **SHORT)
        for found, (seed, _) in zip(window_returns(one, PLAN, PLAN.cases), PLAN.cases, strict=True):
            whole = episode(env, one, seed)
            assert found["seed"] == seed and len(found["windows"]) == 8
            # A sum of eight sums that are each correctly rounded.
            assert math.fsum(found["windows"]) == pytest.approx(whole["measures"]["return"], rel=1e-12)
            assert found["unsafe"] == (whole["event"] is not None)


def test_a_batch_gives_what_one_world_does():
    batch, single = (window_returns(one, PLAN, PLAN.cases) for one in (policy("none"), Alone()))
    # Float32 observations are of no use to either, so that both are the same episodes.
    for a, b in zip(batch, single, strict=True):
        np.testing.assert_allclose(a["windows"], b["windows"], rtol=1e-9, atol=1e-12)
        assert a["unsafe"] == b["unsafe"]


def test_an_episode_that_ends_early():
    narrow = {"reference": {"start_deg": 30.0}, "limits": {"lowest_deg": 19.0, "highest_deg": 40.0}}
    fallen = Plan("evaluation", 1, 7, (), NEW, {**SHORT, **narrow})
    fallen_batch = window_returns(policy("none"), fallen, fallen.cases)
    fallen_single = window_returns(Alone(), fallen, fallen.cases)
    assert fallen_batch[0]["unsafe"] and fallen_single[0]["unsafe"], "an arm that nobody holds drops"
    last = max(k for k, x in enumerate(fallen_batch[0]["windows"]) if x != 0.0)
    assert last < 7 and fallen_batch[0]["windows"][last] < -50.0, "the event is paid for in its own window"
    np.testing.assert_allclose(fallen_batch[0]["windows"], fallen_single[0]["windows"], rtol=1e-9, atol=1e-12)


def known(windows, unsafe=False):
    return [{"seed": k, "windows": list(map(float, row)), "unsafe": unsafe} for k, row in enumerate(windows)]


def test_regret_is_to_the_best_of_each_patient_and_window():
    one, other = known([[1, 5], [2, 2]]), known([[3, 4], [0, 6]])
    best = best_of([one, other])
    np.testing.assert_array_equal(best, [[3, 5], [2, 6]])
    found = adaptation(one, best, 0)
    assert [e.value for e in found.returns] == [1.5, 3.5] and [e.value for e in found.regrets] == [1.0, 2.0]
    assert all(e.low >= 0.0 for e in found.regrets) and found.regrets[0].count == 2
    assert (found.regrets[1].low, found.regrets[1].high) == (0.0, 4.0)
    assert found.unsafe.value == 0.0 and adaptation(known([[0.0, 0.0]], True), np.zeros((1, 2)), 0).unsafe.value == 1.0


def test_windows_needed():
    np.testing.assert_array_equal(
        near_return(np.array([[1, 8, 9.1, 10], [10, 9, 9, 9.0], [-30, -12, -10.9, -10], [0, 0, 0, 0]])), [3, 1, 3, 1]
    )
    # From 20 to 10: at most 11. Where the regret grows none is needed.
    np.testing.assert_array_equal(near_regret(np.array([[20, 12, 11, 10], [5, 6, 7, 8], [0, 0, 0, 0.0]])), [3, 1, 1])
    alike = adaptation(known([[1, 8, 9.1, 10]] * 5), np.full((5, 4), 12.0), 0).return_windows
    assert (alike.value, alike.low, alike.high) == (3.0, 3.0, 3.0), "patients who are all alike"


def test_the_hindsight_set_is_told_nothing():
    one_each, three = hindsight_set(NEW, 1, 0), hindsight_set(NEW, 3, 0)
    assert not any(one.informed for one in three) and len({one.name for one in one_each}) == len(one_each) > 5
    gravity = [one for one in three if one.name == "gravity"]
    assert len(gravity) == 3 and gravity[0].numbers == policy("gravity").numbers


def test_an_environment_with_one_window_is_refused():
    assert windows_of(NEW) == 8
    with pytest.raises(InputError, match="have 1 windows in 450 control periods; expected two or more windows"):
        windows_of("exo/HiddenIntent-v0")


@pytest.fixture
def short(monkeypatch):
    def plan(*given):
        return Plan(*given, SHORT)

    monkeypatch.setattr("agents.commands.studies.adaptation.Plan", plan)


def test_the_command(short, tmp_path, capsys):
    out = tmp_path / "run"
    assert main(["adaptation", "--policy", "none", "--patients", "2", "--out", str(out)]) == 0
    assert sorted(p.name for p in out.iterdir() if p.name[0] != ".") == [
        "adaptation.csv", "adaptation.md", "adaptation.png",
    ]  # fmt: skip
    head, *lines = (out / "adaptation.csv").read_text().splitlines()
    rows = list(csv.DictReader(lines))
    assert head.startswith("# python -m agents adaptation --policy none") and {r["window"] for r in rows} == set(
        "12345678"
    )
    fair = [r for r in rows if r["policy"] != "oracle"]
    assert fair and all(float(r["regret"]) >= 0.0 and float(r["regret_low"]) >= 0.0 for r in fair)
    # The set has one member more than nobody, so that nobody's regret is above 0 somewhere.
    assert any(float(r["regret"]) > 0.0 for r in rows if r["policy"] == "none")
    blind = sum(not kind.informed for kind in REFERENCE_FREE.values())
    assert f"{blind} sets of numbers" in (out / "adaptation.md").read_text()
    assert "windows to nine tenths" in capsys.readouterr().out and not (tmp_path / "run.partial.jsonl").exists()


@pytest.mark.parametrize(
    ("more", "said"),
    [
        (["--tries", "0"], "--tries from 1"),
        (["--env", "exo/HiddenIntent-v0"], "expected two or more windows"),
        (["--env", "exo/ElbowLift-v2"], "hides the patient's plan"),
    ],
)
def test_bad_commands(more, said, tmp_path, capsys):
    assert main(["adaptation", "--policy", "none", "--out", str(tmp_path / "run"), *more]) == 2
    assert said in capsys.readouterr().err and not (tmp_path / "run").exists()
