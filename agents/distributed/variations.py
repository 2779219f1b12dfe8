"""Variations of configurations, as a list in a YAML file: which values of which file each one changes.

    student:   {config: student.yml}
    clock:     {config: student.yml, set: ["env_kwargs.observation=[device, clock]"]}

A variation gives its name to the folder of its training. `config` is a path from the list's folder; `set` are changes
as of the command line, made behind those that stand there. So one variation is named as another's teacher by
training.imitation.teacher=../NAME_{seed}.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from dms_core.errors import InputError
from dms_core.files.yaml_text import read_yaml
from dms_core.validation import cut, shown

NAME = re.compile(r"[a-z][a-z0-9_]{0,99}")
"""Of a variation."""
RIGHT = "expected {config: FILE, set: [KEY=VALUE, ...]}, with or without set"


@dataclass(frozen=True)
class Variation:
    """A configuration with changes, under a name."""

    name: str
    config: Path
    changes: tuple[str, ...] = ()


def folder_of(out: Path, name: str, seed: int) -> Path:
    """Folder of a variation's training with a seed."""
    return out.resolve() / f"{name}_{seed}"


def read_variations(path: Path) -> list[Variation]:
    """The variations of a list.

    Raises:
        InputError: names file, variation and what is wrong.
    """
    content = read_yaml(path)
    if not content:
        raise InputError(f"{path}: expected one or more variations, got none.")
    return [_variation(path, str(name), given) for name, given in content.items()]


def _variation(path: Path, name: str, given: object) -> Variation:
    """One entry of a list."""
    who = f"{path}: variation '{cut(name)}'"
    if not NAME.fullmatch(name):
        raise InputError(f"{who}: expected a name of small letters, digits and _, a letter first.")
    if not isinstance(given, Mapping) or not {"config"} <= given.keys() <= {"config", "set"}:
        raise InputError(f"{who} = {shown(given)}: {RIGHT}.")
    config, changes = given["config"], given.get("set", ())
    words = isinstance(changes, Sequence) and not isinstance(changes, str) and all(isinstance(x, str) for x in changes)
    if not isinstance(config, str) or not words:
        raise InputError(f"{who} = {shown(given)}: {RIGHT}.")
    return Variation(name, path.parent / config, tuple(changes))
