"""Many filters of one model at once, stepped in compiled code on several threads, without the Python lock."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from itertools import pairwise

import numpy as np

from dms_core.assembly.model import Model
from dms_core.compiled.threads import Threads
from dms_core.errors import InputError, SimulationError
from dms_core.estimation.compiled.arrays import CODE
from dms_core.estimation.compiled.filter import CompiledFilter
from dms_core.estimation.compiled.step import step_some
from dms_core.estimation.estimated import finite_or_missing
from dms_core.estimation.settings import FilterSettings
from dms_core.validation import shown


class FilterBatch:
    """Filters side by side, each with a belief of its own; equal to single filters to the last bit.

    Args:
        model: a compiled model, that of the first filter; the others have models of the same system.
        settings: of all filters.
        size: number of filters.
        threads: that step them; None takes one for each core.

    Attributes:
        filters: the single filters, whose `begin` and `belief` may be used between steps.

    Raises:
        InputError: as `CompiledFilter`, or there is no filter to make.

    Example:
        >>> batch = FilterBatch(model, settings, 64)
        >>> batch.step(readings)                        # shape (64, channels)
        >>> batch.filters[3].belief().mean
    """

    def __init__(self, model: Model, settings: FilterSettings, size: int, threads: int | None = None) -> None:
        for name, number in (("size", size), ("threads", threads)):
            if number is not None and (not isinstance(number, int | np.integer) or number < 1):
                raise InputError(f"filter batch: {name} = {number!r}: Expected a whole number of at least 1.")
        # Constants are written into a model, so that each filter has its own.
        models = [model, *(Model(model.system, like=model) for _ in range(size - 1))]
        self.filters = [CompiledFilter(x, settings) for x in models]
        self._team = Threads(size, threads)

    @property
    def names(self) -> list[str]:
        """Channels, in the order of readings."""
        return self.filters[0].names

    def step(self, readings: np.ndarray) -> None:
        """Predict all filters over a period and take the readings at its end.

        Args:
            readings: of each filter's channels, NaN where there is none, shape (size, channels). What is no finite
                number tells nothing.

        Raises:
            InputError: readings of another shape.
            SimulationError: filters cannot go on (names them); they are where they were, and the others have stepped.
        """
        count = len(self.filters)
        try:
            y = np.ascontiguousarray(readings, float)
        except (TypeError, ValueError):
            raise InputError(
                f"filter batch: Expected readings as an array of numbers, got {shown(readings)}."
            ) from None
        if y.shape != (count, len(self.names)):
            raise InputError(
                f"filter batch: Expected readings of shape {(count, len(self.names))}, one row a filter and one column "
                f"each of {', '.join(self.names)}; got shape {y.shape}."
            )
        y = finite_or_missing(y)
        kept = [x.keep() for x in self.filters]
        addresses = np.array([x.packed.tables.table.ctypes.data for x in self.filters])
        codes, options = np.zeros(count, np.int64), self.filters[0].kalman.world.numbers
        ends = np.linspace(0, count, self._team.count + 1).astype(int).tolist()
        self._team.run([partial(step_some, addresses, options, y, *share, codes) for share in pairwise(ends)])
        lost = []
        for k in np.flatnonzero(codes != CODE.done).tolist():
            try:
                self.filters[k].recover(codes[k], kept[k](), self._by_name(y[k]), True)
            except SimulationError as error:
                lost.append(f"filter {k}: {error}")
        if lost:
            raise SimulationError(" ".join(lost))

    def _by_name(self, row: Sequence[float] | np.ndarray) -> Mapping[str, float]:
        """Readings of one filter by channel."""
        return dict(zip(self.names, map(float, row), strict=True))

    def close(self) -> None:
        """End the threads."""
        self._team.close()
