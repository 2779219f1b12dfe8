"""The gap closed: known values, pairing, reasons, and who plays against whom."""

import json
import math

import numpy as np
import pytest

from agents.__main__ import main
from agents.evaluation.comparison.evaluate import VERSION, evaluate
from agents.evaluation.comparison.gap import GAP, gap_closed, pooled_gap
from agents.evaluation.comparison.opponents import opponent_of, oracle_name, sensors, training_returns, with_opponents
from agents.evaluation.comparison.pooling import pooled
from agents.evaluation.results.evaluation_file import read_evaluation
from agents.evaluation.results.tables import gap_lines, short_table, table_rows, whole_table
from agents.policies.baselines import REFERENCE_FREE, policy
from agents.policies.learned import Description, LearnedPolicy, find_policy
from agents.policies.policy import Policy
from dms_core.errors import InputError
from dms_core.files.config_files import configs

HIDDEN = "exo/HiddenIntent-v0"
SHORT = {"episode_duration": 0.4}


def episodes(returns):
    return [{"seed": k, "measures": {"return": float(x), "unsafe": 0.0}} for k, x in enumerate(returns)]


def sample(n=40, seed=0):
    """Returns of opponent and oracle on patients who differ much more than policies do."""
    generator = np.random.default_rng(seed)
    low = generator.normal(0.0, 500.0, n)
    return low, low + generator.uniform(80.0, 120.0, n)


def test_opponent_is_zero_and_oracle_one():
    low, high = sample()
    for returns, expected in ((low, 0.0), (high, 1.0)):
        found = gap_closed(episodes(returns), episodes(low), episodes(high), 0)
        # Round-off of sums.
        assert found["value"] == pytest.approx(expected, abs=1e-12) and found["reason"] is None
        assert found["low"] == pytest.approx(expected, abs=1e-9) == found["high"]


def test_half_the_way_is_a_half_whatever_patients_do():
    low, high = sample()
    noise = np.random.default_rng(1).normal(0.0, 20.0, len(low))
    found = gap_closed(episodes(0.5 * (low + high) + noise), episodes(low), episodes(high), 0)
    assert found["low"] < 0.5 + noise.mean() / np.mean(high - low) < found["high"]
    # Pairing: patients differ by 500, and the interval is narrow.
    assert found["high"] - found["low"] < 0.2


def test_nothing_is_clipped():
    low, high = sample()
    worse, better = (
        gap_closed(episodes(x), episodes(low), episodes(high), 0) for x in (2 * low - high, 2 * high - low)
    )
    assert worse["value"] == pytest.approx(-1.0) and better["value"] == pytest.approx(2.0)


@pytest.mark.parametrize("above", [0.0, -0.2, 0.2])
def test_without_a_gap_there_is_a_reason(above):
    low, _ = sample()
    high = low + np.random.default_rng(2).normal(above, 10.0, len(low))
    found = gap_closed(episodes(low), episodes(low), episodes(high), 0)
    assert math.isnan(found["value"]) and math.isnan(found["low"]) and "holds 0" in found["reason"]


def test_an_oracle_that_is_surely_worse_has_a_gap_too():
    low, high = sample()
    found = gap_closed(episodes(low), episodes(high), episodes(low), 0)
    assert found["reason"] is None and found["value"] == pytest.approx(1.0)


def test_trainings_are_resampled():
    low, high = sample()
    # Two trainings, one that closes nothing and one that closes all: nobody knows what a third would do.
    two = [*episodes(low), *episodes(high)]
    found = gap_closed(two, episodes(low), episodes(high), 0, 2)
    assert found["value"] == pytest.approx(0.5)
    assert found["low"] == pytest.approx(0.0, abs=1e-9) and found["high"] == pytest.approx(1.0)


class WithImu(Policy):
    title, action_mode, observation = "with an inertial sensor", "assist_moment", ("device.angle", "imu.gyro")

    def reset(self, env):
        self.shown = []

    def __call__(self, observation, info):
        self.shown.append(info)
        return np.array([0.1, -1.0])


class Nosy(WithImu):
    title, observation = "sees the plan", ("device", "privileged.intent")


class Told(Nosy):
    informed = True


def test_the_opponent_has_the_same_sensors_and_the_best_training_return():
    returns = training_returns()
    device = [
        n for n, k in REFERENCE_FREE.items() if not k.informed and sensors(k.observation) <= {"device", "estimated"}
    ]
    with_emg = [*device, "emg_proportional"]
    for who, among in (("gravity", device), ("oracle", device), ("emg_proportional", with_emg)):
        assert opponent_of(policy(who)) == max(among, key=returns.__getitem__)
    own = WithImu()
    own.__dict__["name"] = "own"
    assert opponent_of(own) == opponent_of(policy("gravity"))
    assert oracle_name() == "oracle"
    # Nobody is added where nothing is hidden, and nobody twice.
    assert with_opponents([policy("none")], "exo/ElbowLift-v2")[1:] == []
    names = [one.name for one in with_opponents([policy("oracle"), policy("none")], HIDDEN)]
    assert names[:2] == ["oracle", "none"] and len(set(names)) == len(names) == 3


