"""Models that Stable-Baselines3 saved elsewhere, as policies."""

from __future__ import annotations

import pickle
from pathlib import Path
from typing import Any

from dms_core.errors import DmsError, InputError
from dms_core.files.input_file import opened
from dms_core.files.json_text import brief

from ..environment import ENVIRONMENT, environment_id, make
from ..policies.learned import LearnedPolicy
from ..training.usable import require_training


def from_zip(
    source: Path,
    statistics: Path | None,
    algorithm: str,
    trust: bool,
    action_mode: str | None,
    environment: str = ENVIRONMENT,
) -> LearnedPolicy:
    """The policy of a file that Stable-Baselines3 saved elsewhere.

    Args:
        source: the file.
        statistics: vecnormalize.pkl, where observations were normalised.
        algorithm: that trained it.
        trust: whether the user trusts who made the files.
        action_mode: what its actions do; the file does not say, and another mode may take actions of the same shape.
        environment: id of that in which it was trained.

    Raises:
        InputError: it is not trusted, not whole, its action mode is not said, or it was trained on other observations.
    """
    if not trust:
        raise InputError(
            f"'{source}' carries pickles, which can run any code when they are read. If you trust who made it, give "
            "--trust."
        )
    if action_mode is None:
        raise InputError(f"'{source}' does not say what its actions do. Give the --action-mode that it was trained in.")
    require_training()
    from ..training.learners.algorithms import find
    from ..training.networks.extraction import Origin, extract

    model, env = _read(find(algorithm), source), make(environment, action_mode=action_mode)
    try:
        origin = Origin(environment_id(environment), algorithm, model.seed)
        return extract(model, env, origin, _statistics(statistics))
    except (AttributeError, TypeError, KeyError, IndexError) as error:
        raise InputError(f"'{source}' is not a model of {algorithm}: {brief(str(error))}.") from None
    finally:
        env.close()


def _read(kind: Any, source: Path) -> Any:
    """A model, pickles and all."""
    try:
        with opened(source) as file:
            return kind.load(file, device="cpu")
    except InputError:
        raise
    except Exception as error:  # what a damaged pickle raises has no common class
        reason = brief(" ".join(str(error).split()) or type(error).__name__)
        raise InputError(f"'{source}' is no whole model of {kind.__name__}: {reason}") from None


def _statistics(path: Path | None) -> Any:
    """A VecNormalize, pickled."""
    if path is None:
        return None
    from stable_baselines3.common.vec_env import VecNormalize

    try:
        with opened(path) as file:
            content = pickle.load(file)
    except InputError:
        raise
    except Exception as error:  # what a damaged pickle raises has no common class
        raise InputError(f"'{path}' is no whole pickle: {brief(str(error) or type(error).__name__)}.") from None
    if not isinstance(content, VecNormalize):
        raise DmsError(f"'{path}' holds a {type(content).__name__}: expected a VecNormalize.")
    return content
