"""From the motor command of a patient to the excitations of the muscles, in ticks of the patient's own clock.

For muscle k of group g (flexors: sign +1, extensors: -1), with the wanted activations a_k of the motor command:

    c_k = delayed(s a_k, neural delay) + sign (feedback_gain + feedback_scaling A) y^      what is intended, at least 0
    A = mean(maximum_activation M_A) / (1 + (psi' / 1 rad/s)^2)                            of the group with more of it
    T_k = (c_k + co_contraction mean(c of the other group)) / maximum_activation_g         wanted share, at most 1,
          with c of the other group up to its maximum_activation
    d_k = maximum_activation_g min(T_k, 1 - M_F,k)                                         voluntary drive
          + delayed(reflex of stretch rate and length, stretch delay)                      stretch_reflex.py
          + sign tremor_amplitude sin(phase)                                               tremor
    u_k = delayed(d_k, electromechanical delay), within 0.01 to 1

s is the effort (slacking.py), A the activity of who holds, M_A and M_F the active and the fatigued share (fatigue.py),
y^ the error with its lead, which is felt late and predicted from there to now (forward_model.py). Weakness is a
ceiling, since what was measured after stroke is the largest torque: who is weak wants a larger share of what is left
for the same moment, and gives it up to all of it. That patients know their weakness so well is assumed; the rest of it
they learn by their errors (s above 1). Weakness is of the descending command: reflex and tremor know no ceiling. Tremor
alternates between the groups and its phase wanders with 2 pi frequency dt + sqrt(2 pi width dt) N(0, 1), which makes a
spectral peak of that width at half height.

A patient acts every TICK, whatever the control rate of the device is: 50 times a second, of the order of the fastest
firing of single units (31 +- 10 Hz, Bellemare et al. 1983, J. Neurophysiol. 50:1380-1392); a muscle, whose units fire
at different times, is told more than that, which activation filters. The quickest reflex of the elbow is as late as one
tick. Signals are linear between ticks, and so is the excitation that reaches the muscles. The motor command is known
beforehand and taken at the end of the tick; what is felt (error, stretch) is known at its beginning, so that a delay
shorter than a tick counts as one. A patient is a row of numbers (`PATIENT` in patient.py) and an `EffortState`; the
functions neither allocate nor draw random numbers, so that a batch can run them.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from dms_core.compiled.jit import compiled
from dms_core.model.muscles.activation import MINIMUM, limited
from exo_env.clearing import Cleared, Filled, Kept
from exo_env.patient.excitation.fatigue import advance_fatigue
from exo_env.patient.excitation.forward_model import LIMB, advance_limb
from exo_env.patient.excitation.slacking import advance_effort
from exo_env.patient.excitation.stretch_reflex import stretch_reflex
from exo_env.patient.patient import LONGEST_DELAY, PATIENT
from exo_env.places import places

HOLDING = 1.0
"""Planned rate at which half of the gain by activity is left [rad/s]: an elbow that moves is softer than one that holds
(Bennett 1993); chosen so that it stays within the stiffness measured there."""
TICK = 0.02
"""Time from one act of a patient to the next [s]."""

PRESENT = places(("newest", "phase", "effort"))
"""Places in `EffortState.present`."""


class EffortState(NamedTuple):
    """The state of a patient with m muscles whose memory holds n samples of each signal."""

    sign: Kept
    """+1 for a flexor, -1 for an extensor, shape (m,)."""
    present: Cleared
    """Place of the newest sample in every memory, phase of the tremor [rad], and the effort s [-], shape (3,)."""
    active: Cleared
    """M_A of each muscle [-], shape (m,)."""
    fatigued: Cleared
    """M_F of each muscle [-], shape (m,)."""
    command: Cleared
    """Past samples of the command times the effort, s a_k [-], a ring of shape (n,) for each muscle, shape (m, n)."""
    drive: Cleared
    """Past samples of d_k [-], shape (m, n)."""
    reflex: Cleared
    """Past samples of the stretch reflex [-], shape (m, n)."""
    error: Cleared
    """Past samples of the error with its lead, y [rad], shape (1, n)."""
    limb: Cleared
    """The patient's model of the limb, at the places of LIMB in forward_model.py."""
    levers: Cleared
    """Moment of each muscle at full activation that the model counts with [Nm], shape (m,)."""
    copy: Cleared
    """Past samples of the moment that the feedback commands, u [Nm], shape (1, n)."""
    expected: Cleared
    """Past samples of what the model expects of it, z [rad], shape (1, n)."""
    intents: Filled
    """Intended activations without and with feedback, work of a tick [-], shape (2, m)."""


