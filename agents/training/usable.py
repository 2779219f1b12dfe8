"""Whether a training is possible at all: the packages it needs, and a configuration that can be trained."""

from __future__ import annotations

from pathlib import Path

from dms_core.errors import DmsError, InputError, extra

from ..environment import check_settings
from .settings.config import Config


def require_training() -> None:
    """Say what to install where training is not possible.

    Raises:
        DmsError: a package is missing.
    """
    try:
        import sb3_contrib  # noqa: F401
        import stable_baselines3  # noqa: F401
        import tensorboard  # noqa: F401
    except ImportError as error:
        raise DmsError(f"training needs {error.name}. {extra('train')}") from None


def checked_config(path: Path, changes: tuple[str, ...], environment: str | None = None) -> Config:
    """A configuration that can be trained.

    Args:
        path: its file.
        changes: values that replace those of the file.
        environment: id of the section to take, see `Config.read`.

    Raises:
        InputError: names file, key and value.
    """
    from .learners.algorithms import arguments

    config = Config.read(path, changes, environment)
    try:
        arguments(config)
        _check_device(config.training.device)
        check_settings(config.environment, config.env_kwargs)
        _check_critic(config)
    except InputError as error:
        raise InputError(f"{path}: {error}") from None
    return config


def _check_device(device: str) -> None:
    """Refuse a device that this machine has not: Stable-Baselines3 would train on the CPU without a word."""
    import torch

    kind, _, index = device.partition(":")
    if kind == "cuda" and not int(index or 0) < torch.cuda.device_count():
        raise InputError(f"training.device = '{device}': PyTorch sees {torch.cuda.device_count()} CUDA devices here.")
    if kind == "mps" and not torch.backends.mps.is_available():
        raise InputError("training.device = 'mps': PyTorch sees no such device here; expected 'cpu' or 'auto'.")


def check_other_policies(config: Config) -> None:
    """Refuse a teacher or a policy to begin with that is not there or acts in another environment.

    Args:
        config: placed in its folder, see `Config.placed`.

    Raises:
        InputError: names the key and the policy.
    """
    from ..environment import make
    from .networks.initial import initial_policy
    from .worlds import teacher_of

    if config.training.imitation is not None:
        teacher_of(config)
    if config.training.initial is not None:
        try:
            initial_policy(config.training.initial).reset(make(config.environment, **config.env_kwargs))
        except InputError as error:
            raise InputError(f"training.initial: {error}") from None


def _check_critic(config: Config) -> None:
    """Refuses settings of worlds whose observation, that of the critic included, is not possible."""
    from .worlds import observed_settings

    if not config.training.critic:
        return
    try:
        check_settings(config.environment, observed_settings(config))
    except InputError as error:
        raise InputError(f"training.critic: {error}") from None
