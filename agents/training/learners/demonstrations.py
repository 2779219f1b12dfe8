"""What a teacher said in the last rounds of an imitation."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from dms_core.errors import InputError

COLUMNS = ("seen", "advice", "live")


class Demonstrations:
    """Rounds, each of one episode in each of some worlds.

    Args:
        kept: number of rounds that are kept, the last ones.
        shapes: of a round: decisions, worlds, what the student sees, actions.
    """

    def __init__(self, kept: int, shapes: tuple[int, int, int, int]) -> None:
        decisions, worlds, seen, actions = shapes
        self.kept = kept
        self.columns = {
            "seen": np.zeros((0, decisions, worlds, seen), np.float32),
            "advice": np.zeros((0, decisions, worlds, actions), np.float32),
            "live": np.zeros((0, decisions, worlds), bool),
        }
        """Rounds of what the student sees, as the worlds show it, of what the teacher would do, and of whether the
        world's episode was not over."""

    def add(self, seen: np.ndarray, advice: np.ndarray, live: np.ndarray) -> None:
        """One more round; what is older than those kept is forgotten."""
        for name, one in zip(COLUMNS, (seen, advice, live), strict=True):
            self.columns[name] = np.concatenate([self.columns[name], one[None]])[-self.kept :]

    def episodes(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """All that is kept, (decisions, episodes, ...): what the student sees, the advice, and what is live."""
        whole = {name: np.concatenate([*column], axis=1) for name, column in self.columns.items()}
        return whole["seen"], whole["advice"], whole["live"]

    def restore(self, arrays: Mapping[str, np.ndarray]) -> None:
        """Put back rounds that were stored.

        Raises:
            InputError: names the array that does not fit.
        """
        rounds = {len(arrays[name]) for name in COLUMNS if name in arrays and arrays[name].ndim > 0}
        for name, column in self.columns.items():
            known = arrays.get(name)
            fits = known is not None and known.shape[1:] == column.shape[1:] and known.dtype == column.dtype
            if known is None or not fits or len(rounds) > 1 or len(known) > self.kept or not np.isfinite(known).all():
                raise InputError(f"{name} does not fit")
        self.columns = {name: arrays[name] for name in COLUMNS}