@compiled
def samples_in(period):
    """Samples that a memory holds at a period between two of them [s]."""
    return int(LONGEST_DELAY / period + 1e-9) + 2


def new_effort(sign: np.ndarray, period: float = TICK) -> EffortState:
    """The state of a patient before the first command.

    Args:
        sign: +1 for a flexor, -1 for an extensor, shape (m,).
        period: time between two ticks [s].
    """
    m, n = len(sign), int(samples_in(period))
    rows = {name: np.zeros((m, n)) for name in ("command", "drive", "reflex")}
    one = {name: np.zeros((1, n)) for name in ("error", "copy", "expected")}
    # A mass of 1 and a lag that is no 0, until `put_limb` knows better.
    limb = np.zeros(len(LIMB))
    limb[LIMB.inertia] = limb[LIMB.lag] = 1.0
    return EffortState(
        sign=sign, present=np.zeros(len(PRESENT)), active=np.zeros(m), fatigued=np.zeros(m), limb=limb,
        levers=np.zeros(m), intents=np.zeros((2, m)), **rows, **one,
    )  # fmt: skip


@compiled
def delayed(ring, k, newest, periods):
    """Signal k as it was some periods ago, linear between two samples."""
    n = ring.shape[1]
    whole = int(periods)
    part = periods - whole
    late = ring[k, (newest - whole) % n]
    if part == 0.0:
        return late
    return late + part * (ring[k, (newest - whole - 1) % n] - late)


@compiled
def felt(ring, k, newest, delay, period):
    """Signal k, whose newest sample is of the beginning of the period, some time [s] before its end."""
    return delayed(ring, k, newest, max(delay / period - 1.0, 0.0))


@compiled
def largest_activation(par, sign):
    """maximum_activation_g of a muscle's group [-]."""
    return par[PATIENT.maximum_activation_flexors if sign > 0.0 else PATIENT.maximum_activation_extensors]


@compiled
def feedback(par, state, planned_rate, period):
    """Excitation of the flexors by the error [-]: as it is felt, and predicted from there to the end of the period."""
    newest, delay = int(state.present[PRESENT.newest]), par[PATIENT.feedback_delay]
    error, share = felt(state.error, 0, newest, delay, period), par[PATIENT.prediction]
    if share > 0.0:
        # What the model expects is known at the end of the period.
        then = delayed(state.expected, 0, newest, max(delay / period, 1.0))
        error -= share * (state.expected[0, newest] - then)
    more = par[PATIENT.feedback_scaling] * activity(par, state, planned_rate)
    return (par[PATIENT.feedback_gain] + more) * error


@compiled
def activity(par, state, planned_rate):
    """A: mean activity of the group that has more of it, less where the plan moves [-]."""
    most = 0.0
    for sign in (1.0, -1.0):
        total, count = 0.0, 0
        for k in range(state.sign.shape[0]):
            if state.sign[k] == sign:
                total += largest_activation(par, sign) * state.active[k]
                count += 1
        most = max(most, total / max(count, 1))
    return most / (1.0 + (planned_rate / HOLDING) ** 2)


@compiled
def put_intents(par, state, period, correction):
    """Fill the intended activations c_k [-], those without a correction [-] first."""
    newest, intents = int(state.present[PRESENT.newest]), state.intents
    late = par[PATIENT.neural_delay] / period
    for k in range(state.sign.shape[0]):
        command = delayed(state.command, k, newest, late)
        intents[0, k] = max(command, 0.0)
        intents[1, k] = max(command + state.sign[k] * correction, 0.0)


@compiled
def wanted_share(par, state, which, k):
    """Wanted share T_k [-] of the intents in row `which`."""
    others = 0.0
    if par[PATIENT.co_contraction] > 0.0:
        count = 0
        for j in range(state.sign.shape[0]):
            if state.sign[j] != state.sign[k]:
                others += min(state.intents[which, j], largest_activation(par, state.sign[j]))
                count += 1
        # An arm may have muscles of one group only.
        others *= par[PATIENT.co_contraction] / max(count, 1)
    wanted = state.intents[which, k] + others
    maximum = largest_activation(par, state.sign[k])
    return wanted / maximum if wanted < maximum else 1.0


@compiled
def voluntary_drive(par, state, k, share):
    """Voluntary drive: the part of a wanted share that weakness and fatigue leave [-]."""
    return largest_activation(par, state.sign[k]) * min(share, 1.0 - state.fatigued[k])


