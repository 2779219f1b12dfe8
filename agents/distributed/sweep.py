"""The trainings of a sweep: which there are, and one of them as a worker does it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from dms_core.errors import InputError

from ..training.files.records import RECORD, read_curve
from ..training.files.run_folder import RunFolder
from ..training.settings.config import Config
from ..training.settings.config_file import TRAINING
from ..training.usable import checked_config
from .variations import Variation, folder_of


def planned(
    configs: tuple[Path, ...],
    seeds: tuple[int, ...],
    changes: tuple[str, ...],
    out: Path,
    environment: str | None = None,
    variations: Sequence[Variation] = (),
) -> list[tuple[dict[str, Any], int, str]]:
    """Configuration, seed and folder of each training.

    Args:
        configs: files, each trained as it is.
        seeds: of the trainings.
        changes: values that replace those of all configurations.
        out: folder of the trainings.
        environment: id of the section to take of each file.
        variations: further configurations with changes of their own.

    Raises:
        InputError: a configuration is wrong, or two trainings would share a folder.
    """
    everyone = [*(Variation(path.stem, path) for path in configs), *variations]
    if not everyone or not seeds or min(seeds) < 0:
        raise InputError("expected one or more configurations, and seeds from 0.")
    shares = []
    for one in everyone:
        try:
            config = checked_config(one.config, (*one.changes, *changes), environment)
        except InputError as error:
            raise InputError(f"variation '{one.name}': {error}" if one.changes else str(error)) from None
        for seed in seeds:
            folder = folder_of(out, one.name, seed)
            shares.append((config.placed(folder, seed).content(), seed, str(folder)))
    folders = [folder for _, _, folder in shares]
    if len(set(folders)) < len(folders):
        raise InputError("two trainings would share a folder; give different seeds, and files of different names.")
    return shares


def in_order(shares: list[tuple[dict[str, Any], int, str]]) -> list[list[tuple[dict[str, Any], int, str]]]:
    """Trainings in groups: those of a group learn from others, as teacher or to begin with, of earlier groups only.

    Raises:
        InputError: trainings wait for each other.
    """
    groups, left = [], list(shares)
    while left:
        waiting = {folder for _, _, folder in left}
        group = [share for share in left if not _named_in(share[0]) & waiting]
        if not group:
            raise InputError(f"these trainings wait for each other: {', '.join(sorted(waiting))}.")
        groups.append(group)
        left = [share for share in left if share not in group]
    return groups


def _named_in(content: dict[str, Any]) -> set[str]:
    """Policies that a training learns from."""
    training = content[TRAINING]
    teacher = (training.get("imitation") or {}).get("teacher")
    return {name for name in (teacher, training.get("initial")) if name is not None}


def train_share(content: dict[str, Any], seed: int, folder: str) -> dict[str, Any]:
    """One training, from its start or from its last checkpoint; returns its best evaluation."""
    from ..evaluation.episodes.episode import judged
    from ..training.run import TrainingRun

    place = RunFolder(Path(folder))
    config = Config.of(content, "")
    known = (place.path / RECORD).is_file()
    if not known:
        place.check_new()
    with place.locked():
        if not known:
            place.begin(config, seed)
        else:
            begun, used = place.go_on(())
            if begun.content() != config.content() or used != seed:
                raise InputError(f"'{folder}' holds a training of another configuration; choose another --out.")
        run = TrainingRun(place, config, seed, lambda steps, evaluation: None, judged)
        run.run()
    return max(run.evaluations, key=lambda e: e["return"])


def steps_of(folder: Path) -> int:
    """How far a training is, as far as its last evaluation tells."""
    try:
        curve = read_curve(folder)
    except InputError:
        return 0
    return curve[-1]["steps"] if curve else 0
