"""From the motor command of a patient to the excitations of the muscles at the end of each control period.

For muscle k of group g (flexors: sign +1, extensors: -1), with the wanted activations a_k of the motor command:

    c_k = delayed(s a_k, neural delay) + sign feedback_gain delayed(e, feedback delay)     what is intended, at least 0
    T_k = (c_k + co_contraction mean(c of the other group)) / maximum_activation_g         wanted share, at most 1
    d_k = maximum_activation_g min(T_k, 1 - M_F,k)                                         voluntary drive
          + spasticity_g delayed(max(stretch rate - threshold, 0), stretch delay)          stretch reflex
          + sign tremor_amplitude sin(phase)                                               tremor
    u_k = delayed(d_k, electromechanical delay), within 0.01 to 1

s is the effort (slacking.py), M_F the fatigued share (fatigue.py). Weakness is a ceiling, since what was measured after
stroke is the largest torque: who is weak wants a larger share of what is left for the same moment, and gives it up to
all of it. That patients know their weakness so well is assumed; the rest of it they learn by their errors (s above 1).
Weakness is of the descending command: reflex and tremor know no ceiling. The flexors are stretched by extension of the
elbow, the extensors by flexion. Tremor alternates between the groups and its phase wanders with
2 pi frequency dt + sqrt(2 pi width dt) N(0, 1), which makes a spectral peak of that width at half height.

Signals are linear between control times, and so is the excitation that reaches the muscles. The motor command is known
beforehand and taken at the end of the period; what is felt (error, stretch) is known at its beginning, so that a delay
shorter than a period counts as one. A patient is a row of numbers (`PATIENT` in patient.py) and an `EffortState`; the
functions neither allocate nor draw random numbers, so that a batch can run them.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from dms_core.compiled.jit import compiled
from dms_core.model.muscles.activation import MINIMUM, limited
from exo_env.clearing import Cleared, Kept
from exo_env.patient.fatigue import advance_fatigue
from exo_env.patient.patient import LONGEST_DELAY, PATIENT
from exo_env.patient.slacking import advance_effort
from exo_env.places import places

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
    """Past samples of the stretch reflex, gain times stretch beyond the threshold [-], shape (m, n)."""
    error: Cleared
    """Past samples of the error e [rad], shape (1, n)."""


@compiled
def samples_in(period):
    """Samples that a memory holds at a control period [s]."""
    return int(LONGEST_DELAY / period + 1e-9) + 2


def new_effort(sign: np.ndarray, period: float) -> EffortState:
    """The state of a patient before the first command.

    Args:
        sign: +1 for a flexor, -1 for an extensor, shape (m,).
        period: control period [s].
    """
    m, n = len(sign), int(samples_in(period))
    rows = {name: np.zeros((m, n)) for name in ("command", "drive", "reflex")}
    return EffortState(
        sign=sign, present=np.zeros(len(PRESENT)), active=np.zeros(m), fatigued=np.zeros(m), error=np.zeros((1, n)),
        **rows,
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
def intended(par, state, period, k):
    """Intended activation c_k [-]."""
    newest = int(state.present[PRESENT.newest])
    command = delayed(state.command, k, newest, par[PATIENT.neural_delay] / period)
    error = felt(state.error, 0, newest, par[PATIENT.feedback_delay], period)
    return max(command + state.sign[k] * par[PATIENT.feedback_gain] * error, 0.0)


@compiled
def largest_activation(par, sign):
    """maximum_activation_g of a muscle's group [-]."""
    return par[PATIENT.maximum_activation_flexors if sign > 0.0 else PATIENT.maximum_activation_extensors]


@compiled
def wanted_share(par, state, period, k):
    """Wanted share T_k [-]."""
    others = 0.0
    if par[PATIENT.co_contraction] > 0.0:
        count = 0
        for j in range(state.sign.shape[0]):
            if state.sign[j] != state.sign[k]:
                others += intended(par, state, period, j)
                count += 1
        # An arm may have muscles of one group only.
        others *= par[PATIENT.co_contraction] / max(count, 1)
    wanted = intended(par, state, period, k) + others
    maximum = largest_activation(par, state.sign[k])
    return wanted / maximum if wanted < maximum else 1.0


