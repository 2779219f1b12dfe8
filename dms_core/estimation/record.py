"""Estimation along a record: the filter from reading to reading, what it says where it diverges, and its table."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from dms_core.errors import InputError, SimulationError
from dms_core.estimation.estimated import Belief
from dms_core.estimation.filter.kalman import KalmanFilter
from dms_core.estimation.filter.nominal_world import held_input
from dms_core.estimation.filter.smoother import smoothed
from dms_core.estimation.filter.steps import Step
from dms_core.estimation.measurement import Measurements
from dms_core.estimation.unlearnt import check_learnt
from dms_core.files.output_file import with_unit

SAME_TIME = 1e-9
"""Time by which two readings may lie apart and still be of one time [s]."""
MOST_EVENTS = 1_000_000
"""Most times of a record, those between its readings included."""
WINDOW, LOST = 20, 100.0
"""Corrections in a row whose mean NIS, over its expected value, tells that a filter has lost the motion."""


@dataclass(frozen=True)
class Event:
    """A time at which something is known or asked for."""

    t: float
    readings: dict[str, float]
    inputs: dict[int, float]


@dataclass(frozen=True)
class Divergence:
    """A place at which a filter gave up and began anew from its last good state."""

    t: float
    """Time [s]."""
    since: float
    """Time of the last good state [s]."""
    why: str

    @property
    def sentence(self) -> str:
        """For the user."""
        return (
            f"The filter diverged at t = {self.t:.6g} s: {self.why.rstrip('.')}. It resumed from its state at "
            f"{self.since:.6g} s with the covariance of the start added."
        )


@dataclass(frozen=True)
class Estimate:
    """What a record tells."""

    kalman: KalmanFilter
    steps: tuple[Step, ...]
    beliefs: tuple[Belief, ...]
    """Filtered, or smoothed where that was asked for."""
    diverged: tuple[Divergence, ...]

    @property
    def t(self) -> np.ndarray:
        """Times [s], shape (k,)."""
        return np.array([step.belief.t for step in self.steps])

    @property
    def nis(self) -> np.ndarray:
        """Normalised innovation squared, 0 where nothing was read, shape (k,)."""
        return np.array([step.nis for step in self.steps])

    @property
    def readings(self) -> np.ndarray:
        """Number of readings, the expected value of `nis`, shape (k,)."""
        return np.array([step.readings for step in self.steps])

    def rest(self, name: str) -> tuple[np.ndarray, np.ndarray]:
        """An input, constant or bias with its standard deviation, shape (k,) each, by 'input.<name>' and so on."""
        k = self.kalman.estimated.rest_names.index(name) - len(self.kalman.estimated.rest_names)
        return np.array([b.rest[k] for b in self.beliefs]), np.array([b.deviations[k] for b in self.beliefs])

    def columns(self, progress: Callable[[float], None] | None = None) -> dict[str, np.ndarray]:
        """Time, sensors, coordinates, rates, inputs, constants and biases, each with its deviation, and NIS."""
        layout, n = self.kalman.model.layout, self.kalman.model.n_q
        heads = [
            *(with_unit(name, unit) for name, unit in layout.outputs),
            *(f"{kind}.{name}" for kind in "qv" for name in layout.names), *self.kalman.estimated.rest_names,
        ]  # fmt: skip
        values, deviations = np.zeros((len(self.beliefs), len(heads))), np.zeros((len(self.beliefs), len(heads)))
        for k, (belief, step) in enumerate(zip(self.beliefs, self.steps, strict=True)):
            self.kalman.hold(step.known)
            out = self.kalman.read_out(belief)
            by = np.vstack([out.C, *belief.columns, np.eye(len(belief.P))[belief.chart.size :]])
            # Rates of first-order states belong to the state that was just read.
            values[k] = np.concatenate([out.y, belief.q, self.kalman.world.state.v, belief.rest])
            deviations[k] = np.sqrt(np.maximum(np.einsum("ij,jk,ik->i", by, belief.P, by), 0.0))
            if progress is not None:
                progress(belief.t)
        first = len(layout.outputs) + n + np.flatnonzero(~self.kalman.model.second_order)
        told = [k for k in range(len(heads)) if k not in set(first.tolist())]
        found = {"time_s": self.t}
        found |= {head: values[:, k] for k, head in enumerate(heads)}
        found |= {f"deviation.{heads[k]}": deviations[:, k] for k in told}
        return {**found, "nis": self.nis, "readings": self.readings.astype(float)}


def events(measurements: Measurements, kalman: KalmanFilter) -> list[Event]:
    """Readings by the time that they tell of, known inputs, and times between so that no period is too long.

    A reading of a channel with delay d, stamped t, tells of t - d; what it tells of before 0 is left out.

    Raises:
        InputError: there would be more of them than memory and patience hold.
    """
    settings, layout = kalman.settings, kalman.model.layout
    at: dict[float, Event] = {}
    for k, t in enumerate(measurements.t):
        for name, values in measurements.inputs.items():
            if not np.isnan(values[k]):
                _event(at, float(t)).inputs[layout.input_index[name]] = float(values[k])
        for j, name in enumerate(measurements.channels):
            told = float(t) - settings.channels[name].delay if name in settings.channels else -1.0
            if told >= 0.0 and not np.isnan(measurements.y[k, j]):
                _event(at, told).readings[name] = float(measurements.y[k, j])
    found = sorted(at.values(), key=lambda event: event.t)
    whole: list[Event] = []
    for event in found:
        if whole:
            before = whole[-1].t
            gap = (event.t - before) / settings.period
            if len(whole) + gap > MOST_EVENTS:
                raise InputError(
                    f"measurements: from {before:.6g} to {event.t:.6g} s nothing is told, which are {gap:.3g} periods "
                    f"of {settings.period:g} s; expected at most {MOST_EVENTS:,} periods in a record. Cut it, or "
                    "take a longer period."
                )
            parts = int(np.ceil(gap * (1.0 - 1e-9)))
            whole += [Event(before + (event.t - before) * i / parts, {}, {}) for i in range(1, parts)]
        whole.append(event)
    return whole


def _event(at: dict[float, Event], t: float) -> Event:
    """The event of a time, made where there is none."""
    key = round(t / SAME_TIME)
    return at.setdefault(key, Event(t, {}, {}))


def estimate(
    kalman: KalmanFilter,
    measurements: Measurements,
    start: Belief | None = None,
    *,
    smooth: bool = False,
    progress: Callable[[float], None] | None = None,
) -> Estimate:
    """The estimate along a record.

    Args:
        kalman: filter of a model.
        measurements: readings of its channels, and of inputs that are known.
        start: belief at the first reading; default: the model's start with the covariance of the settings.
        smooth: give what the whole record tells of each time (smoother.py), not only what is before it.
        progress: called with the time reached.

    Raises:
        InputError: nothing was measured, or an estimated input, constant or bias is not told by the record.
        SimulationError: the filter diverged at every reading.
    """
    _check_inputs(kalman, measurements)
    _hold_declared(kalman, measurements)
    timeline = events(measurements, kalman)
    if not any(event.readings for event in timeline):
        raise InputError(f"measurements: no reading of {', '.join(kalman.settings.channels)} was found.")
    steps, diverged = _filtered(kalman, timeline, start, progress)
    check_learnt(kalman, [step.belief for step in steps])
    beliefs = smoothed(kalman, steps) if smooth else [step.belief for step in steps]
    return Estimate(kalman, tuple(steps), tuple(beliefs), tuple(diverged))


def _check_inputs(kalman: KalmanFilter, measurements: Measurements) -> None:
    """Refuse a known input that is estimated too, or that cannot be held."""
    for name in measurements.inputs:
        held_input(kalman.model, name, "measurements")
        if name in kalman.settings.inputs:
            raise InputError(f"inputs: '{name}' is estimated, but the measurements tell it; leave one of both out.")


def _hold_declared(kalman: KalmanFilter, measurements: Measurements) -> None:
    """Known inputs as they are declared, until the record tells them."""
    inputs = kalman.model.system.inputs
    for name in measurements.inputs:
        k = kalman.model.layout.input_index[name]
        kalman.hold({k: float(inputs[k].signal.value)})


def _filtered(
    kalman: KalmanFilter, timeline: list[Event], start: Belief | None, progress: Callable[[float], None] | None
) -> tuple[list[Step], list[Divergence]]:
    """Steps of the filter over all events."""
    belief = kalman.start(timeline[0].t) if start is None else start
    steps: list[Step] = []
    diverged: list[Divergence] = []
    good, recent = belief, list[tuple[float, int]]()
    kalman.hold(timeline[0].inputs)
    for event in timeline:
        try:
            step = _step(kalman, belief, event, bool(steps))
            recent = [*recent, (step.nis, step.readings)][-WINDOW:] if step.readings else recent
            if len(recent) == WINDOW and sum(x for x, _ in recent) > LOST * sum(n for _, n in recent):
                recent = []
                raise SimulationError(
                    f"in {WINDOW} corrections in a row readings differ from what was expected by more than "
                    f"{LOST**0.5:.2g} times what their covariance allows"
                )
            good = step.belief
        except (SimulationError, np.linalg.LinAlgError, ValueError) as error:
            diverged.append(Divergence(event.t, good.t, str(error)))
            wide = replace(good, t=event.t, P=good.P + kalman.estimated.first_covariance(good.chart))
            wide = kalman.moved(wide, wide.mean)
            step = Step(wide, wide, None, 0.0, 0, dict(kalman.known))
        steps.append(step)
        belief = step.belief
        kalman.hold(event.inputs)
        if progress is not None:
            progress(event.t)
    if diverged and not any(step.readings for step in steps):
        raise SimulationError(f"the filter diverged at every reading. {diverged[0].sentence}")
    return steps, diverged


def _step(kalman: KalmanFilter, belief: Belief, event: Event, moving: bool) -> Step:
    """From one event to the next."""
    joint, here = None, belief
    if moving and event.t > belief.t:
        predicted = kalman.predict(belief, event.t)
        joint, here = predicted.joint, predicted.belief
    correction = kalman.correct(here, event.readings)
    if not np.isfinite(correction.nis):
        raise SimulationError("the innovation is not finite")
    return Step(correction.belief, here, joint, correction.nis, len(correction.residual), dict(kalman.known))
