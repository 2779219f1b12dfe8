"""What a report is made of: learning curves and evaluations, read from what trainings and evaluations left behind."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from dms_core.errors import InputError
from dms_core.files.json_text import brief

from ...environment import check_settings
from ...evaluation.comparison.evaluate import differences
from ...evaluation.comparison.pooling import pooled
from ...evaluation.figures.report_figures import Group
from ...evaluation.results.evaluation_file import read_evaluation
from ...training.files.records import RECORD, read_curve, read_record
from ...training.files.run_folder import CONFIG
from ...training.settings.config import Config

EVALUATION = "evaluation.json"


def collected(paths: Sequence[Path]) -> tuple[dict[Path, list[dict[str, Any]]], list[dict[str, Any]]]:
    """Learning curves by folder, and evaluations; those of the same patients are one.

    Raises:
        InputError: a path is neither, or a file is not whole.
    """
    if not paths:
        raise InputError("expected folders of trainings or evaluation.json files.")
    trainings: dict[Path, list[dict[str, Any]]] = {}
    evaluations: dict[tuple[Any, ...], dict[str, Any]] = {}
    for path in paths:
        if (path / RECORD).is_file():
            trainings[path] = read_curve(path)
        elif path.is_file() or (path / EVALUATION).is_file():
            one = read_evaluation(path if path.is_file() else path / EVALUATION)
            _check_settings(path, one)
            settings = json.dumps({"repetitions": 1} | one.get("settings", {}), sort_keys=True)
            key = (
                *(one[k] for k in ("environment", "population", "patients", "seed")), settings, *one.get("loads", ()),
                *(e["seed"] for e in next(iter(one["policies"].values()))["episodes"]),
            )  # fmt: skip
            known = evaluations.setdefault(key, {**one, "policies": {}})
            known["policies"] |= one["policies"]
        else:
            raise InputError(f"'{path}' is neither the folder of a training nor an evaluation.")
    for known in evaluations.values():
        known["policies"] |= pooled(known["policies"], known["seed"])
        first = next(iter(known["policies"].values()))["episodes"]
        for p in known["policies"].values():
            p["difference"] = differences(p["episodes"], first, known["seed"], p.get("trainings", 1))
    return trainings, list(evaluations.values())


def _check_settings(path: Path, one: Mapping[str, Any]) -> None:
    """Whether the environment takes the settings of an evaluation, before anything is drawn."""
    try:
        check_settings(one["environment"], one.get("settings", {}))
    except InputError as error:
        raise InputError(f"evaluation '{path}': {brief(str(error))}") from None


def grouped(trainings: Mapping[Path, list[dict[str, Any]]]) -> list[Group]:
    """Trainings of one configuration together."""
    alike: dict[str, list[Path]] = {}
    for path in trainings:
        content = Config.read(path / CONFIG).content()
        alike.setdefault(json.dumps(content, sort_keys=True), []).append(path)
    names = [read_record(paths[0])["algorithm"] for paths in alike.values()]
    groups = []
    for name, paths in zip(names, alike.values(), strict=True):
        label = name if names.count(name) == 1 else f"{name}, {paths[0].name}"
        groups.append(Group(label, [trainings[p] for p in paths if trainings[p]]))
    return [g for g in groups if g.curves]
