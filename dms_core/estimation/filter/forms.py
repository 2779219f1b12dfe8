"""Which filter does what settings ask for: compiled steps where they can, and the formulas in Python elsewhere."""

from __future__ import annotations

import numpy as np

from dms_core.assembly.model import Model
from dms_core.errors import SimulationError
from dms_core.estimation.compiled.arrays import CODE
from dms_core.estimation.compiled.numbers import straight_directions
from dms_core.estimation.compiled.packed import PackedFilter, cannot_be_compiled
from dms_core.estimation.estimated import Belief
from dms_core.estimation.filter.gaussian import is_usable
from dms_core.estimation.filter.kalman import Correction, KalmanFilter, Predicted
from dms_core.estimation.filter.unscented import UnscentedFilter
from dms_core.estimation.settings import FilterSettings


class CompiledKalmanFilter(KalmanFilter):
    """As `KalmanFilter`, by compiled steps; where one of them cannot go on, in Python.

    Args:
        model: a compiled model; the numbers that are estimated are written into it.
        settings: of the filter.

    Raises:
        InputError: compiled steps do not have what the settings ask for (`cannot_be_compiled`).
    """

    def __init__(self, model: Model, settings: FilterSettings) -> None:
        super().__init__(model, settings)
        self._packed = PackedFilter(self)

    def predict(self, belief: Belief, t: float) -> Predicted:
        """A belief at a later time [s].

        Raises:
            SimulationError: the equations cannot be solved on the way.
        """
        packed = self._packed
        packed.load(belief)
        packed.aim(t - belief.t, self._steps(t - belief.t))
        if packed.predict() != CODE.done:
            self.world.forget_numbers()
            return super().predict(belief, t)
        A = packed.arrays.A.copy()
        return Predicted(packed.belief(t), belief.P @ A.T, A)

    def correct(self, belief: Belief, readings: dict[str, float]) -> Correction:
        """The belief behind readings of channels, as `KalmanFilter.correct`.

        Raises:
            SimulationError: no state on the constraints is near the corrected one, or the result is not finite.
        """
        packed, names = self._packed, list(self.settings.channels)
        y = np.array([readings.get(name, np.nan) for name in names])
        told = ~np.isnan(y)
        if not told.any():
            return Correction(belief, 0.0, np.zeros(0))
        packed.load(belief)
        packed.arrays.reading[:] = y
        if packed.correct() != CODE.done:
            self.world.forget_numbers()
            return super().correct(belief, readings)
        found = packed.belief(belief.t)
        if not (is_usable(found.P) and np.isfinite(found.mean).all()):
            raise SimulationError(f"the covariance is not positive definite at t = {belief.t:.6g} s.")
        return Correction(found, float(packed.arrays.nis[0]), packed.arrays.innovation[told].copy())


def filter_of(model: Model, settings: FilterSettings) -> KalmanFilter:
    """The filter of the form that the settings ask for, compiled where that can be."""
    if settings.form == "unscented":
        return UnscentedFilter(model, settings)
    kalman = KalmanFilter(model, settings)
    directions = straight_directions(model, kalman.estimated.constants)
    return kalman if cannot_be_compiled(kalman, directions) else CompiledKalmanFilter(model, settings)
