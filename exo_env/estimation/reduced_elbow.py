"""Numbers of the elbow's filter with one freedom (reduced_filter.py), from what a device takes for granted.

The nominal elbow is worn as it should be: elbow and hinge turn as one, so that its inertias and the cuff's lever are
the same at all angles, and its equations have an exact solution over a control period. With tau the time in which net
forgets, and net = n at the beginning,

    theta' += n tau (1 - e) / I,    theta += theta' T + n tau (T - tau (1 - e)) / I,    net = e n,    e = exp(-T / tau)

What depends on the angle, weight and strength, is a table.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.linalg import expm

from dms_core.model.muscles.activation import MINIMUM
from exo_env.ecosystem.ecosystem import Ecosystem
from exo_env.ecosystem.person import Person
from exo_env.estimation.reduced_filter import CURVES, NUMBERS
from exo_env.patient.excitation.motor_command import InternalModel
from exo_env.patient.excitation.static_optimisation import muscle_moment, needed_moment, with_weight
from exo_env.patient.patient import MIDDLE

FIRST, STEP, LAST = 0.0, math.radians(2.0), math.radians(144.0)
"""Angles of the table [rad]: between them moments err by less than 0.01 Nm."""
USUAL_LOAD = 1.25
"""Load that stands for an unknown one [kg]: the mean of what an environment draws, 0.5 to 2 kg."""
NEAR = 0.02
"""Distance from a stop at which the elbow may rest on it [rad]."""
USUAL_PERIOD = 0.02
"""Period up to which a reading tells what the moment does within it [s]."""
SMALLEST_NOISE = 1e-6
"""Least standard deviation that the filter believes of a sensor, as a part of a unit of it."""


class ReducedTuning(NamedTuple):
    """What the filter takes for granted of the unknown; chosen on patients of `mixed` and `wide`."""

    net_time: float = 0.08
    """In which the moment that moves the arm forgets [s]."""
    least: float = 0.03
    """Least size of that moment [Nm]; what it is of a patient is learnt."""
    memory: float = 0.1
    """Time over which that size is learnt [s]."""
    usual_net: float = 0.3
    """That size before anything of it is learnt [Nm]."""
    grip: float = 0.3
    """How far the moment between device and others walks in a second [Nm / sqrt s]."""
    grip_share: float = 2.0
    """That walk for each Nm that moves the arm, beside it [1 / sqrt s]."""
    inertia_doubt: float = 0.2
    """Deviation of a wearer's inertia from the nominal one, as a part of it."""
    slow_doubt: float = 1.4
    """Part of the moment that moves the arm by which others are unsure where readings are seldom, over the root of what
    their period has beyond the usual one [1 / sqrt s]."""
    cuff_frequency: float = 6.0
    """At which the arm swings in a compliant cuff [Hz]: that of most tremor."""
    weight_doubt: float = 0.2
    """The same of the forearm's moment by its weight."""
    intended_time: float = 0.2
    """In which the intended moment is forgotten [s]."""
    intended_least: float = 0.5
    """Least size of it [Nm]."""
    intended_share: float = 1.0
    """Its size over that of the moment that moves the arm, beside that [-]."""
    left: float = 0.4
    """Part of what holds arm and a usual load that the patient leaves to the device [-], of most patients."""
    left_deviation: float = 0.4
    """Its standard deviation among patients."""
    left_time: float = 20.0
    """In which it changes [s]."""
    load: float = USUAL_LOAD
    """Mean of the load [kg]."""
    load_deviation: float = 0.5
    """Standard deviation of the load [kg]: those 0.43 kg, and what is picked up beside."""
    stop_doubt: float = 5.0
    """Standard deviation of the moment of a stop on which the elbow rests [Nm]."""


class ReducedElbow(NamedTuple):
    """The arrays that the compiled filter reads."""

    numbers: np.ndarray
    """At the places of NUMBERS."""
    curves: np.ndarray
    """Table over the angle with the columns of CURVES, shape (k, 5)."""
    disturbance: np.ndarray
    """Covariance of angle, rate and net that a unit of net's power adds in a period, shape (3, 3)."""


