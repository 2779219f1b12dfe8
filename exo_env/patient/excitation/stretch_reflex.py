"""The stretch reflex of spastic muscles: excitation by rate of stretch above a threshold that falls with length.

For a group of sign s (flexors +1, extensors -1) whose muscles are stretched by the elbow at the rate v = -s theta' and
are longer than in the middle of the exercise, theta_m, by the angle x = s (theta_m - theta):

    reflex = spasticity max(v - v_0(x), 0),    v_0(x) = stretch_threshold - stretch_threshold_slope x

Powers, Campbell and Rymer (1989) find that spastic elbow flexors differ from healthy ones by their threshold, and that
the threshold falls with the rate of stretch: the dynamic stretch reflex threshold, an angle x = x_0 - mu v (Levin and
Feldman 1994; Calota, Feldman and Levin 2008). Solved for v it is the line above, with slope 1 / mu. Where a muscle is
so long that v_0 is negative, it is beyond its tonic threshold x_0 = stretch_threshold / stretch_threshold_slope and
contracts at rest. A slope of 0 leaves the reflex by rate alone (Lance 1980).
"""

from __future__ import annotations

from dms_core.compiled.jit import compiled
from exo_env.patient.patient import MIDDLE, PATIENT


@compiled
def stretch_reflex(par, sign, angle, rate):
    """Excitation of a muscle's group by stretch [-].

    Args:
        par: numbers of the patient, at the places of PATIENT.
        sign: +1 for a flexor, -1 for an extensor.
        angle: angle of the elbow [rad].
        rate: its rate, flexion positive [rad/s].
    """
    gain = par[PATIENT.spasticity_flexors if sign > 0.0 else PATIENT.spasticity_extensors]
    longer = sign * (MIDDLE - angle)
    threshold = par[PATIENT.stretch_threshold] - par[PATIENT.stretch_threshold_slope] * longer
    return gain * max(-sign * rate - threshold, 0.0)
