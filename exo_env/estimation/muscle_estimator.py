"""The filter of a device with electrodes: activations, muscle forces, load and the muscles' moment.

Estimated are the state of `MuscleElbow`, the muscles' activations, what ropes and friction put on the link, a moment
that the model does not explain, and as constants the load, the forearm's mass and each muscle's largest force. The
largest forces begin with one doubt that they share, a person's strength, and one of their own.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from dms_core import Model
from dms_core.errors import InputError, SimulationError
from dms_core.estimation import Channel, CompiledFilter, EstimatedConstant, EstimatedInput, FilterSettings
from dms_core.estimation.estimated import Belief
from dms_core.estimation.settings import InitialDeviations, MotionNoise
from dms_core.model.muscles.activation import MINIMUM
from exo_env.ecosystem.arm import excitation_name, path_geometry
from exo_env.ecosystem.gym_machine import WEIGHT
from exo_env.ecosystem.sensors import muscle_sensor
from exo_env.estimation.elbow_estimator import ANGLE, GUIDE_FORCE, RATE, first_angle
from exo_env.estimation.muscle_elbow import DEVICE, REST, ROPE_TENSION, MuscleElbow

CELL = ROPE_TENSION
"""Channel of a load cell between handle and rope."""
LEAST_LOAD, LEAST = 0.05, 1.1 * MINIMUM
"""Least load [kg] and activation [-]: at the minimum of the muscle model nothing moves with it."""
FIBRE = 0.001
"""Deviation of a fibre's length at the start [m]: electrodes' noise moves the length at rest by some tenths of a mm."""
WEAKEST = 0.1
"""Least mass and strength, over those of the average man."""
SURE = 1e-4
"""Deviation of what is told, over what it is of what is not."""


def emg_channel(muscle: str) -> str:
    """Channel of a muscle's electrodes."""
    return muscle_sensor(muscle, "activation")


class MuscleTuning(NamedTuple):
    """What the filter takes for granted of the unknown; chosen on patients of `mixed` and `wide`."""

    activation: float = 0.08
    """How far an activation walks in a second [1 / sqrt s]."""
    emg: float = 0.03
    """Noise of an envelope [-]."""
    device: float = 20.0
    """How far the moment of the ropes walks in a second [Nm / sqrt s]."""
    rest: float = 0.3
    """Deviation of the moment that nothing explains [Nm]."""
    rest_time: float = 0.05
    """In which it forgets [s]."""
    load: float = 1.25
    """Mean of the load [kg]."""
    load_deviation: float = 0.5
    load_walk: float = 0.02
    """How far the load walks in a second [kg / sqrt s]."""
    mass_doubt: float = 0.2
    """Deviation of the forearm's mass, as a part of it."""
    strength: float = 0.85
    """Mean of the largest forces, over those of an average man."""
    strength_doubt: float = 0.3
    """Deviation of what all muscles share of it, as a part of it."""
    muscle_doubt: float = 0.02
    """Deviation of each muscle's own part: with a larger one each force is learnt too small, since noise of the
    electrodes is as large as most activations, and what goes with a noisy number seems to be less of it."""


class Known(NamedTuple):
    """What the device is told beside its readings."""

    load: bool = False
    strength: np.ndarray | None = None
    """Largest force of each muscle [N]."""


class MuscleEstimate(NamedTuple):
    """What a device with electrodes knows."""

    activations: np.ndarray
    """Shape (m,)."""
    forces: np.ndarray
    """Of the tendons [N], shape (m,)."""
    force_deviations: np.ndarray
    load: float
    """[kg]"""
    load_deviation: float
    moment: float
    """Of the muscles, into flexion [Nm]."""
    moment_deviation: float