def reduced_elbow(
    ecosystem: Ecosystem, period: float, noise: Sequence[float], person: Person | None = None,
    tuning: ReducedTuning | None = None,
) -> ReducedElbow:  # fmt: skip
    """The filter's numbers.

    Args:
        ecosystem: anatomy, device, cuff and machine; its person, weight and misalignment do not matter.
        period: between two readings [s].
        noise: standard deviation of angle [rad], rate [rad/s] and cuff's force [N], quantisation included.
        person: body that stands for everyone's; None: the average one of `Person`.
        tuning: what is taken for granted of the unknown.
    """
    t, device = tuning or ReducedTuning(), ecosystem.device
    nominal = ecosystem.changed(person=(person or Person()).model_dump())
    arm = nominal.arm()
    own, of_link = arm.inertia_about_elbow(), device.own_inertia()
    inertia = own + of_link
    by_net, disturbance = _over_a_period(period, t.net_time, inertia)
    machine = ecosystem.machine
    assert machine is not None
    curves = _curves(InternalModel.of(arm, machine, 0.0))
    by_left, of_load = _load_by_left(t, curves)
    low, high = (math.radians(x) for x in arm.within_stops(-180.0, 180.0))
    angle, rate, force = (max(x, SMALLEST_NOISE) ** 2 for x in noise)
    values = NUMBERS._replace(
        period=period, first_angle=FIRST, angle_step=STEP, arm_share=own / inertia, link_share=of_link / inertia,
        lever=device.guide_distance, handle_inertia=machine.handle.mass * float(arm.grip @ arm.grip),
        by_inertia=1.0 / inertia, angle_by_net=by_net[0], rate_by_net=by_net[1], net_keep=by_net[2],
        angle_noise=angle, rate_noise=rate, force_noise=force, start_angle=0.01, start_rate=0.05,
        start_net=t.usual_net, start_grip=20.0, least_power=t.least**2,
        learning=1.0 - math.exp(-period / t.memory), walk=t.grip, walk_share=t.grip_share,
        inertia_doubt=math.hypot(t.inertia_doubt, _further_doubt(ecosystem, period, own, t) * inertia / own),
        weight_doubt=t.weight_doubt,
        intended_keep=math.exp(-period / t.intended_time), intended_least=t.intended_least,
        intended_share=t.intended_share, left_keep=math.exp(-period / t.left_time), left_mean=t.left,
        left_deviation=t.left_deviation, load_mean=t.load, load_by_left=by_left, load_deviation=of_load,
        straight=low + NEAR, bent=high - NEAR, stop_doubt=t.stop_doubt,
    )  # fmt: skip
    return ReducedElbow(np.array(values, float), curves, disturbance)


def _further_doubt(ecosystem: Ecosystem, period: float, inertia: float, t: ReducedTuning) -> float:
    """Deviation of the moment of others over that which moves the arm, beside that by the inertia; of a device's own.

    In a compliant cuff of stiffness k at a distance d the forearm turns by F / (k d) less than the hinge, so that at a
    frequency w its acceleration is unsure by the part I_f w^2 / (k d^2) of what the cuff's moment changes. Where
    readings are seldom, nothing tells what the moment does between two of them. Both are 0 in a rigid guide with
    readings of 50 Hz and more.

    Args:
        ecosystem: has the cuff.
        period: between two readings [s].
        inertia: of the forearm about the elbow [kg m^2].
        t: what is taken for granted.
    """
    seldom = t.slow_doubt * math.sqrt(max(period - USUAL_PERIOD, 0.0))
    if ecosystem.cuff is None:
        return seldom
    stiffness = ecosystem.cuff.stiffness[0] * ecosystem.device.guide_distance**2
    return math.hypot(seldom, inertia * (2.0 * math.pi * t.cuff_frequency) ** 2 / stiffness)


def _over_a_period(period: float, tau: float, inertia: float) -> tuple[np.ndarray, np.ndarray]:
    """Column of A by net, shape (3,), and the covariance of a unit of net's power (Van Loan 1978), shape (3, 3)."""
    rates = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0 / inertia], [0.0, 0.0, -1.0 / tau]])
    white = np.diag([0.0, 0.0, 2.0 / tau])
    both = expm(period * np.block([[-rates, white], [np.zeros((3, 3)), rates.T]]))
    A = both[3:, 3:].T
    Q = A @ both[:3, 3:]
    return A[:, 2].copy(), np.ascontiguousarray(0.5 * (Q + Q.T))


def _load_by_left(t: ReducedTuning, curves: np.ndarray) -> tuple[float, float]:
    """What `left` says of the load, as a single reading at 60 deg: kg for each unit of it, and what stays unsure [kg].

    With own weight w, load L of deviation s and usual load L_0 the device is seen to hold
    left (w + L k) / (w + L_0 k) of what is usual; `left` is spread itself, and so is w.
    """
    own, kilogram = curves[round((MIDDLE - FIRST) / STEP)][[CURVES.own, CURVES.kilogram]]
    hold = own + t.load * kilogram
    told = t.left * kilogram / hold * t.load_deviation**2
    spread = t.left_deviation**2 + (t.left * kilogram / hold * t.load_deviation) ** 2
    spread += (t.left * t.weight_doubt * own / hold) ** 2
    return told / spread, math.sqrt(t.load_deviation**2 - told**2 / spread)


def _curves(model: InternalModel) -> np.ndarray:
    """Table of weight and strength over the angle, with the columns of CURVES."""
    arm, none = model.arm, model.load
    one = with_weight(none, 1.0)
    least = np.full(len(arm.sign), MINIMUM)
    rows = []
    for angle in np.arange(FIRST, LAST + 0.5 * STEP, STEP):
        own, lifted = (needed_moment(arm, load, angle, 0.0, 0.0) for load in (none, one))
        carried, swung = (needed_moment(arm, load, angle, 0.0, 1.0) for load in (none, one))
        most = (abs(muscle_moment(arm, angle, np.where(sign * arm.sign > 0.0, 1.0, least))) for sign in (1.0, -1.0))
        rows.append(CURVES._replace(
            own=own, kilogram=lifted - own, held_inertia=(swung - carried) - (lifted - own),
            flexors=next(most), extensors=next(most),
        ))  # fmt: skip
    return np.array(rows, float)
