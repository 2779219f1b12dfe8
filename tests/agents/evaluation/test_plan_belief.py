"""Policies that act on an estimate of the plan: tests/benchmarks/plan/plan_belief.py at a tiny size."""

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest

pytest.importorskip("sb3_contrib")

import torch

from agents.environment import HIDDEN_PLAN, patient_seeds
from agents.policies.network import Architecture, Network
from agents.training.worlds import training_worlds
from agents.training.wrappers.low_pass import kept_shares
from tests.benchmarks.plan import plan_belief
from tests.benchmarks.plan.belief_learning import HIDDEN, TOLD, BeliefLearning, BeliefObservations, shown
from tests.benchmarks.plan.believer import Believer
from tests.benchmarks.plan.estimate_pd import RANGES, EstimatePd
from tests.benchmarks.plan.plan_episodes import EVERY, TARGETS, record
from tests.benchmarks.plan.plan_estimator import PlanEstimator
from tests.benchmarks.plan.plan_information import places_of

SETTINGS = {
    "patient": "stroke_mild", "episode_duration": 0.4, "action_mode": "assist_moment",
    "observation": ["device", "privileged"],
}  # fmt: skip
PATIENTS = 4
BELIEF = 2 * len(TARGETS) + HIDDEN


@pytest.fixture(scope="module")
def estimator():
    torch.manual_seed(0)
    return PlanEstimator(places_of(["device"]), width=HIDDEN)


def test_worlds_show_device_then_belief_then_all_else(estimator):
    """The belief is that of an estimator that begins anew with each episode, and of its own world alone."""
    device = len(estimator.places)
    plain, worlds = (training_worlds(SETTINGS, 2, 5, None, HIDDEN_PLAN) for _ in range(2))
    worlds = BeliefObservations(worlds, estimator, device)
    alone = Believer(estimator)
    alone.begin()
    rng, begun = np.random.default_rng(0), None
    theirs, mine = plain.reset(), worlds.reset()
    for k in range(45):
        held = shown(alone.believe(theirs, begun))
        assert np.array_equal(mine[:, :device], theirs[:, :device])
        assert np.allclose(mine[:, device : device + BELIEF], held, rtol=0, atol=1e-6)
        assert np.array_equal(mine[:, device + BELIEF :], theirs[:, device:])
        actions = rng.uniform(-0.1, 0.1, (2, 2)).astype(np.float32)
        (theirs, _, begun, _), (mine, _, _, infos) = plain.step(actions), worlds.step(actions)
        assert begun.all() == (k % 20 == 19)
        if begun.any():
            last = infos[0]["terminal_observation"]
            assert last.shape == mine[0].shape and np.array_equal(last[device : device + BELIEF], held[0].astype("f4"))
    plain.close(), worlds.close()


@pytest.mark.slow
def test_learning_begins_as_the_policy_that_was_told_the_plan(estimator):
    """Its first actions are those of that policy with the estimate as its plan, filtered observations included."""
    device, rng = len(estimator.places), np.random.default_rng(0)
    kept = kept_shares((0.1, 0.4, 1.6), 0.02)
    inputs = (device + len(TOLD)) * (1 + len(kept))
    shape = Architecture(inputs=inputs, traces=kept, hidden=(64, 64), activation="tanh", output="clip", normalised=True)
    arrays = {name: 0.1 * rng.standard_normal(size) for name, size in shape.shapes().items()}
    arrays["variance"] = 1.0 + arrays["variance"] ** 2
    told = SimpleNamespace(arrays=arrays, description=SimpleNamespace(steps=1000))
    driver = BeliefLearning(estimator, 9600, 0, told).driver()
    network, believer = Network(shape, arrays), Believer(estimator)
    driver.begin(3), network.reset(3), believer.begin()
    for _ in range(5):
        seen = rng.standard_normal((3, device)).astype(np.float32)
        plan = believer.believe(seen).mean[:, list(TOLD)]
        expected = network(np.concatenate([seen, plan], axis=1, dtype=np.float32))
        assert np.allclose(driver.act(seen), expected, rtol=0, atol=1e-5)  # single precision of PyTorch


def test_the_pd_pulls_towards_its_estimate_and_less_where_that_is_unsure(estimator):
    """Told a plan high above all arms, it lifts them; told it without being sure, it does not."""
    numbers = {name: high for name, (_, high) in RANGES.items()} | {"share": 0.02, "carried": 0.02, "s0_deg": 10.0}
    angles = {}
    for log_variance in (-8.0, 4.0):
        with torch.no_grad():
            estimator.out.weight.zero_()
            estimator.out.bias[: len(TARGETS)] = torch.tensor([2.0, 0.0, 2.0, 2.0, 2.0, 2.0])
            estimator.out.bias[len(TARGETS) :] = log_variance
        driver = EstimatePd(estimator, numbers)
        found = record("stroke_severe", patient_seeds(3, PATIENTS), [driver], PATIENTS)
        assert np.allclose(np.array(driver.told)[::EVERY].T, 2.0)
        angles[log_variance] = found.seen[:, 50, places_of(["privileged.elbow"])[0]]
    assert (angles[-8.0] > angles[4.0] + 0.2).all()


def test_rows_are_measured_between_opponent_and_oracle():
    found = record("evaluation", patient_seeds(3, PATIENTS), ["nobody"], PATIENTS)
    best = dataclasses.replace(found, returns=found.returns + 100.0)
    half = dataclasses.replace(found, returns=found.returns + 50.0)
    against = {"mean_angle": found, "oracle": best}
    told = found.plan[..., 0] + np.radians(10.0)
    rows = [dict(zip(plan_belief.COLUMNS, plan_belief.measured("x", one, against, told), strict=True))
            for one in (found, half, best)]  # fmt: skip
    assert [x["gap_closed"] for x in rows] == pytest.approx([0.0, 0.5, 1.0])
    assert rows[0]["estimate_rms_deg"] == pytest.approx(10.0, rel=1e-3)  # single precision of angles
    # An error of the reward's width earns 1/e, as long as the episode goes on.
    assert rows[0]["tracking_if_there"] == pytest.approx(np.exp(-1.0) * found.running.mean(), rel=1e-3)
