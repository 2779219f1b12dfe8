"""One episode of a policy, measured."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import gymnasium

from exo_env.ecosystem.sensors import tension_sensor
from exo_env.patient.population import Source
from exo_env.tasks.movements.repetition import MOVED, Repetition, Repetitions

from ...environment import ENVIRONMENT, make, task_type
from ...policies.learned import LearnedPolicy
from ...policies.policy import Policy
from .fair_play import begin, check_fair, shown
from .measures import Record, left_out, measured

ABOUT = ("load", "ability", "reference", "patient")
"""What is kept of the `info` of a reset, where it is in there."""


def world_of(policy: Policy, patient: Source, environment: str = ENVIRONMENT, **settings: Any) -> gymnasium.Env:
    """The environment that a policy acts in.

    Args:
        policy: says the action mode and what it sees.
        patient: population or patient.
        environment: its id.
        settings: further ones of the environment.

    Raises:
        InputError: the policy was trained for another task, or sees what it may not (fair_play.py).
    """
    if isinstance(policy, LearnedPolicy):
        policy.check_task(task_type(environment))
    env = make(
        environment, patient=patient, action_mode=policy.action_mode, observation=list(policy.observation), **settings
    )
    check_fair(policy, env)
    return env


def episode(env: gymnasium.Env, acting: Policy, seed: int, load: float | None = None) -> dict[str, Any]:
    """Run one episode.

    Args:
        env: in which.
        acting: the policy.
        seed: of the episode.
        load: in place of the one that the seed draws [kg].

    Returns:
        "measures", "event", which ended it or None, what `info` of the reset says of patient, load and movement, and
        "left_out", the measures that the environment does not allow.
    """
    drawn, record = recorded(env, acting, seed, load)
    return {
        **{k: drawn[k] for k in ABOUT if k in drawn},
        "event": record.event,
        "measures": measured(record),
        "left_out": left_out(record),
    }


def recorded(env: gymnasium.Env, acting: Policy, seed: int, load: float | None = None) -> tuple[dict[str, Any], Record]:
    """Run one episode; arguments as of `episode`.

    Returns:
        `info` of the reset, and the episode's record.
    """
    world: Any = env.unwrapped
    observation, drawn = env.reset(seed=seed, options=None if load is None else {"load": load})
    info = drawn
    begin(acting, env)
    record = Record(movement_of(env, drawn), tuple(map(tension_sensor, world.ecosystem.device.ropes)), world.period)
    record.add(world.readings())
    over = False
    while not over:
        observation, reward, terminated, truncated, info = env.step(acting(observation, shown(info, env)))
        record.add_step(float(reward), info)
        record.add(world.readings())
        over = terminated or truncated
    record.event = info.get("event")
    return drawn, record


def judged(env: gymnasium.Env, acting: Policy, seeds: Sequence[int]) -> list[dict[str, Any]]:
    """Measures of an episode with each seed; what a training is watched by."""
    return [episode(env, acting, seed)["measures"] for seed in seeds]


def movement_of(env: gymnasium.Env, drawn: dict[str, Any]) -> Repetition | None:
    """The repetitions of an episode.

    Args:
        env: in which.
        drawn: `info` of its reset.

    Returns:
        None where the patient's movement is another one, or a reset does not tell it.
    """
    world: Any = env.unwrapped
    if not isinstance(world.movement, Repetitions) or "reference" not in drawn:
        return None
    count, every = world.movement.episode_numbers(world.duration)
    return Repetition(**{name: drawn["reference"][name] for name in MOVED}, count=int(count), every=every)
