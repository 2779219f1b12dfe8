"""What the JSON files of a training have to hold, and their readers.

run.json                    environment, algorithm, seed, what may not change (fixed_values.py), and the starts
evaluations.json            the learning curve, a point an evaluation
checkpoints/*/state.json    counters that a training goes on from
best/*/state.json           the point of the learning curve at which the policy was best
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

from pydantic import AfterValidator, ConfigDict, FailFast, Field

from dms_core.errors import InputError
from dms_core.files.json_text import Each, checked, read_json
from dms_core.validation import Checked

from ...policies.learned import fingerprint

RECORD, EVALUATIONS, STATE = "run.json", "evaluations.json", "state.json"
Count = Annotated[int, Field(strict=True, ge=0)]
Number = Annotated[float, Field(strict=True)]


class Record(Checked):
    """A training."""

    environment: str = Field(pattern="^[^:]*$", description="id; a module in a file would be run")
    algorithm: str
    seed: Count
    sessions: Annotated[list[dict[str, Any]], FailFast()]
    fixed: dict[str, Any] | None = Field(default=None, description="may not change; older trainings have none")
    sha256: str = Field(default="", description="of all but the starts")


class CurvePoint(Checked):
    """An evaluation of a training; the measures beside the return are those of its environment."""

    model_config = ConfigDict(extra="allow")
    __pydantic_extra__: dict[str, Number | None]
    steps: Annotated[Count, Field(le=1 << 60)]
    seconds: Number
    mean: Number = Field(alias="return")
    returns: Annotated[list[Number], FailFast()] = []


def _rising(curve: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """A learning curve whose steps do not fall."""
    for before, after in zip(curve, curve[1:], strict=False):
        if after["steps"] < before["steps"]:
            raise ValueError(f"{after['steps']} steps follow {before['steps']}: expected steps that do not fall")
    return curve


Curve = Annotated[list[Any], Each(CurvePoint), AfterValidator(_rising)]


class State(Checked):
    """A checkpoint's counters."""

    steps: Annotated[Count, Field(le=1 << 60)]
    updates: Count
    episodes: Count
    seconds: Number
    evaluations: Curve


class _Curve(Checked):
    evaluations: Curve


def read_record(folder: Path) -> dict[str, Any]:
    """run.json of a training's folder.

    Raises:
        InputError: there is none, it is not whole, or it was changed by hand.
    """
    if not (folder / RECORD).is_file():
        raise InputError(f"'{folder}' is not the folder of a training: it holds no {RECORD}.")
    content = read_json(folder / RECORD)
    record = checked(Record, content, f"file '{folder / RECORD}'")
    if (record.fixed is not None or record.sha256) and record.sha256 != seal(content):
        raise InputError(
            f"file '{folder / RECORD}' was changed: its SHA-256 is not the one that it holds. Undo the change, or "
            "begin a new training."
        )
    return content


def seal(record: Mapping[str, Any]) -> str:
    """SHA-256 of all of run.json but the starts, which each one adds to."""
    return fingerprint({key: value for key, value in record.items() if key != "sessions"})


def read_curve(folder: Path) -> list[dict[str, Any]]:
    """evaluations.json of a training's folder, or nothing where there is none yet.

    Raises:
        InputError: it is not whole.
    """
    if not (folder / EVALUATIONS).is_file():
        return []
    content = read_json(folder / EVALUATIONS)
    checked(_Curve, {"evaluations": content}, f"file '{folder / EVALUATIONS}'")
    # A whole number of JSON may be too large for NumPy's.
    return [{k: float(v) if k != "steps" and isinstance(v, int) else v for k, v in point.items()} for point in content]


def read_state(checkpoint: Path) -> dict[str, Any]:
    """state.json of a checkpoint.

    Raises:
        InputError: it is missing or not whole.
    """
    return _read_state(checkpoint, State)


def read_point(checkpoint: Path) -> dict[str, Any]:
    """state.json of a best policy.

    Raises:
        InputError: it is missing or not whole.
    """
    return _read_state(checkpoint, CurvePoint)


def _read_state(checkpoint: Path, kind: type[Checked]) -> dict[str, Any]:
    content = read_json(checkpoint / STATE)
    checked(kind, content, f"file '{checkpoint / STATE}'")
    return content
