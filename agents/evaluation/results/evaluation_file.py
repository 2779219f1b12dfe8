"""What evaluation.json has to hold, and its reader: whatever passes here, tables and figures can be made of.

The file says its version since version 1. Those from before hold the same and are read where they are complete.
Version 2 has `gap_closed` in the summaries where the task hides the patient's plan, and says who was informed of it.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, Any, Self

from pydantic import AfterValidator, FailFast, Field, model_validator

from dms_core.errors import InputError
from dms_core.files.json_text import Each, brief, checked, read_json
from dms_core.validation import Checked

from ..comparison.evaluate import VERSION
from ..comparison.gap import GAP

BEFORE = "exo/ElbowLift-v0"
"""Environment of evaluations from before they said it."""
NEEDED = ("return", "unsafe")
"""Measures that every episode has, as numbers."""
NOT_SETTINGS = (
    "action_mode", "disable_env_checker", "environment", "id", "max_episode_steps", "observation", "options", "patient",
    "policy", "render_mode", "seed", "self",
)  # fmt: skip
"""What an environment is given beside the settings of an evaluation."""
Count = Annotated[int, Field(strict=True, ge=0)]
Number = Annotated[float, Field(strict=True)]
Measured = dict[str, Number | None]


def _needed(measures: dict[str, Any]) -> dict[str, Any]:
    for name in NEEDED:
        if measures.get(name) is None:
            raise ValueError(f"'{name}' is missing")
    return measures


def _settings(settings: dict[str, Any]) -> dict[str, Any]:
    often = settings.get("repetitions", 1)
    if type(often) is not int or often < 1:
        raise ValueError(f"repetitions = {brief(repr(often), 60)}: expected a whole number of at least 1")
    for name in NOT_SETTINGS:
        if name in settings:
            raise ValueError(f"'{name}' is no setting of an evaluation")
    return settings


class EstimateFields(Checked):
    """A statistic with its interval; null where it could not be measured."""

    value: Number | None
    low: Number | None
    high: Number | None
    count: Count

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        if self.low is not None and self.high is not None and self.low > self.high:
            raise ValueError(f"low = {self.low:g}: expected a number of at most {self.high:g}, the end of the interval")
        return self


class SummaryFields(EstimateFields):
    """An estimate, or the gap closed, which names whom it is between, or says why there is none."""

    opponent: str | None = None
    oracle: str | None = None
    reason: str | None = None


Summary = Annotated[dict[str, Any], Each(EstimateFields)]
WholeSummary = Annotated[dict[str, Any], Each(SummaryFields)]


class EpisodeFields(Checked):
    """An episode."""

    seed: Annotated[Count, Field(le=1 << 64)]
    event: str | None
    measures: Annotated[Measured, AfterValidator(_needed)]
    load: Number | None = None
    ability: Number = 1.0
    reference: dict[str, Any] = {}
    patient: dict[str, Any] = {}


class PolicyFields(Checked):
    """A policy's episodes, and what is estimated from them."""

    title: str = Field(min_length=1, max_length=300)
    training: str | None = None
    informed: bool = Field(default=False, strict=True, description="it saw the patient's plan")
    summary: Annotated[WholeSummary, AfterValidator(_needed)]
    summary_able: WholeSummary = {}
    difference: Summary = {}
    episodes: Annotated[list[Any], Field(min_length=1), Each(EpisodeFields)]


class EvaluationFields(Checked):
    """An evaluation."""

    version: int = Field(default=0, strict=True, ge=0)
    environment: str = Field(default=BEFORE, pattern="^[^:]*$", description="id; a module in a file would be run")
    population: str = Field(max_length=1000)
    patients: int = Field(strict=True, ge=1, le=10_000, description="intervals of more do not fit into a memory")
    seed: Count
    loads: Annotated[list[Number], FailFast()] = []
    settings: Annotated[dict[str, Any], AfterValidator(_settings)] = {}
    statistic: str
    confidence: float = Field(strict=True, gt=0.0, lt=1.0)
    resamples: Count = 0
    able: Number = 0.0
    left_out: dict[str, Annotated[list[str], FailFast()]] = {}
    policies: Annotated[dict[str, Any], Field(min_length=1), Each(PolicyFields)]


def read_evaluation(path: Path) -> dict[str, Any]:
    """What `evaluate` returned, NaN where something could not be measured.

    Raises:
        InputError: the file is not whole, or of a newer version; names file and key.
    """
    content, where = read_json(path), f"file '{path}'"
    version = content.get("version", 0) if isinstance(content, dict) else 0
    if isinstance(version, int) and version > VERSION:
        said = brief(str(version), 60)
        raise InputError(f"{where} is of version {said}: expected at most {VERSION}; install a newer exo-env.")
    checked(EvaluationFields, content, where)
    _check_cases(content, where)
    content.setdefault("environment", BEFORE)
    for policy in content["policies"].values():
        for kind in ("summary", "summary_able", "difference"):
            for estimate in policy.setdefault(kind, {}).values():
                estimate |= {k: math.nan if (v := estimate[k]) is None else float(v) for k in ("value", "low", "high")}
        for one in policy["episodes"]:
            # A whole number of JSON may be too large for NumPy's.
            one["measures"] = {k: None if v is None else float(v) for k, v in one["measures"].items()}
    return content


def _check_cases(content: dict[str, Any], where: str) -> None:
    """Every policy has the same patients, and each of its episodes the same measures."""
    per_patient = max(len(content.get("loads", ())), 1)
    cases = [one["seed"] for one in next(iter(content["policies"].values()))["episodes"]]
    if len(set(cases)) != content["patients"] or len(cases) != content["patients"] * per_patient:
        found, expected = f"{len(cases)} episodes of {len(set(cases))} patients", f"{per_patient} of each of"
        raise InputError(f"{where}: policies: {found}: expected {expected} {content['patients']}.")
    for name, policy in content["policies"].items():
        who = f"{where}: policies: {brief(name, 60)}"
        if [one["seed"] for one in policy["episodes"]] != cases:
            raise InputError(f"{who}: expected episodes of the same patients as of the first policy.")
        measures = policy["episodes"][0]["measures"].keys()
        for k, one in enumerate(policy["episodes"]):
            if one["measures"].keys() != measures:
                raise InputError(f"{who}: episodes: {k}: expected the measures of the first episode.")
        if not policy["summary"].keys() - {GAP} <= measures:
            raise InputError(f"{who}: summary: expected measures of the episodes.")
