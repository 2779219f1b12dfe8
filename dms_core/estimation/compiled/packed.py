"""A Kalman filter's model, world and belief as the packed tables that compiled steps work on."""

from __future__ import annotations

import numpy as np

from dms_core.assembly.derivatives.parameter_derivatives import Direction, declared_number
from dms_core.assembly.tables import MODEL
from dms_core.compiled.arena import Packed, number
from dms_core.errors import InputError
from dms_core.estimation.compiled.arrays import FilterArrays, FilterTables
from dms_core.estimation.compiled.correction import correct
from dms_core.estimation.compiled.numbers import put_rest, straight_directions
from dms_core.estimation.compiled.prediction import predict
from dms_core.estimation.compiled.reading import expect
from dms_core.estimation.compiled.step import filter_step
from dms_core.estimation.estimated import Belief
from dms_core.estimation.filter.charts import Chart, chart_at
from dms_core.estimation.filter.kalman import KalmanFilter
from dms_core.sensitivity.tangents.chart import packed_chart
from dms_core.sensitivity.tangents.reading_tables import SomeReadings, calls_of, reads_welds
from dms_core.sensitivity.tangents.tables import new_columns, new_differentials, new_movement


def cannot_be_compiled(kalman: KalmanFilter, directions: list[Direction] | None) -> str | None:
    """What of a filter compiled steps do not have, in words; None for nothing.

    Args:
        kalman: the filter.
        directions: what its constants move, as `straight_directions` gives it.
    """
    model, es = kalman.model, kalman.estimated
    rows = _rows(kalman)
    through = model.derivatives.inputs.moments_read(rows.tolist()) & set(es.inputs)
    if kalman.settings.form == "unscented":
        return "form 'unscented', which takes runs instead of derivatives"
    if number(kalman.world.tables.table, MODEL.driven) > 0:
        return "a model with drivers"
    if through or reads_welds(model, calls_of(model, rows.tolist())):
        return "a channel that shows a reaction between welded bodies, or the moment of an estimated input itself"
    if directions is None:
        return "a constant that moves a constraint, or that moves the numbers of a kernel not in a straight line"
    return None


def _rows(kalman: KalmanFilter) -> np.ndarray:
    """Components of the sensors that are read, rising, shape (channels,)."""
    return np.array(sorted(kalman.estimated.outputs[name] for name in kalman.settings.channels))


