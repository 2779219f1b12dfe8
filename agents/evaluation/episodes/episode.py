"""One episode of a policy, measured."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import gymnasium

from exo_env.ecosystem.sensors import tension_sensor
from exo_env.patient.population import Source
from exo_env.tasks.movements.repetition import MOVED, Repetition, Repetitions

from ...environment import ENVIRONMENT, make, task_type
from ...policies.learned import LearnedPolicy
from ...policies.policy import Policy
from .fair_play import check_fair
from .measures import Record, left_out, measured
from .playing import Playing

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
    playing = Playing(env, acting, seed, reset_options(load))
    record = recorded(playing)
    return {
        **{k: playing.drawn[k] for k in ABOUT if k in playing.drawn},
        "event": record.event,
        "measures": measured(record),
        "left_out": left_out(record),
    }


def reset_options(load: float | None) -> dict[str, Any] | None:
    """Options of a reset with a load [kg]; None: that which the seed draws."""
    return None if load is None else {"load": load}


def recorded(playing: Playing, watch: Callable[[Mapping[str, float]], None] = lambda readings: None) -> Record:
    """Play an episode to its end.

    Args:
        playing: the episode at its start.
        watch: is given all readings of each control time.
    """
    world: Any = playing.env.unwrapped
    ropes = tuple(map(tension_sensor, world.ecosystem.device.ropes))
    record = Record(movement_of(playing.env, playing.drawn), ropes, world.period)

    def add(readings: Mapping[str, float]) -> None:
        record.add(readings)
        watch(readings)

    add(world.readings())
    for reward, info in playing.steps():
        record.add_step(reward, info)
        add(world.readings())
    record.event = playing.event
    return record


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
