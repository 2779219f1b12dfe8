"""How much work an error can recruit at most, whatever a device does: a bound for the share that is left to it.

Effort obeys s' = -rate (s - s_0) + recovery e (slacking.py), and beside it intention grows by feedback_gain e
(effort.py). With p, the power of the planned moment, and g, that of all flexors at full activation, both where they are
positive, the work W that an error e adds to a patient's work in a run with the error e_0 is at most

    W = integral of k (e - e_0) dt,   k(t) = feedback_gain g(t) + recovery integral of p(u) exp(-rate (u - t)) du, u > t

since weakness, fatigue, co-contraction and effort's own limits only take away. Of all errors whose root mean square
over the time T is R, the one in proportion to k adds most (Cauchy and Schwarz):

    W <= R sqrt(T) |k| - integral of k e_0 dt,   |k|^2 = integral of k^2 dt

Nor does a patient do more than the largest static moment that can be wanted does along the movement (need.py).

Delays, which move k by less than 0.3 s, and passive moments of muscles are left out, and the work of device and patient
together is taken as given, since the movement is: the bound is known to a hundredth of that work.
"""

from __future__ import annotations

import numpy as np

from exo_env.episode import Episode
from exo_env.human import FLEXORS, MUSCLES
from exo_env.motor_command import InternalModel
from exo_env.need import voluntary_moment
from exo_env.patient import Patient


def most_work(episode: Episode, error: np.ndarray, done: float, rms: float) -> float:
    """Largest positive work of the patient with errors of some size [J].

    Args:
        episode: of a run.
        error: psi - theta of the run at the first n control times [rad], shape (n,).
        done: positive work of the patient in the run until then [J].
        rms: root mean square of the errors that are allowed [rad].
    """
    n, period = len(error), float(episode.times[1] - episode.times[0])
    planned, full, voluntary = powers(episode, n)
    k = recruited(episode.patient, planned, full, period)
    added = rms * np.sqrt(n * period * float(k @ k) * period) - float(k @ error) * period
    return max(done, min(done + added, float(voluntary.sum()) * period))


def powers(episode: Episode, n: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Power of the planned moment, of all flexors at full activation, and of the largest moment that can be wanted.

    Returns:
        Each where it is positive [W], shape (n,).
    """
    patient, machine = episode.patient, episode.ecosystem.machine
    assert machine is not None
    known = InternalModel.of(episode.arm, machine, patient.expected_load * episode.load)
    psi, rate, acceleration = episode.course[:n].T
    full = np.array([1.0 if m in FLEXORS else 0.01 for m in MUSCLES])
    planned = np.array([known.moment(*x) for x in zip(psi, rate, acceleration, strict=True)])
    largest = np.array([known.muscle_moment(x, full) for x in psi])
    wanted = np.array([voluntary_moment(patient, known, x) for x in psi])
    return np.maximum(planned * rate, 0.0), np.maximum(largest * rate, 0.0), np.maximum(wanted * rate, 0.0)


def recruited(patient: Patient, planned: np.ndarray, full: np.ndarray, period: float) -> np.ndarray:
    """k: work that an error adds, by its size and the time that it lasts [J/(rad s)], shape (n,).

    Args:
        patient: who.
        planned: power of the planned moment [W], shape (n,).
        full: power of all flexors at full activation [W], shape (n,).
        period: between two times [s].
    """
    kept, later, found = np.exp(-patient.slacking_rate * period), 0.0, np.empty(len(planned))
    for i in reversed(range(len(planned))):
        later = later * kept + planned[i] * period
        found[i] = later
    return patient.effort_recovery * found + patient.feedback_gain * full
