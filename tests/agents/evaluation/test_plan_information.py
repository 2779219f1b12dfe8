"""How much of the plan sensors show: parts of tests/benchmarks/plan/plan_information.py, and all at a tiny size."""

import csv

import numpy as np
import pytest

pytest.importorskip("sb3_contrib")

import torch

from agents.environment import patient_seeds
from tests.benchmarks.plan import plan_information
from tests.benchmarks.plan.believer import Believer
from tests.benchmarks.plan.plan_episodes import EVERY, NOBODY, TARGETS, Episodes, limits_of, record
from tests.benchmarks.plan.plan_estimator import PlanEstimator, Schooling, tell, train
from tests.benchmarks.plan.plan_information import COLUMNS, LIMIT_COLUMNS, TEST_SEED, elbow, places_of

SEEN, PLAN = 3, len(TARGETS)
ROUND_OFF = 1e-4
"""Of single precision, over the steps of a sequence whose values are of the order of 1."""


@pytest.fixture(scope="module")
def unhelped():
    return record("evaluation", patient_seeds(TEST_SEED, 8), [NOBODY])


def read(path):
    lines = path.read_text().splitlines()
    assert lines[0].startswith("# python ") and "--runs" in lines[0]
    return list(csv.DictReader(x for x in lines if not x.startswith("#")))


def test_tables_and_what_is_kept(tmp_path, monkeypatch, unhelped):
    sets = ["device", "and commands before their ceiling"]
    arguments = ["--runs", str(tmp_path / "runs"), "--sets", *sets, "--episodes", "10", "--patients", "8"]
    arguments += ["--epochs", "1", "--out", str(tmp_path / "table.csv")]
    monkeypatch.setattr("sys.argv", ["plan_information.py", *arguments])
    assert plan_information.main(arguments) == 0
    rows, limits = read(tmp_path / "table.csv"), read(tmp_path / "table_limits.csv")
    assert tuple(rows[0]) == COLUMNS and tuple(limits[0]) == LIMIT_COLUMNS
    assert [(x["helped_by"], x["seen"]) for x in rows[2:4]] == [("nobody", name) for name in sets]
    error = np.degrees(unhelped.seen[..., elbow()] - unhelped.plan[..., 0])[unhelped.running]
    assert float(rows[1]["rms_now_deg"]) == pytest.approx(np.sqrt(np.mean(error**2)), rel=1e-3)  # four digits
    assert float(limits[0]["return"]) == pytest.approx(unhelped.returns.mean(), rel=1e-3)
    monkeypatch.setattr(plan_information, "record", None)
    monkeypatch.setattr(plan_information, "train", None)
    assert plan_information.main(arguments) == 0
    assert read(tmp_path / "table.csv") == rows


def test_what_is_recorded(unhelped):
    """The plan is that of the channels; a muscle is full where weakness binds, and its excitation is its ceiling."""
    (intent,), (preview, *_) = places_of(["privileged.intent"]), places_of(["privileged.preview"])
    on = unhelped.running
    assert np.abs(unhelped.plan[..., 0] - unhelped.seen[..., intent])[on].max() < ROUND_OFF
    ahead = TARGETS.index("intent in 0.1 s")
    assert np.abs(unhelped.plan[..., ahead] - unhelped.seen[..., preview])[on].max() < ROUND_OFF
    most = unhelped.seen[:, 0, places_of(["privileged.maximum_activation_flexors"])[0]]
    full = [float(x[o][:, 3:].mean()) for x, o in zip(unhelped.full, on, strict=True)]
    # 0.17 of an average man's longest flexor holds 1.25 kg.
    assert min(x for x, y in zip(full, most, strict=True) if y < 0.1) > 0.5
    assert max(x for x, y in zip(full, most, strict=True) if y > 0.7) < 0.2
    assert (unhelped.steady >= unhelped.full).all()


def test_limits_of_wanted_activations():
    """Where the flexors are wanted beyond what they can give, extensors that only co-contract stay as they are, too."""
    flexes = np.array([False, True])
    cases = {(0.5, 0.0): (True, True), (0.1, 0.0): (False, False), (0.5, 0.1): (False, True)}
    for (flexor, extensor), steady in cases.items():
        intents, most = np.array([[extensor, flexor]]), np.array([[0.3, 0.3]])
        _, _, found = limits_of(intents, most, np.array([[0.2]]), np.zeros((1, 2)), flexes)
        assert tuple(found[0]) == steady


def shown(rng, n=60, times=20):
    """Episodes whose first component shows the plan, as it is, one row late."""
    plan = np.cumsum(rng.standard_normal((n, times, PLAN)), axis=1).astype(np.float32)
    seen = rng.standard_normal((n, times, SEEN)).astype(np.float32)
    seen[:, 1:, 0] = plan[:, :-1, 0]
    on, none = np.ones((n, times), bool), np.zeros((n, times, 1), np.float32)
    return Episodes(seen, plan, none, none > 0, none > 0, on, np.zeros(n))


def test_an_estimator_learns_what_is_shown_and_says_how_sure_it_is():
    rng = np.random.default_rng(0)
    learned, test = shown(rng), shown(rng)
    how = Schooling(epochs=40, batch=20, rate=1e-2, width=12)
    errors = {}
    for places in ((0,), (1,)):
        mean, deviation = tell(train(learned, places, how), test)
        errors[places] = np.sqrt(np.mean((mean - test.plan)[:, 5:, 0] ** 2))
        # Said and real deviation agree within a half where the plan is shown; few episodes teach no more.
        assert 0.5 < np.sqrt(np.mean(deviation[:, 5:, 0] ** 2)) / errors[places] < 1.5
    # One row late is a step of deviation 1; not shown, the plan wanders off as the root of the time.
    assert errors[0,] < 1.7 < 2.5 < errors[1,]


def test_acting_estimates_are_those_of_training():
    """Step by step, in worlds that begin anew at times of their own, the same numbers as over whole sequences."""
    torch.manual_seed(0)
    one, rng = PlanEstimator([2, 0], width=5), np.random.default_rng(1)
    seen = rng.standard_normal((3, 12 * EVERY, SEEN)).astype(np.float32)
    believer, begins = Believer(one), 5
    believer.begin()
    told = [believer.believe(x, np.array([False, k == begins, False])).mean for k, x in enumerate(seen.swapaxes(0, 1))]
    told = np.array(told).swapaxes(0, 1)
    for world, start in ((0, 0), (1, begins), (2, 0)):
        rows = seen[world : world + 1, start::EVERY]
        mean, _ = one.told(*(x.detach() for x in one(torch.as_tensor(rows[..., [2, 0]]))[:2]))
        assert np.abs(told[world, start::EVERY] - mean[0]).max() < ROUND_OFF
        assert np.abs(told[world, start + 1 :: EVERY][:3] - mean[0, :3]).max() < ROUND_OFF
