"""The environments that policies act in, by id: the one place where they are made.

Any environment that is registered with Gymnasium and has the face of this package will do; one of another package is
named with the module that registers it, "module:namespace/Name-v0" (exo_env/envs/lookup.py).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import gymnasium
import numpy as np
from gymnasium.envs.registration import load_env_creator
from gymnasium.vector import AutoresetMode, VectorEnv

import exo_env  # noqa: F401  Importing it registers its environments.
from dms_core.errors import InputError
from exo_env.envs.base_env import AssistanceEnv
from exo_env.envs.lookup import environment_id, environments, spec_of
from exo_env.tasks.task import Task

if TYPE_CHECKING:
    from stable_baselines3.common.vec_env import VecEnv

__all__ = (
    "ENVIRONMENT", "PROGRAM", "check_settings", "environment_id", "environments", "hides_plan", "make",
    "make_sb3_worlds", "make_vector", "patient_seeds", "spec_of", "task_type",
)  # fmt: skip

ENVIRONMENT = "exo/ElbowLift-v2"
"""The environment where none is named."""
HIDDEN_PLAN = "exo/HiddenIntent-v0"
"""That of the studies where none is named: its task hides the patient's plan."""
PROGRAM = f"python -m {__name__.partition('.')[0]}"
"""This command line, under the name by which it is installed."""


def make(environment: str, **settings: Any) -> gymnasium.Env:
    """One environment.

    Args:
        environment: its id.
        settings: arguments of the environment, over those of its registration.

    Raises:
        InputError: the id is not registered, or a setting is not usable.
    """
    return gymnasium.make(spec_of(environment).id, disable_env_checker=True, **settings)


def check_settings(environment: str, settings: Mapping[str, Any]) -> None:
    """Refuse settings that no environment can be made with; nothing is compiled.

    Raises:
        InputError: names the setting.
    """
    spec = spec_of(environment)
    assert spec.entry_point is not None
    creator = spec.entry_point if callable(spec.entry_point) else load_env_creator(spec.entry_point)
    creator(**{**spec.kwargs, **settings}).close()


def task_type(environment: str) -> type[Task]:
    """The task of an environment.

    Raises:
        InputError: the id is not registered.
    """
    entry = spec_of(environment).entry_point
    creator = load_env_creator(entry) if isinstance(entry, str) else entry
    if isinstance(creator, type) and issubclass(creator, AssistanceEnv):
        return creator.task_type
    made: Any = make(environment).unwrapped
    return type(made.task)


def hides_plan(environment: str) -> bool:
    """Whether a policy is not to know what the patient wants, so that policies are compared by fair rules.

    Raises:
        InputError: the id is not registered.
    """
    return bool(task_type(environment).revealing)


def make_vector(environment: str, num_envs: int, **settings: Any) -> VectorEnv:
    """Many worlds in one compiled batch.

    Args:
        environment: its id.
        num_envs: number of worlds.
        settings: arguments of the vector environment and of its worlds, over those of the registration.

    Raises:
        InputError: the id is not registered, has no vector environment, or a setting is not usable.
    """
    spec = spec_of(environment)
    if spec.vector_entry_point is None:
        raise InputError(
            f"environment '{environment}' has no vector environment, which training needs; register it with a "
            "vector_entry_point."
        )
    entry: Any = spec.vector_entry_point
    creator: Any = entry if callable(entry) else load_env_creator(entry)
    return creator(num_envs, **{**spec.kwargs, **settings})


def make_sb3_worlds(environment: str, num_envs: int, **settings: Any) -> VecEnv:
    """Many worlds as Stable-Baselines3 takes them; each resets itself in the step that ends its episode.

    Args:
        environment: its id.
        num_envs: number of worlds.
        settings: as for `make_vector`.

    Raises:
        InputError: as `make_vector`.
    """
    from exo_env.envs.stable_baselines import AssistanceVecEnv

    worlds: Any = make_vector(environment, num_envs, autoreset_mode=AutoresetMode.SAME_STEP, **settings)
    return AssistanceVecEnv(worlds)


def patient_seeds(seed: int, patients: int) -> list[int]:
    """Seeds of the episodes of an evaluation, one a patient; more patients keep those of fewer."""
    return [int(x) for x in np.random.SeedSequence(seed).generate_state(patients)]