@compiled
def reset_effort(par, state, period, wanted, angle, phase):
    """State of a patient who has wanted `wanted` at an elbow angle [rad] for long, but for what was fatigued before."""
    present = state.present
    present[PRESENT.newest], present[PRESENT.phase] = 0.0, phase
    present[PRESENT.effort] = par[PATIENT.effort_at_start]
    state.error[:], state.copy[:], state.expected[:] = 0.0, 0.0, 0.0
    state.limb[LIMB.moment], state.limb[LIMB.angle], state.limb[LIMB.rate] = 0.0, 0.0, 0.0
    for k in range(state.sign.shape[0]):
        state.fatigued[k] = par[PATIENT.fatigued_at_start]
        state.command[k, :] = present[PRESENT.effort] * wanted[k]
    put_intents(par, state, period, 0.0)
    for k in range(state.sign.shape[0]):
        share = wanted_share(par, state, 1, k)
        state.active[k] = min(share, 1.0 - state.fatigued[k])
        reflex = stretch_reflex(par, state.sign[k], angle, 0.0)
        state.reflex[k, :], state.drive[k, :] = reflex, voluntary_drive(par, state, k, share) + reflex


@compiled
def start_excitation(state, k):
    """Excitation of muscle k behind `reset_effort`, without tremor [-]: its activation in a consistent start."""
    return min(max(state.drive[k, 0], MINIMUM), 1.0)


@compiled
def remember(par, state, period, wanted, error, error_rate, angle, rate):
    """Put the samples of a new period into the memories, what the model of the limb expects at its end among them."""
    present, limb, n = state.present, state.limb, state.error.shape[1]
    before = int(present[PRESENT.newest])
    newest = (before + 1) % n
    present[PRESENT.newest] = newest
    lead = par[PATIENT.feedback_lead]
    state.error[0, newest] = error + lead * error_rate
    for k in range(state.sign.shape[0]):
        state.command[k, newest] = present[PRESENT.effort] * wanted[k]
        state.reflex[k, newest] = stretch_reflex(par, state.sign[k], angle, rate)
    if par[PATIENT.prediction] > 0.0:
        advance_limb(limb, delayed(state.copy, 0, before, par[PATIENT.electromechanical_delay] / period), period)
        state.expected[0, newest] = limb[LIMB.angle] + lead * limb[LIMB.rate]


@compiled
def step_effort(par, state, period, wanted, error, error_rate, angle, rate, noise, out):
    """Do one tick of one patient.

    Args:
        par: numbers of the patient, at the places of PATIENT.
        state: an EffortState, changed in place.
        period: time to the next tick [s].
        wanted: activations of the motor command at the end of the period [-], shape (m,).
        error: psi - theta at its beginning [rad].
        error_rate: rate of that [rad/s].
        angle: angle of the elbow at its beginning [rad].
        rate: its rate, flexion positive [rad/s].
        noise: a standard normal number for the tremor.
        out: excitations at the end of the period [-], shape (m,).
    """
    present, late = state.present, par[PATIENT.electromechanical_delay] / period
    present[PRESENT.effort] = advance_effort(
        present[PRESENT.effort], error, par[PATIENT.slacking_rate], par[PATIENT.effort_recovery],
        par[PATIENT.least_effort], period,
    )  # fmt: skip
    remember(par, state, period, wanted, error, error_rate, angle, rate)
    newest, predicts = int(present[PRESENT.newest]), par[PATIENT.prediction] > 0.0
    put_intents(par, state, period, feedback(par, state, error_rate + rate, period))
    turn, corrected = 2.0 * math.pi * par[PATIENT.tremor_frequency] * period, 0.0
    tremor = par[PATIENT.tremor_amplitude] * math.sin(present[PRESENT.phase] + turn)
    for k in range(state.sign.shape[0]):
        wants = wanted_share(par, state, 1, k)
        voluntary = voluntary_drive(par, state, k, wants)
        if predicts:
            without = voluntary_drive(par, state, k, wanted_share(par, state, 0, k))
            corrected += state.levers[k] * (voluntary - without)
        reflex = felt(state.reflex, k, newest, par[PATIENT.stretch_delay], period)
        state.drive[k, newest] = voluntary + state.sign[k] * tremor + reflex
        out[k] = limited(delayed(state.drive, k, newest, late))[0]
        state.active[k], state.fatigued[k] = advance_fatigue(
            state.active[k], state.fatigued[k], wants, par[PATIENT.fatigue_rate], par[PATIENT.recovery_rate],
            par[PATIENT.rest_recovery], period,
        )  # fmt: skip
    state.copy[0, newest] = corrected
    wandering = math.sqrt(2.0 * math.pi * par[PATIENT.tremor_width] * period) * noise
    present[PRESENT.phase] = (present[PRESENT.phase] + turn + wandering) % (2.0 * math.pi)