@compiled
def voluntary_drive(par, state, k, share):
    """Voluntary drive: the part of a wanted share that weakness and fatigue leave [-]."""
    return largest_activation(par, state.sign[k]) * min(share, 1.0 - state.fatigued[k])


@compiled
def reset_effort(par, state, period, wanted, phase):
    """State of a patient who has wanted `wanted` for long, rested but for what was fatigued before."""
    present = state.present
    present[PRESENT.newest], present[PRESENT.phase] = 0.0, phase
    present[PRESENT.effort] = par[PATIENT.effort_at_start]
    state.error[:], state.reflex[:] = 0.0, 0.0
    for k in range(state.sign.shape[0]):
        state.fatigued[k] = par[PATIENT.fatigued_at_start]
        state.command[k, :] = present[PRESENT.effort] * wanted[k]
    for k in range(state.sign.shape[0]):
        share = wanted_share(par, state, period, k)
        state.active[k] = min(share, 1.0 - state.fatigued[k])
        state.drive[k, :] = voluntary_drive(par, state, k, share)


@compiled
def start_excitation(state, k):
    """Excitation of muscle k behind `reset_effort`, without tremor [-]: its activation in a consistent start."""
    return min(max(state.drive[k, 0], MINIMUM), 1.0)


@compiled
def remember(par, state, wanted, error, rate):
    """Put the samples of a new period into the memories; `rate` is that of the elbow [rad/s]."""
    present = state.present
    newest = (int(present[PRESENT.newest]) + 1) % state.error.shape[1]
    present[PRESENT.newest] = newest
    state.error[0, newest] = error
    for k in range(state.sign.shape[0]):
        flexor, stretch = state.sign[k] > 0.0, -state.sign[k] * rate
        gain = par[PATIENT.spasticity_flexors if flexor else PATIENT.spasticity_extensors]
        state.command[k, newest] = present[PRESENT.effort] * wanted[k]
        state.reflex[k, newest] = gain * max(stretch - par[PATIENT.stretch_threshold], 0.0)


@compiled
def step_effort(par, state, period, wanted, error, rate, noise, out):
    """Do one control period of one patient.

    Args:
        par: numbers of the patient, at the places of PATIENT.
        state: an EffortState, changed in place.
        period: control period [s].
        wanted: activations of the motor command at the end of the period [-], shape (m,).
        error: psi - theta at its beginning [rad].
        rate: rate of the elbow at its beginning, flexion positive [rad/s].
        noise: a standard normal number for the tremor.
        out: excitations at the end of the period [-], shape (m,).
    """
    present, late = state.present, par[PATIENT.electromechanical_delay] / period
    present[PRESENT.effort] = advance_effort(
        present[PRESENT.effort], error, par[PATIENT.slacking_rate], par[PATIENT.effort_recovery],
        par[PATIENT.least_effort], period,
    )  # fmt: skip
    remember(par, state, wanted, error, rate)
    newest = int(present[PRESENT.newest])
    turn = 2.0 * math.pi * par[PATIENT.tremor_frequency] * period
    tremor = par[PATIENT.tremor_amplitude] * math.sin(present[PRESENT.phase] + turn)
    for k in range(state.sign.shape[0]):
        wants = wanted_share(par, state, period, k)
        drive = voluntary_drive(par, state, k, wants) + state.sign[k] * tremor
        drive += felt(state.reflex, k, newest, par[PATIENT.stretch_delay], period)
        state.drive[k, newest] = drive
        out[k] = limited(delayed(state.drive, k, newest, late))[0]
        state.active[k], state.fatigued[k] = advance_fatigue(
            state.active[k], state.fatigued[k], wants, par[PATIENT.fatigue_rate], par[PATIENT.recovery_rate],
            par[PATIENT.rest_recovery], period,
        )  # fmt: skip
    wandering = math.sqrt(2.0 * math.pi * par[PATIENT.tremor_width] * period) * noise
    present[PRESENT.phase] = (present[PRESENT.phase] + turn + wandering) % (2.0 * math.pi)
