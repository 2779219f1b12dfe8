"""The folder of a training: what was run, with what, how far it came.

run.json          seed, values that may not change, command lines, versions, git revision
config.yml        the configuration, overrides included; rl_zoo3 reads it too
evaluations.json  the learning curve
checkpoints/      what the training goes on from
best/             the best policy so far, by its mean return
tensorboard/
"""

from __future__ import annotations

import contextlib
import os
import shlex
import sys
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from dms_core.errors import InputError
from dms_core.files.output_file import write_json, write_text
from dms_core.files.output_place import check_writable
from dms_core.files.yaml_text import yaml_of

from ...checkpoint import Store
from ...environment import environment_id
from ...provenance import revision, versions
from ..settings.config import Config
from ..settings.fixed_values import check_fixed, check_overrides, fixed_values
from ..usable import checked_config
from .records import EVALUATIONS as EVALUATIONS
from .records import RECORD as RECORD
from .records import read_record as read_record
from .records import seal

CONFIG, LOCK = "config.yml", ".lock"


class RunFolder:
    """Places and records of a training.

    Args:
        path: of the folder.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.checkpoints, self.best = Store(path / "checkpoints", keep=2), Store(path / "best")

    def check_new(self) -> None:
        """Make the folder of a new training.

        Raises:
            InputError: the folder is in use, or is a file.
        """
        if self.path.exists() and not self.path.is_dir():
            raise InputError(f"output '{self.path}' is a file: expected a new or empty folder.")
        # A start that was killed before its record was written leaves no more than these.
        if self.path.is_dir() and {p.name for p in self.path.iterdir()} - {CONFIG, LOCK}:
            hint = f"go on with --resume {self.path}, or" if (self.path / RECORD).is_file() else ""
            raise InputError(f"output '{self.path}' is not empty; {hint} choose another --out.".replace("  ", " "))
        check_writable(self.path / RECORD)

    def begin(self, config: Config, seed: int) -> None:
        """A new training; to be called while the folder is locked.

        Raises:
            InputError: the folder is in use, or is a file.
        """
        self.check_new()
        self.write_config(config)
        record = {
            "environment": config.environment, "algorithm": config.training.algorithm, "seed": seed,
            "fixed": fixed_values(config),
        }  # fmt: skip
        write_json(self.path / RECORD, record | {"sha256": seal(record), "sessions": [_session()]})

    def go_on(self, overrides: tuple[str, ...]) -> tuple[Config, int]:
        """Configuration and seed of a training that was begun; what goes on is recorded, while the folder is locked.

        Raises:
            InputError: the folder holds no training or one of another environment, a value is changed that may not
                change, or one that may is not usable. Then nothing is written.
        """
        check_overrides(overrides)
        record = read_record(self.path)
        config = checked_config(self.path / CONFIG, overrides, environment_id(record["environment"]))
        if record.get("fixed") is not None:
            check_fixed(record["fixed"], config, self.path)
        if overrides:
            self.write_config(config)
        record["sessions"].append(_session())
        write_json(self.path / RECORD, record)
        return config, record["seed"]

    def write_config(self, config: Config) -> None:
        """Keep the configuration."""
        write_text(self.path / CONFIG, yaml_of(config.content()))

    @contextlib.contextmanager
    def locked(self) -> Iterator[None]:
        """Only one process trains in the folder; the lock falls with the process.

        Raises:
            InputError: another process is at it.
        """
        try:
            import fcntl
        except ImportError:  # Windows; two trainings in one folder go unnoticed there.
            yield
            return
        with (self.path / LOCK).open("a+") as file:
            try:
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except OSError:
                raise InputError(f"another process is training in '{self.path}'.") from None
            file.truncate(0)
            file.write(f"{os.getpid()}\n")
            file.flush()
            yield


def _session() -> dict[str, Any]:
    """One start of a training."""
    return {
        "started": datetime.now(UTC).isoformat(timespec="seconds"), "command": shlex.join(sys.orig_argv),
        "versions": versions(), "git": revision(),
    }  # fmt: skip
