"""Episodes behind torch: values are those of the environment, gradients those of its differences."""

from __future__ import annotations

import numpy as np
import pytest

from dms_core.sensitivity.nodes import Number
from exo_env.gradients.torch_functions import ControlPeriod, WholeEpisode
from tests.exo_env.gradients.worlds import HIDDEN, LIFT, made, some_actions, steps

torch = pytest.importorskip("torch")

SEEN = ("angle", "rate", "tension", "muscle_moment", "elbow_force")
MODES = [(LIFT, mode) for mode in ("assist_moment", "rope_tension", "pid_setpoint", "impedance")] + [
    (HIDDEN, mode) for mode in ("assist_moment", "rope_tension")
]


def weighted(run, given, numbers=None):
    """A sum of all readings with different weights."""
    found = run(given, numbers)
    scales = torch.tensor([3.0, 1.0, 0.02, 0.02, 0.2, 0.01, 0.01, 0.01], dtype=torch.float64)
    return (torch.linspace(1.0, 2.0, len(found), dtype=torch.float64)[:, None] * scales * found).sum()


def gradient_of(run, actions):
    """Of the weighted sum, by the actions."""
    given = torch.tensor(actions, requires_grad=True)
    weighted(run, given).backward()
    return given.grad.numpy()


def along(run, actions, direction, step):
    """Central difference of the weighted sum along a direction of the actions, by the environment's own steps."""
    rows, env = run.period.periods.rows, run.period.env
    ends = [steps(env, actions + sign * step * direction, rows) for sign in (1.0, -1.0)]
    high, low = (float(weighted(lambda y, _: y, torch.as_tensor(y))) for y in ends)
    return (high - low) / (2.0 * step)


@pytest.mark.parametrize(("name", "mode"), MODES)
def test_values_are_those_of_the_environment(name, mode):
    """To the last bit, with the steps that the environment chooses, differentiated or not."""
    env = made(name, solver={}, action_mode=mode, control_rate=40.0)
    run = WholeEpisode(env, SEEN)
    actions = some_actions(env, 10)
    found = run(torch.tensor(actions, requires_grad=True)).detach().numpy()
    np.testing.assert_array_equal(run(torch.tensor(actions)).numpy(), found)
    np.testing.assert_array_equal(found, steps(env, actions, run.period.periods.rows))


@pytest.mark.parametrize(("name", "mode"), MODES)
@pytest.mark.parametrize("rate", [50.0, 30.0])
def test_gradient_is_that_of_differences(name, mode, rate):
    """Over 0.4 s, in which the patient's corrections come back through all delays.

    Forces of muscles bend sharply where a fibre turns round, as at the start from rest: a difference over 1e-6 has few
    of these kinks between its ends; rounding and Newton's method leave 1e-6 of it.
    """
    env = made(name, action_mode=mode, control_rate=rate)
    run, actions = WholeEpisode(env, SEEN), some_actions(env, int(0.4 * rate))
    gradient = gradient_of(run, actions)
    for seed in (1, 2):
        direction = np.random.default_rng(seed).normal(size=actions.shape)
        found = float((gradient * direction).sum())
        assert found == pytest.approx(along(run, actions, direction, 1e-6), rel=1e-4)


@pytest.mark.parametrize(
    "settings",
    [
        {"cuff": "compliant"},
        {"misalignment": {"shift": [0.01, 0.005, 0.0], "tilt_deg": [3.0, 0.0]}},
        {"control_rate": 1000.0},
        {"control_rate": 7.0},
    ],
    ids=str,
)
def test_gradient_in_other_settings_is_that_of_differences(settings):
    """Other equations, and periods that are far shorter and far longer than the patient's."""
    env = made(action_mode="assist_moment", **settings)
    run, actions = WholeEpisode(env, SEEN), some_actions(env, min(max(int(0.3 / env.period), 2), 50))
    direction = np.random.default_rng(1).normal(size=actions.shape)
    found = float((gradient_of(run, actions) * direction).sum())
    # As above; behind 0.3 s no muscle has turned round between the ends of a difference.
    assert found == pytest.approx(along(run, actions, direction, 1e-6), rel=1e-5)


