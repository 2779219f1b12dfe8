"""Baselines: what they command follows from what they see, and they do what their names say."""

import numpy as np
import pytest

from agents.environment import ENVIRONMENT, make
from agents.evaluation.comparison.evaluate import evaluate
from agents.policies.assist_as_needed import AssistAsNeeded, gaussians
from agents.policies.baselines import FOLLOWING, policy
from agents.policies.compensation import ANGLES, CompensatedPid, holding_tensions
from agents.policies.estimated_load import EstimatedLoadPid
from agents.policies.lagging_pid import LaggingPid
from dms_core.errors import InputError
from exo_env.ecosystem.arm import Person
from exo_env.ecosystem.ecosystem import Ecosystem


def made(used, seed=0, **settings):
    """An environment for a policy, reset for both."""
    env = make(
        ENVIRONMENT, action_mode=used.action_mode, observation=list(used.observation), noise=False,
        episode_duration=1.0, **settings,
    )  # fmt: skip
    observation, info = env.reset(seed=seed)
    used.reset(env)
    return env, observation, info


@pytest.mark.parametrize("name", FOLLOWING)
def test_actions_are_in_the_box(name):
    used = policy(name)
    env, observation, info = made(used)
    for _ in range(20):
        action = used(observation, info)
        # Within the box to the last digit: nothing is left to the environment's clipping.
        assert action.shape == (2,) and (np.abs(action) <= 1.0).all()
        observation, _, _, _, info = env.step(action)


def test_unknown_policy_is_named_with_the_known():
    with pytest.raises(InputError, match="unknown policy 'nobody'.*pid_compensated"):
        policy("nobody")


def test_holding_tension_is_linear_in_the_load():
    tensions = [holding_tensions(Ecosystem(), Person(), load, ANGLES) for load in (0.5, 1.0, 2.0)]
    # Round-off only: statics are linear.
    np.testing.assert_allclose(tensions[2] - tensions[1], 2.0 * (tensions[1] - tensions[0]), rtol=1e-9, atol=1e-9)


def test_table_of_holding_tensions_is_fine_enough():
    between = np.radians(np.linspace(20.0, 100.0, 333))
    exact = holding_tensions(Ecosystem(), Person(), 2.0, between)
    table = np.interp(between, ANGLES, holding_tensions(Ecosystem(), Person(), 2.0, ANGLES))
    # What the docstring of ANGLES promises.
    assert np.abs(table - exact).max() < 0.1


def test_compensation_stands_for_the_holding_tension():
    used = CompensatedPid(share=0.8, authority=0.5, lag_deg=1.0)
    env, observation, info = made(used, load=1.5)
    gains, total, channels = env.unwrapped.ecosystem.device.gains, 0.0, env.unwrapped.observation_structure
    ahead = next(part for part in channels if part.name == "preview").start
    patient = info["patient"]
    person = Person(body_mass=patient["body_mass"], height=patient["height"])
    for _ in range(45):
        psi = float(observation[ahead])
        action = used(observation, info)
        change = action[0] * 0.2 + np.radians(1.0)
        assert action[1] == 0.0
        given = gains.kp * change + gains.ki * total
        expected = 0.8 * holding_tensions(env.unwrapped.ecosystem, person, 1.5, np.array([psi]))[0]
        # Float32 observations and the table, 0.1 N.
        assert given == pytest.approx(expected, abs=0.15)
        total += change * env.unwrapped.period
        observation, _, _, _, info = env.step(action)


def test_the_estimated_load_is_compensated_as_it_is_estimated_now():
    used = EstimatedLoadPid(share=1.0, authority=1.0, lag_deg=0.0)
    env, observation, _ = made(used)
    (part,) = [x for x in env.unwrapped.observation_structure if x.name == "load"]
    assert part.group == "estimated"
    for load in (0.5, 1.25, 2.0):
        observation[part.start] = load / part.scale
        expected = holding_tensions(env.unwrapped.ecosystem, Person(), load, ANGLES)
        # Statics are linear in the load; the observation is float32.
        np.testing.assert_allclose(used.held(observation), expected, rtol=1e-5, atol=1e-4)


def test_gaussians_sum_to_one_and_peak_at_the_angle():
    found = gaussians(np.radians(45.0))
    assert found.sum() == pytest.approx(1.0, rel=1e-12)
    assert found.argmax() == 3


def test_without_error_the_learned_moment_fades_with_the_memory():
    used = AssistAsNeeded(memory=2.0)
    made(used)
    used.weights = np.linspace(1.0, 3.0, 10)
    basis, before = gaussians(1.0), np.linspace(1.0, 3.0, 10)
    for _ in range(100):
        used.learn(basis, 0.0, 0.0)
    # 100 periods of 0.02 s are one memory; exact, so round-off only.
    assert basis @ used.weights == pytest.approx(np.exp(-1.0) * (basis @ before), rel=1e-12)
    # Nothing else is forgotten: what changed lies along the basis.
    change = used.weights - before
    np.testing.assert_allclose(change, basis * (basis @ change) / (basis @ basis), atol=1e-12)


@pytest.mark.parametrize("error", [0.1, -0.1])
def test_learning_goes_against_the_error(error):
    used = AssistAsNeeded()
    made(used)
    used.weights = np.zeros(10)
    used.learn(gaussians(1.0), error, 0.0)
    assert np.sign(gaussians(1.0) @ used.weights) == np.sign(error)


@pytest.mark.parametrize("moment", [4.0, -3.0, 0.0])
def test_tensions_give_the_moment_with_one_rope(moment):
    used = AssistAsNeeded()
    env, _, _ = made(used)
    device, angle = env.unwrapped.ecosystem.device, 1.1
    tensions = 0.5 * (used._action(moment, angle) + 1.0) * np.array(env.unwrapped.drive.max_tension)
    arms = [device.moment_arm(rope, angle) for rope in device.ropes]
    assert tensions @ arms == pytest.approx(moment, abs=1e-12)
    assert tensions.min() == 0.0


def test_each_does_what_its_name_says():
    # Whole episodes of three patients who hardly help themselves. Of others the compensation does the work twice.
    limp = {"maximum_activation_flexors": 0.05, "maximum_activation_extensors": 0.05}
    acting = [CompensatedPid(share=1.0, authority=1.0, lag_deg=0.0), LaggingPid(authority=0.3, lag_deg=1.0)]
    acting += [policy(n) for n in ("none", "pid", "assist_as_needed")]
    found = evaluate(acting, {"base": "stroke_severe", "fields": limp}, 3, 7)["policies"]

    def of(name, measure):
        return [e["measures"][measure] for e in found[name]["episodes"]]

    for k in range(3):
        assert of("pid_compensated", "tracking_rms_deg")[k] < of("pid", "tracking_rms_deg")[k]
        assert of("pid", "tracking_rms_deg")[k] < of("pid_yielding", "tracking_rms_deg")[k]
        assert of("assist_as_needed", "tracking_rms_deg")[k] < of("none", "tracking_rms_deg")[k]
        assert not of("none", "device_work_share")[k] > 0.01
