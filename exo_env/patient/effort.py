"""From what a patient wants to what the muscles are told at the end of each control period.

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

Signals are linear between control times, and so is the excitation that reaches the muscles. What is wanted is known
beforehand and taken at the end of the period; what is felt (error, stretch) is known at its beginning, so that a delay
shorter than a period counts as one. One patient is one row of numbers (`PATIENT` in patient.py) and one
row of state (`STATE`); the functions neither allocate nor draw random numbers, so that a batch can run them.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from dms_core.errors import InputError
from dms_core.model.muscles.activation import MINIMUM, limited
from exo_env.ecosystem.arm import FLEXORS, MUSCLES
from exo_env.jit import compiled
from exo_env.patient.fatigue import advance_fatigue
from exo_env.patient.patient import LONGEST_DELAY, PATIENT, Patient
from exo_env.patient.slacking import advance_effort

N = len(MUSCLES)
SIGN = tuple(1.0 if m in FLEXORS else -1.0 for m in MUSCLES)
"""+1 for a flexor, -1 for an extensor, in the order of MUSCLES."""


class StateIndex(NamedTuple):
    """Where a patient's state begins in its row."""

    newest: int = 0
    """Place of the newest sample in every ring of memory."""
    phase: int = 1
    """Of the tremor [rad]."""
    effort: int = 2
    """s [-]."""
    active: int = 3
    """M_A of each muscle [-]."""
    fatigued: int = 3 + N
    """M_F of each muscle [-]."""
    memory: int = 3 + 2 * N
    """Rings of past samples, one after another in the order of `RING`."""


class RingIndex(NamedTuple):
    """Number of the first ring of each signal; all but the error have one per muscle."""

    command: int = 0
    drive: int = N
    reflex: int = 2 * N
    error: int = 3 * N


STATE, RING = StateIndex(), RingIndex()


@compiled
def samples_in(period):
    """Samples in each ring at a control period [s]."""
    return int(LONGEST_DELAY / period + 1e-9) + 2


def state_size(period: float) -> int:
    """Length of a patient's row of state."""
    return STATE.memory + (RING.error + 1) * samples_in(period)


@compiled
def delayed(state, n, ring, periods):
    """A signal as it was some periods ago, linear between two samples."""
    whole = int(periods)
    part = periods - whole
    newest = int(state[STATE.newest])
    start = STATE.memory + ring * n
    late = state[start + (newest - whole) % n]
    if part == 0.0:
        return late
    return late + part * (state[start + (newest - whole - 1) % n] - late)


@compiled
def felt(state, n, ring, delay, period):
    """A signal whose newest sample is of the beginning of the period, some time [s] before its end."""
    return delayed(state, n, ring, max(delay / period - 1.0, 0.0))


@compiled
def intended(par, state, n, period, k):
    """c_k [-]."""
    command = delayed(state, n, RING.command + k, par[PATIENT.neural_delay] / period)
    error = felt(state, n, RING.error, par[PATIENT.feedback_delay], period)
    return max(command + SIGN[k] * par[PATIENT.feedback_gain] * error, 0.0)


@compiled
def wanted_share(par, state, n, period, k):
    """T_k [-]."""
    others = 0.0
    if par[PATIENT.co_contraction] > 0.0:
        count = 0
        for j in range(N):
            if SIGN[j] != SIGN[k]:
                others += intended(par, state, n, period, j)
                count += 1
        others *= par[PATIENT.co_contraction] / count
    wanted = intended(par, state, n, period, k) + others
    maximum = par[PATIENT.maximum_activation_flexors if SIGN[k] > 0.0 else PATIENT.maximum_activation_extensors]
    return wanted / maximum if wanted < maximum else 1.0


@compiled
def voluntary_drive(par, state, k, share):
    """What weakness and fatigue leave of a wanted share [-]."""
    maximum = par[PATIENT.maximum_activation_flexors if SIGN[k] > 0.0 else PATIENT.maximum_activation_extensors]
    return maximum * min(share, 1.0 - state[STATE.fatigued + k])


@compiled
def reset_effort(par, state, n, period, wanted, phase):
    """State of a patient who has wanted `wanted` for long, rested but for what was fatigued before."""
    state[:] = 0.0
    state[STATE.phase] = phase
    state[STATE.effort] = par[PATIENT.effort_at_start]
    for k in range(N):
        state[STATE.fatigued + k] = par[PATIENT.fatigued_at_start]
        for i in range(n):
            state[STATE.memory + (RING.command + k) * n + i] = state[STATE.effort] * wanted[k]
    for k in range(N):
        share = wanted_share(par, state, n, period, k)
        drive = voluntary_drive(par, state, k, share)
        state[STATE.active + k] = min(share, 1.0 - state[STATE.fatigued + k])
        for i in range(n):
            state[STATE.memory + (RING.drive + k) * n + i] = drive


@compiled
def start_excitation(state, n, k):
    """Excitation of muscle k behind `reset_effort`, without tremor [-]: its activation in a consistent start."""
    return min(max(state[STATE.memory + (RING.drive + k) * n], MINIMUM), 1.0)


@compiled
def remember(par, state, n, wanted, error, stretch):
    """Takes the samples of a new period into the rings."""
    newest = (int(state[STATE.newest]) + 1) % n
    state[STATE.newest] = newest
    state[STATE.memory + RING.error * n + newest] = error
    for k in range(N):
        gain = par[PATIENT.spasticity_flexors if SIGN[k] > 0.0 else PATIENT.spasticity_extensors]
        reflex = gain * max(stretch[k] - par[PATIENT.stretch_threshold], 0.0)
        state[STATE.memory + (RING.command + k) * n + newest] = state[STATE.effort] * wanted[k]
        state[STATE.memory + (RING.reflex + k) * n + newest] = reflex