def test_gradient_with_free_steps_is_that_of_differences():
    """To the error of the solver, which differences see as noise: 1e-6 over a step of 1e-2."""
    env = made(solver={"rtol": 1e-6}, action_mode="assist_moment")
    run, actions = WholeEpisode(env, SEEN), some_actions(env, 15)
    direction = np.random.default_rng(1).normal(size=actions.shape)
    found = float((gradient_of(run, actions) * direction).sum())
    assert found == pytest.approx(along(run, actions, direction, 1e-2), rel=3e-3)


def test_gradient_by_declared_numbers_is_that_of_differences():
    numbers = [
        Number("forearm", "mass"), Number("agonist_motor", "time_constant"), Number("BIClong", "max_isometric_force"),
        Number("agonist", "path.0.point.0"),
    ]  # fmt: skip
    env = made(action_mode="assist_moment")
    run, again = WholeEpisode(env, SEEN, numbers), WholeEpisode(env, SEEN)
    actions, declared = torch.tensor(some_actions(env, 12)), run.period.numbers()
    given = (1.01 * declared).requires_grad_(True)
    weighted(run, actions, given).backward()
    for k in range(len(numbers)):
        step = torch.zeros_like(declared)
        step[k] = 1e-5 * max(abs(declared[k]), 0.01)
        with torch.no_grad():
            high, low = (float(weighted(run, actions, given + sign * step)) for sign in (1.0, -1.0))
        assert float(given.grad[k]) == pytest.approx((high - low) / (2.0 * float(step[k])), rel=1e-5), numbers[k].name
    # The environment that is stepped next has its own numbers.
    run(actions[:1], given)
    np.testing.assert_array_equal(again(actions[:3]).detach(), run(actions[:3], declared).detach())
    with torch.no_grad():
        found = run(actions, declared).numpy()
    np.testing.assert_array_equal(found, steps(env, actions.numpy(), run.period.periods.rows))


def test_gradient_goes_through_a_change_of_the_weight():
    """A weight that is picked up writes all numbers of the model anew, over those that were given."""
    env = made(HIDDEN, action_mode="assist_moment")
    loads = env.world.tables.plan.loads
    loads[4:] = loads[0] + 0.3
    run = WholeEpisode(env, ["angle", "rate"], [Number("forearm", "mass")])
    given = [torch.tensor(some_actions(env, 8)), 1.1 * run.period.numbers()]
    for x in given:
        x.requires_grad_(True)
    run(*given)[-1, 1].backward()
    for k, x in enumerate(given):
        step = 1e-5 * torch.linspace(0.5, 1.0, x.numel(), dtype=torch.float64).reshape(x.shape)
        with torch.no_grad():
            ends = [[y + sign * step if y is x else y for y in given] for sign in (1.0, -1.0)]
            high, low = (float(run(*y)[-1, 1]) for y in ends)
        assert 2.0 * float((x.grad * step).sum()) == pytest.approx(high - low, rel=1e-4), k


def test_a_period_is_the_same_from_the_same_state():
    """Whatever was done in between, by functions or by the environment's own step."""
    env = made(action_mode="assist_moment")
    period = ControlPeriod(env, SEEN)
    action, other = torch.tensor([0.2, -0.5], dtype=torch.float64), torch.tensor([-0.3, 0.1], dtype=torch.float64)
    start, _ = period(period.start(), action)
    state, seen = period(start, action)
    period(period(start, other)[0], other)
    again = period(start, action)
    np.testing.assert_array_equal(again[1], seen)
    np.testing.assert_array_equal(again[0].numbers, state.numbers)
    env.step(other.numpy())
    np.testing.assert_array_equal(period(start, action)[1], seen)


def test_environment_goes_on_as_if_it_had_been_stepped():
    """Behind any number of calls: observation, what the device's filter estimates among it, and reward."""
    settings = {"action_mode": "assist_moment", "observation": ["device", "estimated"]}
    env = made(HIDDEN, solver={}, **settings)
    period, actions = ControlPeriod(env, SEEN), some_actions(env, 6)
    start = period.start()
    for _ in range(2):
        state = start
        for action in torch.tensor(actions[:5], requires_grad=True):
            state, _ = period(state, action)
    found = env.step(actions[5])
    env.reset(seed=1)
    for action in actions:
        expected = env.step(action)
    np.testing.assert_array_equal(found[0], expected[0])
    assert found[1] == expected[1]


