"""Fibre and tendon of a muscle: their forces at given lengths, the fibre's stop, and where both are in equilibrium.

A fibre has a smallest length, as in OpenSim (MuscleFixedWidthPennationModel, Millard2012EquilibriumMuscle):

    q_min = max(0.01 L0, L0 sin(alpha0) / sin(acos 0.1))

There OpenSim sets the rate of the fibre to 0 as long as it would shorten; its tendon pulls with what its own length
gives. Here a stop within 1e-4 L0 above q_min takes the fibre's force instead, so that the row stays an equation with a
derivative in (q_m, qdot_m):

    F0 (a fl fv + fp) cos(alpha) - sigma - stop(q_m) = 0,   stop = 4 F0 x,   x = (q_min + 1e-4 L0 - q_m) / (1e-4 L0)

and 0 above it, where nothing changes. A fibre at rest below its optimal length gives at most F0, so that it comes to
rest above q_min, at rate 0; only the tendon's force acts on the bodies. Newton's method takes the kink in one iteration
from either side, where a rounded one costs it many.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from dms_core.bracket import narrowed, trial
from dms_core.compiled.jit import compiled
from dms_core.model.muscles.thelen_curves import active_force, force_velocity, passive_force, tendon_force

LEAST_COSINE = 0.1
"""Pennation is not let beyond acos(0.1), about 84 degrees."""
SHORTEST = 0.01
"""Smallest length of a fibre over L0, where pennation asks for no more."""
STOP_WIDTH = 1e-4
"""Way above the smallest length within which the stop takes the fibre's force, over L0."""
STOP_FORCE = 4.0
"""The stop's force at the smallest length, over F0: a fibre that is stretched from there gives more than F0."""
MOST_TRIALS = 200
"""Evaluations after which a search for a zero is as good as it gets."""


class MuscleNumbers(NamedTuple):
    """Places of the kernel's numbers; the path's table is the last of them."""

    F0: int = 0
    L0: int = 1
    Ls: int = 2
    height: int = 3
    """Height of the fibre across the tendon, L0 sin(alpha0) [m]."""
    fastest: int = 4
    """Contraction velocity [m/s]."""
    activation_time: int = 5
    deactivation_time: int = 6
    """Time constants [s]."""
    active_shape: int = 7
    passive_shape: int = 8
    passive_strain: int = 9
    toe_strain: int = 10
    """Tendon strain at the end of the toe [-]."""
    tendon_slope: int = 11
    """Slope of the tendon's line behind the toe [-]."""
    velocity_shape: int = 12
    lengthening_force: int = 13
    reflex_gain: int = 14
    """0 without a reflex."""
    path: int = 15


MUSCLE = MuscleNumbers()


@compiled
def pennation_cosine(par, length):
    """(cos(alpha), its slope by the fibre length [1/m])."""
    height = par[MUSCLE.height]
    if length <= height / math.sqrt(1.0 - LEAST_COSINE * LEAST_COSINE):
        # A fibre without height is parallel to the tendon at every length, even where Newton's method tries l <= 0.
        return (LEAST_COSINE, 0.0) if height > 0.0 else (1.0, 0.0)
    s = height / length
    c = math.sqrt(1.0 - s * s)
    return c, s * s / (length * c)


@compiled
def smallest_fibre(par):
    """Length below which no fibre shortens [m]."""
    steepest = par[MUSCLE.height] / math.sqrt(1.0 - LEAST_COSINE * LEAST_COSINE)
    return max(steepest, SHORTEST * par[MUSCLE.L0])


@compiled
def fibre_stop(par, fibre):
    """(force along the tendon with which the stop holds the fibre [N], its slope by q_m [N/m]); 0 above the stop."""
    width = STOP_WIDTH * par[MUSCLE.L0]
    x = (smallest_fibre(par) + width - fibre) / width
    if x <= 0.0:
        return 0.0, 0.0
    F = STOP_FORCE * par[MUSCLE.F0]
    return F * x, -F / width


@compiled
def tendon_state(par, length, fibre):
    """(sigma [N], dsigma/dl [N/m], dsigma/dq_m [N/m]) at the given muscle-tendon and fibre lengths."""
    c, c_l = pennation_cosine(par, fibre)
    F0, Ls = par[MUSCLE.F0], par[MUSCLE.Ls]
    ft, ft_e = tendon_force((length - fibre * c) / Ls - 1.0, par[MUSCLE.toe_strain], par[MUSCLE.tendon_slope])
    by_length = F0 * ft_e / Ls
    return F0 * ft, by_length, -by_length * (c + fibre * c_l)


@compiled
def fibre_state(par, fibre, rate, a):
    """Active and passive fibre force [N]; derivatives of the active by q_m, its rate and a, of the passive by q_m."""
    F0, L0, fastest = par[MUSCLE.F0], par[MUSCLE.L0], par[MUSCLE.fastest]
    fl, fl_l = active_force(fibre / L0, par[MUSCLE.active_shape])
    fp, fp_l = passive_force(fibre / L0, par[MUSCLE.passive_shape], par[MUSCLE.passive_strain])
    fv, fv_w, fv_a = force_velocity(rate / fastest, a, par[MUSCLE.velocity_shape], par[MUSCLE.lengthening_force])
    return (
        F0 * a * fl * fv,
        F0 * fp,
        F0 * a * fl_l * fv / L0,
        F0 * a * fl * fv_w / fastest,
        F0 * fl * (fv + a * fv_a),
        F0 * fp_l / L0,
    )


@compiled
def surplus(par, length, fibre, a):
    """Force of a fibre at rest along the tendon, less that of the tendon [N]."""
    active, passive = fibre_state(par, fibre, 0.0, a)[:2]
    return (active + passive) * pennation_cosine(par, fibre)[0] - tendon_state(par, length, fibre)[0]


@compiled
def _rest_on_stop(par, length, a, low, high):
    """Fibre length [m] between low and high at which the stop holds what the tendon does not, to rounding."""
    for _ in range(MOST_TRIALS):
        x = 0.5 * (low + high)
        if not low < x < high:
            break
        if surplus(par, length, x, a) > fibre_stop(par, x)[0]:
            high = x
        else:
            low = x
    return high


@compiled
def fibre_at_rest(par, length, a):
    """Fibre length [m] at which `surplus` is 0, to rounding; on the stop where the tendon leaves no more room."""
    height, room = par[MUSCLE.height], length - par[MUSCLE.Ls]
    stop = smallest_fibre(par)
    top = stop + STOP_WIDTH * par[MUSCLE.L0]
    low = max(height / math.sqrt(1.0 - LEAST_COSINE * LEAST_COSINE), 1e-3 * par[MUSCLE.L0]) * (1.0 + 1e-12)
    # The tendon is slack at the upper end, where the fibre pulls; it is strained most at the lower end.
    high = math.hypot(max(room, 0.0), height)
    if high <= top or surplus(par, length, top, a) >= 0.0:
        return _rest_on_stop(par, length, a, stop, top)
    f_low, f_high, moved = surplus(par, length, low, a), surplus(par, length, high, a), 0.0
    if f_low >= 0.0:
        low, f_low = top, surplus(par, length, top, a)
    for _ in range(MOST_TRIALS):
        x = trial(low, f_low, high, f_high)
        if not low < x < high:
            break
        low, f_low, high, f_high, moved = narrowed(low, f_low, high, f_high, moved, x, surplus(par, length, x, a))
    return low if -f_low < f_high else high