@compiled
def step_effort(par, state, n, period, wanted, error, stretch, noise, out):
    """One control period of one patient.

    Args:
        par: numbers of the patient, shape (len(PATIENT),).
        state: changed in place, shape (state_size(period),).
        n: samples in each ring.
        period: control period [s].
        wanted: activations of the motor command at the end of the period [-], shape (6,).
        error: psi - theta at its beginning [rad].
        stretch: rate at which each muscle is stretched, as rate of the elbow, at its beginning [rad/s], shape (6,).
        noise: a standard normal number for the tremor.
        out: excitations at the end of the period [-], shape (6,).
    """
    state[STATE.effort] = advance_effort(
        state[STATE.effort], error, par[PATIENT.slacking_rate], par[PATIENT.effort_recovery],
        par[PATIENT.least_effort], period,
    )  # fmt: skip
    remember(par, state, n, wanted, error, stretch)
    turn = 2.0 * math.pi * par[PATIENT.tremor_frequency] * period
    tremor = par[PATIENT.tremor_amplitude] * math.sin(state[STATE.phase] + turn)
    for k in range(N):
        wants = wanted_share(par, state, n, period, k)
        drive = voluntary_drive(par, state, k, wants) + SIGN[k] * tremor
        drive += felt(state, n, RING.reflex + k, par[PATIENT.stretch_delay], period)
        state[STATE.memory + (RING.drive + k) * n + int(state[STATE.newest])] = drive
        out[k] = limited(delayed(state, n, RING.drive + k, par[PATIENT.electromechanical_delay] / period))[0]
        state[STATE.active + k], state[STATE.fatigued + k] = advance_fatigue(
            state[STATE.active + k], state[STATE.fatigued + k], wants, par[PATIENT.fatigue_rate],
            par[PATIENT.recovery_rate], par[PATIENT.rest_recovery], period,
        )  # fmt: skip
    wandering = math.sqrt(2.0 * math.pi * par[PATIENT.tremor_width] * period) * noise
    state[STATE.phase] = (state[STATE.phase] + turn + wandering) % (2.0 * math.pi)


class Effort:
    """A patient at work.

    Args:
        patient: who.
        period: control period [s].
        generator: source of the tremor's phase; one number is drawn at each reset and one at each step, whoever the
            patient is.
        feedback: False where the model itself holds the proprioceptive feedback (`Ecosystem.proprioception`).
    """

    def __init__(
        self, patient: Patient, period: float, generator: np.random.Generator, *, feedback: bool = True
    ) -> None:
        if not 1e-4 <= period <= LONGEST_DELAY:
            raise InputError(f"control period = {period} s; a number from 0.0001 to {LONGEST_DELAY} is wanted.")
        self.patient, self.period, self.generator, self.feedback = patient, float(period), generator, feedback
        self.numbers = patient.numbers()
        if not feedback:
            self.numbers[PATIENT.feedback_gain] = 0.0
        self.state = np.zeros(state_size(period))
        self._samples = int(samples_in(period))
        self.reset(np.full(N, MINIMUM))

    def reset(self, wanted: np.ndarray) -> np.ndarray:
        """Forgets everything, as one who has wanted `wanted` [-], shape (6,), for long.

        Returns:
            The excitations of that, without tremor [-], shape (6,): activations of a consistent start.
        """
        phase = self.generator.uniform(0.0, 2.0 * math.pi)
        reset_effort(self.numbers, self.state, self._samples, self.period, _activations(wanted), phase)
        return np.array([start_excitation(self.state, self._samples, k) for k in range(N)])

    def step(self, wanted: np.ndarray, *, error: float = 0.0, rate: float = 0.0) -> np.ndarray:
        """Excitations at the end of the coming control period [-], shape (6,).

        Args:
            wanted: activations of the motor command at its end [-], shape (6,), in the order of MUSCLES.
            error: psi - theta now [rad].
            rate: of the elbow now [rad/s], flexion positive.

        Raises:
            InputError: a value is not finite, or `wanted` is not six numbers from 0 to 1.
        """
        for name, value in (("error", error), ("rate", rate)):
            if not math.isfinite(value):
                raise InputError(f"{name} = {value}; a finite number is wanted.")
        out = np.empty(N)
        stretch = -rate * np.array(SIGN)
        noise = self.generator.standard_normal()
        step_effort(
            self.numbers, self.state, self._samples, self.period, _activations(wanted), float(error), stretch, noise,
            out,
        )  # fmt: skip
        return out

    @property
    def effort(self) -> float:
        """Share of the command that the patient still intends: s [-]."""
        return float(self.state[STATE.effort])

    @property
    def fatigued(self) -> np.ndarray:
        """Fatigued share M_F of each muscle [-], shape (6,)."""
        return self.state[STATE.fatigued : STATE.fatigued + N].copy()

    def copy(self, generator: np.random.Generator) -> Effort:
        """The same patient in the same state, with another source of random numbers."""
        twin = Effort.__new__(Effort)
        twin.__dict__.update(self.__dict__, generator=generator, state=self.state.copy(), numbers=self.numbers.copy())
        return twin


def _activations(wanted: np.ndarray) -> np.ndarray:
    """Checked: six finite numbers from 0 to 1."""
    found = np.asarray(wanted, dtype=float)
    if found.shape != (N,) or not np.all((found >= 0.0) & (found <= 1.0)):
        raise InputError(
            f"wanted = {wanted!r}; {N} activations from 0 to 1 are wanted, in the order {', '.join(MUSCLES)}."
        )
    return found
