"""The extended filter as compiled code on packed arrays, for filters that run beside a device or an environment.

It is the filter of kalman.py, with the same settings, for models without drivers: no constants, bounds or other forms.
Noise of the motion is that of the chart at the start.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from dms_core.assembly.model import Model
from dms_core.assembly.tables import MODEL
from dms_core.compiled.arena import Packed, number
from dms_core.errors import InputError, SimulationError
from dms_core.estimation.estimated import Belief
from dms_core.estimation.filter.charts import chart_at, chart_with
from dms_core.estimation.filter.filter_step import CODE, FilterArrays, correct, filter_step, hold_inputs
from dms_core.estimation.filter.kalman import KalmanFilter
from dms_core.estimation.settings import FilterSettings
from dms_core.sensitivity.tangents.chart import new_chart
from dms_core.sensitivity.tangents.tables import new_columns, new_differentials

WHY = {
    CODE.unsolved: "the equations cannot be solved",
    CODE.steep: "the chart does not tell the motion",
    CODE.open: "no state on the constraints is near the corrected one",
    CODE.not_finite: "the covariance is not positive definite",
}


class CompiledFilter:
    """A filter whose step is one compiled call.

    Args:
        model: a compiled model.
        settings: of the filter; its period is that of every step.

    Raises:
        InputError: settings that this form does not have, or that do not fit the model.
    """

    def __init__(self, model: Model, settings: FilterSettings) -> None:
        if settings.constants or settings.bounds or settings.form != "extended":
            raise InputError(
                "compiled filter: Expected settings without constants and bounds and with form 'extended', got "
                f"{len(settings.constants)} constants, {len(settings.bounds)} bounds and form '{settings.form}'."
            )
        self.kalman = KalmanFilter(model, settings)
        if number(self.kalman.world.tables.table, MODEL.driven) > 0:
            raise InputError("compiled filter: Expected a model without drivers; use `KalmanFilter` for this one.")
        self.names = list(settings.channels)
        """Channels, in the order of readings."""
        self.begin(self.kalman.start())

    def begin(self, belief: Belief) -> None:
        """Begin with a belief, in the coordinates that tell its motion best."""
        self.kalman.put(belief)
        world, es, settings = self.kalman.world, self.kalman.estimated, self.kalman.settings
        model, period = world.model, settings.period
        self.chart = new_chart(model, belief.q)
        own = self._in_own_chart(belief)
        n_x, n, n_c = own.chart.size, len(own.P), len(self.names)
        n_y, n_q = len(model.layout.outputs), model.n_q
        rest, places = list(es.rest_names), np.array(es.inputs, np.int64)
        outputs = np.array([es.outputs[name] for name in self.names], np.int64)
        self.arrays = FilterArrays(
            rest=own.rest.copy(), mean=es.start, factor=es.factors(period), Q=es.noise(own.chart, period),
            P=own.P.copy(), A=np.zeros((n, n)), half=np.zeros((n, n)),
            rows=np.array([world.state.signals.ptr[k] for k in es.inputs], np.int64), places=places,
            outputs=outputs,
            R=np.array([settings.channels[name].variance for name in self.names]),
            bias=np.array([rest.index(f"bias.{x}") if x in es.biased else -1 for x in self.names], np.int64),
            turned=self.kalman.turned[outputs].astype(np.int64), C=np.zeros((n_c, n)),
            y=np.zeros(n_y), high=np.zeros(n_y), low=np.zeros(n_y), expected=np.zeros(n_c),
            reading=np.full(n_c, np.nan), x=np.zeros(n), gain=np.zeros(n), q=np.zeros(n_q), v=np.zeros(n_q),
            period=np.array([period, float(settings.steps)]), nis=np.zeros(2),
        )  # fmt: skip
        self.packed = Packed(self.arrays)
        self.columns = new_columns(model, n_x + len(places))
        self._differentials = new_differentials(model, world.tables.values, world.state.w)
        hold_inputs(world.packed.table, self.packed.table)

    def _in_own_chart(self, belief: Belief) -> Belief:
        """The belief in the coordinates that were chosen."""
        at = self.chart.values
        like = chart_at(self.kalman.model, belief.q, belief.v, belief.t)
        if not np.array_equal(like.chosen, at.chosen):
            raise SimulationError("two ways to choose coordinates differ at one state.")
        turn = np.eye(len(belief.P))
        turn[: like.size, : like.size] = like.read(belief.chart.dq, belief.chart.dv)
        return Belief(belief.t, belief.q, belief.v, belief.rest, like, turn @ belief.P @ turn.T)

    def step(self, readings: Mapping[str, float]) -> None:
        """Predict over a period and take the readings at its end, by channel; NaN and a missing name tell nothing.

        Raises:
            SimulationError: the filter cannot go on; `belief` is what it was before.
        """
        self._call(readings, True)

    def correct(self, readings: Mapping[str, float]) -> None:
        """Take readings at the present time.

        Raises:
            SimulationError: as `step`.
        """
        self._call(readings, False)

    def _call(self, readings: Mapping[str, float], moving: bool) -> None:
        """One compiled call; where that cannot go on, the same in Python, with finer steps and a chart made anew."""
        world, now = self.kalman.world, self.arrays
        kept = (world.time, world.state.q.copy(), world.state.v.copy(), now.rest.copy(), now.P.copy())
        now.reading[:] = [readings.get(name, np.nan) for name in self.names]
        m, s, o, sensing = world.tables.table, world.packed.table, world.numbers, world.model.sensing.table
        c, chart, f = self.columns.table, self.chart.table, self.packed.table
        if moving:
            code = filter_step(m, s, o, self._differentials.table, c, chart, sensing, f)
        else:
            code = correct(m, s, o, c, chart, sensing, f)
        if code == CODE.done:
            return
        before = self._belief(*kept)
        try:
            here = self.kalman.predict(before, before.t + self.kalman.settings.period).belief if moving else before
            correction = self.kalman.correct(here, dict(readings))
        except (SimulationError, np.linalg.LinAlgError) as error:
            self.begin(before)
            raise SimulationError(f"compiled filter: {WHY[code]} behind t = {before.t:.6g} s: {error}") from None
        self.begin(correction.belief)
        self.arrays.nis[:] = correction.nis, len(correction.residual)

    def belief(self) -> Belief:
        """The present belief."""
        world = self.kalman.world
        return self._belief(
            world.time, world.state.q.copy(), world.state.v.copy(), self.arrays.rest.copy(), self.arrays.P.copy()
        )

    def _belief(self, t: float, q: np.ndarray, v: np.ndarray, rest: np.ndarray, P: np.ndarray) -> Belief:
        """A belief in the coordinates that are chosen now."""
        return Belief(t, q, v, rest, chart_with(self.kalman.model, q, v, t, self.chart.values.chosen), P)

    @property
    def nis(self) -> tuple[float, int]:
        """Of the last step, and its readings."""
        return float(self.arrays.nis[0]), int(self.arrays.nis[1])