class MuscleEstimator:
    """Filter of one device with electrodes on one arm.

    Args:
        elbow: what the device takes for granted.
        period: between two readings [s].
        tuning: noise of what is unknown.
        known: what it is told.
        steps: implicit steps of a period.
        like: an estimator whose orders of elimination are taken over.
    """

    def __init__(
        self, elbow: MuscleElbow, period: float, tuning: MuscleTuning | None = None, known: Known | None = None,
        steps: int = 1, like: MuscleEstimator | None = None,
    ) -> None:  # fmt: skip
        self.elbow, self.period, self.steps = elbow, period, steps
        self.tuning, self.known = tuning or MuscleTuning(), known or Known()
        self.arm = elbow.arm()
        self.muscles = self.arm.muscles
        if not (isinstance(steps, int | np.integer) and steps >= 1):
            raise InputError(f"muscle estimator: steps = {steps!r}: Expected a whole number of at least 1.")
        strength = self.known.strength
        if strength is not None and np.shape(strength) != (len(self.muscles),):
            raise InputError(
                f"muscle estimator: strength: Expected the largest force of each of {len(self.muscles)} muscles [N], "
                f"got shape {np.shape(strength)}."
            )
        self._first: int = 0
        """Place of the load among inputs and constants, once there was a reset."""
        self.lost = 0
        """Times that the equations could not be stepped, and fibres were put in balance with their tendons."""
        angles = np.radians(np.arange(-10.0, 160.0, 2.0))
        self._angles = angles
        self._levers = np.array([[elbow.lever(self.arm, m, x) for x in angles] for m in self.muscles])
        self._model: Model = like._model if like is not None else Model(elbow.system())
        self.filter: CompiledFilter

    def _settings(self) -> FilterSettings:
        """Settings of the filter."""
        t, forces = self.tuning, [muscle_sensor(m, "tendon_force") for m in self.muscles]
        channels = {
            ANGLE: Channel(deviation=2e-4, quantum=1.5e-3), RATE: Channel(deviation=0.02),
            GUIDE_FORCE: Channel(deviation=0.5), CELL: Channel(deviation=1.0),
            **{emg_channel(m): Channel(deviation=t.emg) for m in self.muscles},
            **{name: Channel(deviation=1.0) for name in forces},
        }  # fmt: skip
        drives = {excitation_name(m): EstimatedInput(deviation=0.1, walk=t.activation) for m in self.muscles}
        bounds: dict[str, tuple[float | None, float | None]] = {name: (LEAST, 1.0) for name in drives}
        bounds[f"{WEIGHT}.mass"] = (LEAST_LOAD, None)
        strongest = {m: self.arm.muscle(m).max_isometric_force for m in self.muscles}
        bounds |= {f"{m}.max_isometric_force": (WEAKEST * x, None) for m, x in strongest.items()}
        bounds["forearm.mass"] = (WEAKEST * self.arm.segments["forearm"].mass, None)
        walk = 0.0 if self.known.load else t.load_walk
        return FilterSettings(
            period=self.period, steps=self.steps, channels=channels,
            inputs={
                REST: EstimatedInput(deviation=t.rest, time_constant=t.rest_time),
                DEVICE: EstimatedInput(deviation=20.0, walk=t.device), **drives,
            },
            constants={
                f"{WEIGHT}.mass": EstimatedConstant(deviation=t.load_deviation, walk=walk),
                "forearm.mass": EstimatedConstant(deviation=t.mass_doubt * self.arm.segments["forearm"].mass),
                **{f"{m}.max_isometric_force": EstimatedConstant(deviation=1.0) for m in self.muscles},
            },
            noise=MotionNoise(rate=0.0),
            initial=InitialDeviations(position=0.01, velocity=0.05, state=FIBRE), bounds=bounds,
        )  # fmt: skip

    def reset(self, readings: Mapping[str, float], load: float | None = None) -> MuscleEstimate:
        """Begin with first readings, by channel, and the load where it is known [kg].

        Raises:
            InputError: the hinge's angle is missing, or a load that is to be known; of every other channel NaN tells
                nothing.
        """
        angle = first_angle(readings)
        if self.known.load and load is None:
            raise InputError("muscle estimator: Expected 'load' [kg] with the first readings, since it is to be known.")
        shown = np.nan_to_num([readings.get(emg_channel(m), math.nan) for m in self.muscles], nan=LEAST)
        start = np.clip(shown, LEAST, 1.0)
        weight = load if self.known.load and load is not None else self.tuning.load
        self._make(angle, weight, start)
        self._begin(self.filter.kalman.start())
        self.filter.correct(readings)
        return self._told()

    def _make(self, angle: float, load: float, activations: np.ndarray) -> None:
        """A filter that begins at rest, with fibres in balance with their tendons."""
        system = self.elbow.system(angle, load, activations)
        self.filter = CompiledFilter(Model(system, like=self._model), self._settings())

    def _anew(self, readings: Mapping[str, float]) -> None:
        """Begin at rest at the present hinge angle, with what is known beside the state, a period later."""
        belief = self.filter.belief()
        rest, n = belief.rest.copy(), len(belief.rest)
        known = (belief.P + self._joined(belief))[-n:, -n:]
        angle = readings.get(ANGLE, math.nan)
        self._make(angle if math.isfinite(angle) else self._angle, float(rest[self._first]), rest[2 : self._first])
        begun = self.filter.kalman.start()
        P = begun.P.copy()
        P[-n:, -n:] = known
        self.filter.begin(replace(begun, t=belief.t + self.period, P=P, rest=rest))

    def _balance(self) -> None:
        """A period without a step: put the fibres in balance with their tendons, and doubt what may have moved."""
        belief = self.filter.belief()
        q, v, index = belief.q.copy(), belief.v.copy(), self.filter.kalman.model.layout.index
        y, _ = self.filter.shown()
        for k, m in enumerate(self.muscles):
            length = path_geometry(self.arm, self.elbow.path(self.arm, m), float(y[0]))[0]
            place = index[f"{m}.fibre_length"]
            q[place], v[place] = self.elbow.muscle(self.arm, m).equilibrium(length, float(belief.rest[2 + k])), 0.0
        # The arm is left where it was, and may have gone on by what its rate tells; the fibres were moved by hand.
        chart, n = belief.chart, len(belief.chart.chosen)
        P = belief.P + self._joined(belief)
        P[np.arange(n), np.arange(n)] += (v[chart.chosen] * self.period) ** 2
        P[np.arange(2 * n, chart.size), np.arange(2 * n, chart.size)] += FIBRE**2
        self.filter.begin(replace(belief, t=belief.t + self.period, q=q, v=v, P=P))

    def _joined(self, belief: Belief) -> np.ndarray:
        """Covariance that joins in a period."""
        return self.filter.kalman.estimated.noise(belief.chart, self.period)

    def _begin(self, belief: Belief) -> None:
        """Begin with a belief in which the constants, and their covariance, are those before anything was read."""
        kalman, t = self.filter.kalman, self.tuning
        n = len(belief.P) - len(belief.rest)
        P, rest = kalman.estimated.first_covariance(belief.chart).copy(), belief.rest.copy()
        first = len(self.muscles) + 2
        forces = np.array([self.arm.muscle(m).max_isometric_force for m in self.muscles]) * t.strength
        spread = t.strength_doubt**2 + t.muscle_doubt**2 * np.eye(len(forces))
        P[n + first + 2 :, n + first + 2 :] = spread * np.outer(forces, forces)
        if self.known.strength is not None:
            forces = self.known.strength
            P[n + first + 2 :, n + first + 2 :] *= SURE**2
        if self.known.load:
            P[n + first, n + first] *= SURE**2
        rest[first + 2 :] = forces
        # Fibre and tendon are as strong as each other, so that the balance does not change with their largest force.
        self._first = first
        self.filter.begin(replace(belief, P=P, rest=rest))

    def update(self, readings: Mapping[str, float], load: float | None = None) -> MuscleEstimate:
        """Take the readings of the next period, by channel, NaN where there is none, and the load where it is known.

        Raises:
            InputError: there was no `reset` before.
        """
        if self._first == 0:
            raise InputError("muscle estimator: Expected 'reset' with first readings before 'update'.")
        a = self.filter.arrays
        if self.known.load and load is not None:
            a.rest[self._first] = load
            self.filter.packed.put_rest()
        try:
            if not self.filter.try_step(readings):
                self.lost += 1
                self._balance()
                self.filter.correct(readings)
            return self._told()
        except SimulationError:
            # Not even there have the fibres rates.
            self.lost += 1
            self._anew(readings)
        return self._told()

    def _told(self) -> MuscleEstimate:
        """What is known behind readings."""
        y, cov = self.filter.shown()
        m, a = len(self.muscles), self.filter.arrays
        forces, angle = y[-m:], y[0]
        self._angle = float(angle)
        levers = np.array([np.interp(angle, self._angles, row) for row in self._levers])
        k = len(a.P) - len(a.rest) + self._first
        return MuscleEstimate(
            y[4 : 4 + m].copy(), forces.copy(), np.sqrt(np.maximum(np.diag(cov)[-m:], 0.0)),
            float(a.rest[self._first]), math.sqrt(max(a.P[k, k], 0.0)), float(levers @ forces),
            math.sqrt(max(levers @ cov[-m:, -m:] @ levers, 0.0)),
        )  # fmt: skip