class PackedFilter:
    """Packed tables of one filter.

    Args:
        kalman: a filter.

    Raises:
        InputError: `cannot_be_compiled` has something to say of it.

    Attributes:
        arrays: what the filter believes and works with.
        tables: all that a compiled step needs.
    """

    def __init__(self, kalman: KalmanFilter) -> None:
        self.kalman = kalman
        self.world = kalman.world
        directions = straight_directions(kalman.model, kalman.estimated.constants)
        lacking = cannot_be_compiled(kalman, directions)
        if lacking is not None or directions is None:
            raise InputError(f"compiled filter: it does not have {lacking}. Use `KalmanFilter` for this one.")
        self._directions: list[Direction] = directions
        self._chart: Chart | None = None
        self._world_tables: Packed | None = None
        self.arrays: FilterArrays
        self.tables: Packed

    def load(self, belief: Belief) -> None:
        """Go to a belief, in its own coordinates."""
        world, es = self.world, self.kalman.estimated
        world.put(belief.q, belief.v, belief.t)
        world.put_inputs(self.kalman.known)
        if not self._serves(belief.chart):
            self._pack(belief.chart)
        self.arrays.rest[:], self.arrays.P[:], self.arrays.mean[:] = belief.rest, belief.P, es.start
        self.put_rest()

    def _serves(self, chart: Chart) -> bool:
        """Whether the tables are those of these coordinates, and of the present orders of elimination."""
        known = self._chart
        if known is None or self._world_tables is not self.world.tables:
            return False
        return np.array_equal(known.chosen, chart.chosen) and np.array_equal(known.rows, chart.rows)

    def put_rest(self) -> None:
        """Inputs and constants of the rest into what the equations read."""
        self.world.forget_numbers()
        put_rest(self.tables.table)

    def aim(self, dt: float, steps: int) -> None:
        """Let steps lead over a time [s]."""
        self.arrays.period[:] = dt, steps
        self.arrays.factor[:] = self.kalman.estimated.factors(dt)
        self.arrays.Q[:] = self.kalman.estimated.noise(self.chart, dt)

    @property
    def chart(self) -> Chart:
        """Which coordinates are independent."""
        assert self._chart is not None
        return self._chart

    def predict(self) -> int:
        """Over the time that was aimed at; gives a code."""
        return predict(self.tables.table, self.world.numbers)

    def correct(self) -> int:
        """By the readings; gives a code."""
        return correct(self.tables.table, self.world.numbers)

    def expect(self) -> int:
        """What the channels should show; gives a code."""
        return expect(self.tables.table)

    def step(self) -> int:
        """Both; gives a code."""
        return filter_step(self.tables.table, self.world.numbers)

    def belief(self, t: float | None = None) -> Belief:
        """The present belief, in the coordinates in which it was loaded."""
        state, model = self.world.state, self.kalman.model
        at = self.world.time if t is None else t
        chart = chart_at(model, state.q, state.v, at, self._chart, keep=True)
        q, v = state.q.copy(), state.v.copy()
        return Belief(at, q, v, self.arrays.rest.copy(), chart, self.arrays.P.copy())

    def _pack(self, chart: Chart) -> None:
        """Tables for these coordinates, and for the orders of elimination that the world has now."""
        world, kalman = self.world, self.kalman
        model, es, settings, names = world.model, kalman.estimated, kalman.settings, list(kalman.settings.channels)
        self._chart, self._world_tables = chart, world.tables
        if es.constants:
            # Sides and slopes are taken about the declared numbers.
            world.forget_numbers()
            world.put_numbers({})
        n, n_k, n_z = chart.size + len(es.rest_names), len(es.constants), len(chart.chosen)
        movements = [new_movement(world.tables.values, x) for x in self._directions]
        readings = SomeReadings(model, _rows(kalman).tolist(), world.state.w, self._directions)
        columns = new_columns(model, chart.size + len(es.inputs) + n_k)
        columns.values.parameter[chart.size + len(es.inputs) :] = np.arange(n_k)
        outputs, rest = np.array([es.outputs[name] for name in names]), list(es.rest_names)
        bounds, (by, sensors_by) = es.bounds(chart), self._slopes(readings)
        intensity = es.intensities**2 if es.intensities[model.second_order].any() else np.zeros(0)
        vectors = {name: np.zeros(n) for name in ("x", "gain", "left", "start")}
        square = {name: np.zeros((n, n)) for name in ("Q", "P", "A", "half", "P_start")}
        small = {name: np.zeros((n_z, n_z)) for name in ("gram", "driven")}
        self.arrays = FilterArrays(
            **vectors, **square, **small, rest=es.start, mean=es.start, factor=np.ones(len(rest)),
            rows=np.array([world.state.signals.ptr[k] for k in es.inputs], np.int64),
            places=np.array(es.inputs, np.int64),
            R=np.array([settings.channels[name].variance for name in names]),
            bias=np.array([rest.index(f"bias.{x}") if x in es.biased else -1 for x in names], np.int64),
            turned=kalman.turned[outputs].astype(np.int64),
            found_at=np.searchsorted(_rows(kalman), outputs).astype(np.int64),
            C=np.zeros((len(names), n)), expected=np.zeros(len(names)), innovation=np.zeros(len(names)),
            reading=np.full(len(names), np.nan), q=np.zeros(model.n_q), v=np.zeros(model.n_q), begin=np.zeros(1),
            intensity=intensity, order=np.zeros(n_z, np.int64),
            bounded=np.array([k for k, _, _ in bounds], np.int64), least=np.array([x for _, x, _ in bounds], float),
            most=np.array([x for _, _, x in bounds], float),
            declared=np.array([declared_number(model.system, *key) for key in es.constants], float),
            base=world.declared_numbers[0].copy(), by_constants=by,
            sensor_base=readings.packed.values.sensing.sensors.values.par.copy(), sensors_by_constants=sensors_by,
            period=np.zeros(2), iterated=np.array([int(settings.form == "iterated")], np.int64), nis=np.zeros(2),
        )  # fmt: skip
        self._kept = [movements, readings]
        self.tables = Packed(FilterTables(
            world.tables, world.packed, new_differentials(model, world.tables.values, world.state.w, movements),
            columns, packed_chart(model, chart.chosen, chart.rows), readings.packed, Packed(self.arrays),
        ))  # fmt: skip

    def _slopes(self, readings: SomeReadings) -> tuple[np.ndarray, np.ndarray]:
        """Numbers of dynamic calls and of the sensors that are read, by each constant."""
        sensors = readings.packed.values.sensing.sensors.values.par
        n_k = len(self.kalman.estimated.constants)
        by, sensors_by = np.zeros((n_k, len(self.world.declared_numbers[0]))), np.zeros((n_k, len(sensors)))
        for k in range(n_k):
            direction, sides = self._directions[k], readings.moved[k].values
            by[k] = direction.dynamics / direction.step
            ends = [side.sensors.values.par for side in (sides.high, sides.low)]
            sensors_by[k] = 0.5 * (ends[0] - ends[1]) / direction.step
        return by, sensors_by
