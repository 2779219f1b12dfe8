"""How much work errors of a size can recruit from a patient: a linear estimate, whatever device makes the errors.

Effort obeys s' = -rate (s - s_0) + recovery e (slacking.py), and beside it intention grows by
(feedback_gain + feedback_scaling A) e (effort.py), A being p / g at most. With p, the power of the planned moment, and
g, that of all flexors at full activation, both along the reference and where they are positive, an error e adds to the
patient's work in a run with the error e_0

    W = integral of k (e - e_0) dt,   k(t) = feedback_gain g(t) + feedback_scaling p(t)
                                                + recovery integral of p(u) exp(-rate (u - t)) du, u > t

Of all errors whose root mean square over the time T is R, the one in proportion to k adds most (Cauchy and Schwarz):

    W <= R sqrt(T) |k| - integral of k e_0 dt,   |k|^2 = integral of k^2 dt

An estimate of what is possible and no bound. It is too high by what keeps effort from becoming work: weakness, fatigue,
co-contraction, the limits of effort. It leaves out what changes work in other ways: errors that shorten the movement
(1.5 deg at both ends are 6 % of a lift of 50 deg) or shake the arm, reflexes, delays (below 0.3 s), passive moments.
"""

from __future__ import annotations

import math

import numpy as np

from dms_core.model.muscles.activation import MINIMUM
from exo_env.patient.excitation.motor_command import InternalModel
from exo_env.patient.excitation.static_optimisation import needed_moments
from exo_env.patient.patient import Patient
from exo_env.world.episodes.episode import Episode


def most_recruited(episode: Episode, error: np.ndarray, rms: float) -> float:
    """Most work that errors of a size add to the patient's in a run [J].

    Args:
        episode: of the run.
        error: psi - theta of the run at the first n control times [rad], shape (n,).
        rms: root mean square of the errors that are allowed [rad].
    """
    n, period = len(error), float(episode.times[1])
    return most_added(recruited(episode.patient, *powers(episode, n), period), error, rms, period)


def most_added(k: np.ndarray, error: np.ndarray, rms: float, period: float) -> float:
    """R sqrt(T) |k| less the integral of k e_0 [J]; shapes (n,), units as in `recruited` and [rad]."""
    return rms * math.sqrt(len(k) * period * float(k @ k) * period) - float(k @ error) * period


def powers(episode: Episode, n: int) -> tuple[np.ndarray, np.ndarray]:
    """Power of the planned moment, and of all flexors at full activation, where positive [W], each of shape (n,)."""
    patient, machine = episode.patient, episode.ecosystem.machine
    assert machine is not None
    known = InternalModel.of(episode.arm, machine, patient.expected_load * episode.load)
    course, planned = episode.course[:n], np.empty(n)
    needed_moments(known.arm, known.load, np.full(n, known.load.weight), course, planned)
    flexed = np.where(episode.arm.signs > 0.0, 1.0, MINIMUM)
    rate, full = course[:, 1], np.array([known.muscle_moment(psi, flexed) for psi in course[:, 0]])
    return np.maximum(planned * rate, 0.0), np.maximum(full * rate, 0.0)


def recruited(patient: Patient, planned: np.ndarray, full: np.ndarray, period: float) -> np.ndarray:
    """k: work that an error adds, by its size and the time that it lasts [J/(rad s)], shape (n,).

    Exact for errors and powers that are constant over each period.

    Args:
        patient: who.
        planned: power of the planned moment [W], shape (n,).
        full: power of all flexors at full activation [W], shape (n,).
        period: between two times [s].
    """
    rate = patient.slacking_rate
    kept, gained = math.exp(-rate * period), -math.expm1(-rate * period) / rate if rate > 0.0 else period
    later, recovered = 0.0, np.empty(len(planned))
    for i in reversed(range(len(planned))):
        later = later * kept + planned[i] * gained
        recovered[i] = later
    return patient.effort_recovery * recovered + patient.feedback_gain * full + patient.feedback_scaling * planned
