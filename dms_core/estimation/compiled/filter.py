"""The extended and iterated filter as compiled code on packed arrays, for filters that run beside a device.

It is the filter of kalman.py, with the same settings, but for what `cannot_be_compiled` names.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial

import numpy as np

from dms_core.assembly.model import Model
from dms_core.errors import SimulationError
from dms_core.estimation.compiled.arrays import CODE, FilterArrays
from dms_core.estimation.compiled.packed import PackedFilter
from dms_core.estimation.estimated import Belief
from dms_core.estimation.filter.charts import chart_with
from dms_core.estimation.filter.kalman import KalmanFilter
from dms_core.estimation.settings import FilterSettings

WHY = {
    CODE.unsolved: "the equations cannot be solved",
    CODE.steep: "the chart does not tell the motion",
    CODE.open: "no state on the constraints is near the corrected one",
    CODE.not_finite: "the covariance is not positive definite",
}


class CompiledFilter:
    """A filter whose step is one compiled call.

    Args:
        model: a compiled model; the numbers that are estimated are written into it.
        settings: of the filter; its period is that of every step.

    Raises:
        InputError: settings that this form does not have, or that do not fit the model.
    """

    def __init__(self, model: Model, settings: FilterSettings) -> None:
        self.kalman = KalmanFilter(model, settings)
        self.names = list(settings.channels)
        """Channels, in the order of readings."""
        self.packed = PackedFilter(self.kalman)
        self.begin(self.kalman.start())

    @property
    def arrays(self) -> FilterArrays:
        """What the filter believes and works with."""
        return self.packed.arrays

    def begin(self, belief: Belief) -> None:
        """Begin with a belief, in its own coordinates."""
        self.packed.load(belief)
        self.packed.aim(self.kalman.settings.period, self.kalman.settings.steps)

    def step(self, readings: Mapping[str, float]) -> None:
        """Predict over a period and take the readings at its end, by channel.

        A missing name and what is no finite number tell nothing. A channel's `delay` is that of records: here a reading
        counts as one of the present.

        Raises:
            InputError: the model has no sensor of a name.
            SimulationError: the filter cannot go on; `belief` is what it was before.
        """
        self._call(readings, True)

    def try_step(self, readings: Mapping[str, float]) -> bool:
        """As `step`, in compiled code alone; False where that cannot go on, and the filter is where it was before."""
        code, before = self._compiled(readings, True)
        if code != CODE.done:
            self.begin(before())
        return code == CODE.done

    def correct(self, readings: Mapping[str, float]) -> None:
        """Take readings at the present time.

        Raises:
            SimulationError: as `step`.
        """
        self._call(readings, False)

    def _call(self, readings: Mapping[str, float], moving: bool) -> None:
        """One compiled call; where that cannot go on, the same in Python."""
        code, before = self._compiled(readings, moving)
        if code != CODE.done:
            self.recover(code, before(), readings, moving)

    def _compiled(self, readings: Mapping[str, float], moving: bool) -> tuple[int, Callable[[], Belief]]:
        """One compiled call; gives its code, and the belief that was before."""
        before = self.keep()
        self.arrays.reading[:] = self.kalman.estimated.readings(readings)
        return self.packed.step() if moving else self.packed.correct(), before

    def keep(self) -> Callable[[], Belief]:
        """The present belief, which is made of copies of arrays when it is asked for."""
        world, now = self.kalman.world, self.arrays
        arrays = (world.state.q.copy(), world.state.v.copy(), now.rest.copy(), now.P.copy())
        return partial(self._belief, world.time, *arrays)

    def recover(self, code: int, before: Belief, readings: Mapping[str, float], moving: bool) -> None:
        """Go on from a belief in Python, with finer steps and a chart made anew, where compiled code could not.

        Raises:
            SimulationError: that fails too; the filter is where it was before.
        """
        self.packed.world.forget_numbers()
        try:
            here = before
            if moving:
                here = self.kalman.predict(before, before.t + self.kalman.settings.period).belief
            correction = self.kalman.correct(here, dict(readings))
        except (SimulationError, np.linalg.LinAlgError) as error:
            self.begin(before)
            raise SimulationError(f"compiled filter: {WHY[code]} behind t = {before.t:.6g} s: {error}") from None
        self.begin(correction.belief)
        self.arrays.nis[:] = correction.nis, len(correction.residual)

    def shown(self) -> tuple[np.ndarray, np.ndarray]:
        """What all channels should show at the present belief, biases included, and its covariance C P C^T.

        A channel of which no reading ever comes is a virtual sensor.

        Raises:
            SimulationError: no accelerations belong to the belief.
        """
        code, a = self.packed.expect(), self.arrays
        if code != CODE.done:
            raise SimulationError(f"compiled filter: {WHY[code]} at t = {self.kalman.world.time:.6g} s.")
        return a.expected.copy(), a.C @ a.P @ a.C.T

    def belief(self) -> Belief:
        """The present belief."""
        return self.keep()()

    def _belief(self, t: float, q: np.ndarray, v: np.ndarray, rest: np.ndarray, P: np.ndarray) -> Belief:
        """A belief in the coordinates that are chosen now."""
        return Belief(t, q, v, rest, chart_with(self.kalman.model, q, v, t, self.packed.chart.chosen), P)

    @property
    def nis(self) -> tuple[float, int]:
        """Of the last step, and its readings."""
        return float(self.arrays.nis[0]), int(self.arrays.nis[1])