def test_every_policy_has_a_training_return():
    assert training_returns().keys() >= {"none", *(n for n, kind in REFERENCE_FREE.items() if kind.ranges)}


def test_an_evaluation_names_opponent_and_oracle(tmp_path, capsys):
    out = tmp_path / "out"
    command = ["evaluate", "--env", HIDDEN, "--policy", f"{__name__}:WithImu", "--patients", "2", "--out", str(out)]
    assert main(command) == 0
    assert "gap closed" in (said := capsys.readouterr().out) and "Gap closed: from" in said
    found = read_evaluation(out / "evaluation.json")
    assert found["version"] == VERSION == 2
    opponent = opponent_of(policy("gravity"))
    assert list(found["policies"]) == [f"{__name__}:WithImu", opponent, "oracle"]
    for name, one in found["policies"].items():
        for kind in ("summary", "summary_able"):
            gap = one[kind][GAP]
            assert (gap["opponent"], gap["oracle"], gap["count"]) == (opponent, "oracle", 2)
        assert one.get("informed", False) == (name == "oracle")
        assert "opposing_power_W" in one["summary"]
    raw = json.loads((out / "evaluation.json").read_text())
    assert raw["policies"][opponent]["summary"][GAP]["value"] in (0.0, None)
    assert "gap closed" in (out / "evaluation.md").read_text()


def test_no_gap_is_said_with_its_reason_once():
    found = evaluate([policy("none")], "evaluation", 2, 0, environment=HIDDEN, **SHORT)
    for p in found["policies"].values():
        p["summary"][GAP] |= {"value": math.nan, "reason": "nobody knows"}
    first, second = gap_lines(found)
    assert (
        first.startswith("Gap closed: from ") and second == f"No gap for {', '.join(found['policies'])}: nobody knows."
    )
    assert "gap closed" in short_table(found) and "| gap closed | - |" in "\n".join(whole_table(found))


def test_differences_are_to_who_was_the_best_in_training_not_here():
    found = evaluate([policy("none"), policy("gravity")], "evaluation", 2, 0, environment=HIDDEN, **SHORT)
    opponent = opponent_of(policy("none"))
    for name, p in found["policies"].items():
        p["summary"]["return"]["value"] = 9.0 if name == "gravity" else 1.0
    assert opponent != "gravity"
    said = [row[0] for row in table_rows(found) if row[0].startswith("mean difference to")]
    assert said == [f"mean difference to {name}, patient by patient" for name in ("none", opponent)]


def test_trainings_together_close_a_gap():
    low, high = sample(6)
    gap = {"opponent": "low", "oracle": "high", "value": 0.0, "low": 0.0, "high": 0.0, "count": 6, "reason": None}

    def entry(title, returns):
        return {"title": title, "training": "a", "episodes": episodes(returns), "summary": {GAP: gap},
                "summary_able": {GAP: gap}}  # fmt: skip

    policies = {"low": entry("low", low), "high": entry("high", high), "1": entry("PPO, seed 1", low),
                "2": entry("PPO, seed 2", high)}  # fmt: skip
    (together,) = pooled(policies, 0).values()
    assert together["summary"][GAP]["value"] == pytest.approx(0.5) == together["summary_able"][GAP]["value"]
    # Without the opponent's episodes nothing is known.
    assert pooled_gap([policies["1"], policies["2"]], {"high": policies["high"]}, "summary", list, 0) is None


def test_a_policy_that_sees_the_plan_is_refused(tmp_path, capsys):
    for where in ("evaluate", "video"):
        one, many = ("--out", str(tmp_path / "film.gif")), ("--patients", "1", "--out", str(tmp_path / "out"))
        command = [where, "--env", HIDDEN, "--policy", f"{__name__}:Nosy", *(many if where == "evaluate" else one)]
        assert main(command) == 2
        said = capsys.readouterr().err
        assert "sees the group 'privileged', which reveals the plan that HiddenIntentTask hides" in said
    assert evaluate([named(Told)], "evaluation", 1, 0, environment=HIDDEN, **SHORT)["policies"]["Told"]["informed"]


def named(kind):
    one = kind()
    one.__dict__["name"] = kind.__name__
    return one


def test_no_info_tells_the_plan():
    one = named(WithImu)
    evaluate([one], "evaluation", 1, 0, environment=HIDDEN, **SHORT)
    assert one.shown and not any(one.shown)


def test_a_policy_that_was_trained_for_another_task_is_refused():
    with pytest.raises(InputError, match="'learned' was trained for the task LiftTask, and this is HiddenIntentTask"):
        evaluate([find_policy("learned")], "evaluation", 1, 0, environment=HIDDEN, **SHORT)


def test_who_is_informed_is_no_part_of_what_trainings_have_in_common():
    folder = configs() / "policies" / "learned"
    facts = json.loads((folder / "policy.json").read_text())
    assert Description(**facts | {"informed": True}).common == Description(**facts).common
    one = LearnedPolicy.load(folder)
    assert one.informed is False
    told = LearnedPolicy(one.description.changed(informed=True), one.arrays)
    assert told.informed is True