def test_gradient_by_the_state_is_that_of_differences():
    """Amid an episode, by what no constraint ties: first-order states, commands, excitations and the patient's memory.

    Newton's method leaves 1e-9 of the readings, and kinks of the patient's law lie nowhere near.
    """
    env = made(action_mode="assist_moment", control_rate=40.0)
    period = ControlPeriod(env, SEEN)
    state, _ = period(period.start(), torch.tensor([0.2, -0.5], dtype=torch.float64))
    for _ in range(8):
        state, _ = period(state, torch.tensor([0.2, -0.5], dtype=torch.float64))
    at, model = period.periods.vector.at, env.world.model
    free = [model.layout.index[x] for x in ("BIClong.activation", "BRA.fibre_length", "agonist_motor.tension")]
    action = torch.tensor([0.1, -0.4], dtype=torch.float64)
    weights = torch.linspace(0.5, 1.0, len(period.labels), dtype=torch.float64)

    def after(numbers):
        there, first = period(state._replace(numbers=numbers), action)
        return (weights * first).sum() + (weights * period(there, action)[1]).sum()

    given = state.numbers.clone().requires_grad_(True)
    after(given).backward()
    places = {"commands": at["commands"], "excitations": at["excitations"], "drive": at["drive"], "error": at["error"],
              "states": np.array(free), "before": at["excitations_before"], "fatigued": at["fatigued"]}  # fmt: skip
    for name, moved in places.items():
        step = torch.zeros_like(given)
        step[moved] = 1e-6 * torch.linspace(1.0, 2.0, len(moved), dtype=torch.float64)
        with torch.no_grad():
            high, low = (float(after(given + sign * step)) for sign in (1.0, -1.0))
        found = float((given.grad * step).sum())
        assert 2.0 * found == pytest.approx(high - low, rel=1e-4, abs=1e-10), name


def test_gradient_goes_on_where_rows_were_ordered_anew():
    env = made(action_mode="assist_moment")
    actions = some_actions(env, 6)

    def gradient():
        given = torch.tensor(actions, requires_grad=True)
        WholeEpisode(env, SEEN)(given)[:, 1].sum().backward()
        return given.grad.numpy()

    usual = gradient()
    env.reset(seed=1)
    assert env.world.dynamics.reorder(nearby=True)
    env.world.follow_dynamics()
    # Another order of elimination rounds otherwise.
    np.testing.assert_allclose(gradient(), usual, rtol=1e-6, atol=1e-8)


def test_policy_in_the_loop_has_the_gradient_of_differences():
    """A gain on what is read, in single precision as policies are."""
    env = made(action_mode="assist_moment")
    period = ControlPeriod(env, ["angle", "rate"])
    start, first = period.start(), period.readings()

    def cost(gain):
        state, seen, total = start, first, 0.0
        for _ in range(10):
            action = torch.stack([gain * (1.0 - seen[0]).float(), torch.tensor(-0.5)])
            state, seen = period(state, action)
            total = total + ((seen[0] - 1.0) ** 2).float()
        return total

    gain = torch.tensor(0.2, requires_grad=True)
    cost(gain).backward()
    assert gain.grad.dtype == torch.float32
    with torch.no_grad():
        high, low = cost(torch.tensor(0.25)), cost(torch.tensor(0.15))
    # Costs in single precision are good to 1e-7, over a difference of 0.1 in the gain.
    assert float(gain.grad) == pytest.approx(float(high - low) / 0.1, rel=2e-2)


def test_beyond_its_limits_an_action_has_no_derivative():
    env = made(action_mode="rope_tension", drive_settings={"rate_limit": 1e6})
    given = torch.tensor([[-1.5, 0.2]] * 3, dtype=torch.float64, requires_grad=True)
    WholeEpisode(env, ["tension"])(given).sum().backward()
    assert not given.grad[:, 0].any() and given.grad[:, 1].all()
