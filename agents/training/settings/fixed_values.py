"""What a training keeps from its start to its end: the task and the way to learn it, as run.json holds them.

Returns of before and after a change could not be compared, and the best policy would be chosen among both. Compared are
values as they are read, so that layout, comments and the order of keys of a file may change.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from dms_core.errors import InputError, choices
from dms_core.files.json_text import finite
from dms_core.files.yaml_text import read_yaml
from dms_core.validation import cut, shown

from ...policies.learned import LearnedPolicy, find_policy
from .config import Config, Training
from .config_file import TRAINING

MAY_CHANGE = (
    "n_timesteps", "training.eval_every", "training.save_every", "training.threads", "training.device",
)  # fmt: skip
"""Keys that do not change what is learned, nor on what it is judged."""
RULE = f"in a training that goes on only these may change: {choices(MAY_CHANGE)}"
MOST_NAMED, ABSENT = 3, "not given"


def check_overrides(texts: Sequence[str]) -> None:
    """Refuse `key=value` of other keys than those of `MAY_CHANGE`.

    Raises:
        InputError: names the first.
    """
    for text in texts:
        if text.partition("=")[0].strip() not in MAY_CHANGE:
            raise InputError(f"--set {cut(text)}: {RULE}.")


def fixed_values(config: Config) -> dict[str, Any]:
    """All values that may not change, as JSON gives them back; of files that they name, a digest of the content."""
    training = config.training.model_dump()
    # Its gamma is that of the algorithm.
    normalize = {k: v for k, v in (config.normalize or {}).items() if k != "gamma"}
    own = {
        "n_envs": config.n_envs, "policy": config.policy, "frame_stack": config.frame_stack,
        "normalize": config.normalize is not None and (normalize or True),
        "env_kwargs": config.env_kwargs, **config.arguments,
        TRAINING: {k: v for k, v in training.items() if f"{TRAINING}.{k}" not in MAY_CHANGE},
    }  # fmt: skip
    if training["imitation"] is not None:
        own["content of the teacher"] = _digest_of_policy(training["imitation"]["teacher"])
    files = {f"content of {key}": _digest(value) for key, value in _leaves(own) if _is_file(value)}
    return json.loads(json.dumps(finite(own | files)))


def check_fixed(before: Mapping[str, Any], config: Config, folder: Path) -> None:
    """Refuse a configuration that is not the one that a training began with.

    Args:
        before: `fixed_values` of its start.
        config: of now.
        folder: of the training, for the message.

    Raises:
        InputError: names the values that differ, of then and of now.
    """
    # A version that knows further keys of `training` finds their defaults, under which the training began.
    defaults = dict(_leaves({TRAINING: json.loads(Training(algorithm="").model_dump_json())}))
    began = dict(_leaves(before))
    # A default that is no mapping stands in no file whose value is one.
    defaults = {key: value for key, value in defaults.items() if not any(k.startswith(f"{key}.") for k in began)}
    then, now = defaults | began, dict(_leaves(fixed_values(config)))
    changed = [key for key in (then | now) if then.get(key, ABSENT) != now.get(key, ABSENT) and key not in MAY_CHANGE]
    if not changed:
        return
    named = [f"{cut(key)} was {_said(then, key)} and is {_said(now, key)}" for key in changed[:MOST_NAMED]]
    more = f" and {len(changed) - MOST_NAMED} more" if len(changed) > MOST_NAMED else ""
    raise InputError(
        f"'{folder}' is a training with other values than its configuration has now: {', '.join(named)}{more}; {RULE}. "
        "Undo the change, or begin a new training."
    )


def _leaves(values: Mapping[str, Any], before: str = "") -> Iterator[tuple[str, Any]]:
    """Values that are no mappings, by their whole key."""
    for key, value in values.items():
        if isinstance(value, Mapping) and value:
            yield from _leaves(value, f"{before}{key}.")
        else:
            yield f"{before}{key}", value


def _said(values: Mapping[str, Any], key: str) -> str:
    return shown(values[key]) if key in values else ABSENT


def _is_file(value: Any) -> bool:
    """Whether a value names a population, a device or a model of the user's."""
    return isinstance(value, str) and value.endswith((".yaml", ".yml")) and Path(value).is_file()


def _digest_of_policy(name: str) -> str | None:
    """SHA-256 of a trained policy's weights; None of a policy that is code."""
    policy = find_policy(name)
    if not isinstance(policy, LearnedPolicy):
        return None
    content = {key: array.tolist() for key, array in policy.arrays.items()}
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


def _digest(path: str) -> str:
    """SHA-256 of what a YAML file says, whatever its layout."""
    return hashlib.sha256(json.dumps(finite(read_yaml(path)), sort_keys=True).encode()).hexdigest()
