"""Fibre and tendon of a muscle: their forces at given lengths, the fibre's stop, and where both are in equilibrium.

A fibre has a smallest length, as in OpenSim (MuscleFixedWidthPennationModel, Millard2012EquilibriumMuscle):

    q_min = max(0.01 L0, L0 sin(alpha0) / sin(acos 0.1))

There OpenSim sets the rate of the fibre to 0 as long as it would shorten; its tendon pulls with what its own length
gives. Here a stop within w = 1e-2 L0 above q_min lengthens the fibre at a rate s of its own, which the force-velocity
curve does not see, so that the row stays an equation with derivatives in (q_m, qdot_m):

    F0 (a fl fv(qdot_m - s(q_m)) + fp) cos(alpha) - sigma = 0,   s = 4 vmax x,   x = (q_min + w - q_m) / w

There fl and cos(alpha) keep their values of x = 0. Above, where x <= 0, there is no stop, and nothing changes. All
slopes of the row scale with F0 a fl, on the stop and above, and with a slack tendon the row is linear where a fibre
shortens too fast: Newton's method takes the kink in about two iterations from either side. A fibre whose tendon is
slack comes to rest where s is the rate at which it would shorten, (0.25 + 0.75 a) vmax: at x from 0.06 to 0.25. Where
its tendon becomes taut again a fixed step of 0.5 ms or more may fail, as it may without a stop.

No solution goes below q_min. A tendon does not push, and fp is 0 below L0, so that fv >= 0 and the fibre shortens by
itself at (0.25 + 0.75 a) vmax <= vmax at most: at q_min the row gives it a rate of 3 vmax or more, upwards. Nor does a
step of any size end there: BDF2 would need a rate below r / (1 + r) vmax <= 0.71 vmax at q_min, where r is the ratio of
two steps, and the second stage of SDIRK2 one below (1 - 2 gamma) / gamma vmax = 1.42 vmax. (The exception is a fibre
that passive force shortens many times faster than vmax within a single step.)
"""

from __future__ import annotations

import math
from typing import NamedTuple

from dms_core.bracket import narrowed, trial
from dms_core.compiled.jit import compiled
from dms_core.model.muscles.thelen_curves import (
    TOE_FORCE,
    TOE_SHAPE,
    active_force,
    force_velocity,
    passive_force,
    tendon_force,
)

TOE_GROWTH = math.expm1(TOE_SHAPE)
LEAST_COSINE = 0.1
"""Pennation is not let beyond acos(0.1), about 84 degrees."""
SHORTEST = 0.01
"""Smallest length of a fibre over L0, where pennation asks for no more."""
STOP_WIDTH = 1e-2
"""Way above the smallest length within which the stop acts, over L0."""
STOP_RATE = 4.0
"""Rate that the stop gives at the smallest length, over the contraction velocity: 2.42 or more, see the head."""
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
def steepest_fibre(par):
    """Length at which a fibre's pennation is the largest [m]; 0 without pennation."""
    return par[MUSCLE.height] / math.sqrt(1.0 - LEAST_COSINE * LEAST_COSINE)


@compiled
def pennation_cosine(par, length):
    """(cos(alpha), its slope by the fibre length [1/m])."""
    height = par[MUSCLE.height]
    if length <= steepest_fibre(par):
        # A fibre without height is parallel to the tendon at every length, even where Newton's method tries l <= 0.
        return (LEAST_COSINE, 0.0) if height > 0.0 else (1.0, 0.0)
    s = height / length
    c = math.sqrt(1.0 - s * s)
    return c, s * s / (length * c)


@compiled
def smallest_fibre(par):
    """Length below which no fibre shortens [m]."""
    return max(steepest_fibre(par), SHORTEST * par[MUSCLE.L0])


@compiled
def stop_begins(par):
    """Length below which the stop acts [m]."""
    return smallest_fibre(par) + STOP_WIDTH * par[MUSCLE.L0]


@compiled
def fibre_stop(par, fibre):
    """(rate s at which the stop lengthens the fibre [m/s], its slope by q_m [1/s]); 0 above the stop."""
    width = STOP_WIDTH * par[MUSCLE.L0]
    x = (stop_begins(par) - fibre) / width
    if x <= 0.0:
        return 0.0, 0.0
    fastest = STOP_RATE * par[MUSCLE.fastest]
    return fastest * x, -fastest / width


@compiled
def tendon_state(par, length, fibre):
    """(sigma [N], dsigma/dl [N/m], dsigma/dq_m [N/m]) at the given muscle-tendon and fibre lengths."""
    c, c_l = pennation_cosine(par, fibre)
    F0, Ls = par[MUSCLE.F0], par[MUSCLE.Ls]
    ft, ft_e = tendon_force((length - fibre * c) / Ls - 1.0, par[MUSCLE.toe_strain], par[MUSCLE.tendon_slope])
    by_length = F0 * ft_e / Ls
    return F0 * ft, by_length, -by_length * (c + fibre * c_l)


@compiled
def tendon_length(par, force):
    """Length of the tendon that carries a force [m]: the inverse of the tendon curve."""
    f, e_toe, k_lin = force / par[MUSCLE.F0], par[MUSCLE.toe_strain], par[MUSCLE.tendon_slope]
    if f <= 0.0:
        strain = 0.0
    elif f <= TOE_FORCE:
        strain = e_toe / TOE_SHAPE * math.log1p(f * TOE_GROWTH / TOE_FORCE)
    else:
        strain = e_toe + (f - TOE_FORCE) / k_lin
    return par[MUSCLE.Ls] * (1.0 + strain)


@compiled
def fibre_state(par, fibre, rate, a):
    """Forces of a fibre without its stop: active and passive [N]; derivatives as in `held_fibre_state`."""
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
def held_fibre_state(par, fibre, rate, a):
    """Active and passive fibre force [N]; derivatives of the active by q_m, its rate and a, of the passive by q_m."""
    stop, stop_l = fibre_stop(par, fibre)
    active, passive, by_l, by_v, by_a, passive_l = fibre_state(par, fibre, rate - stop, a)
    if stop > 0.0:
        active, _, _, by_v, by_a, _ = fibre_state(par, stop_begins(par), rate - stop, a)
        by_l = -by_v * stop_l
    return active, passive, by_l, by_v, by_a, passive_l


@compiled
def fibre_pull(par, fibre, rate, a):
    """Force of the fibre along the tendon [N]; its derivatives by q_m, its rate and a."""
    active, passive, by_l, by_v, by_a, passive_l = held_fibre_state(par, fibre, rate, a)
    top = stop_begins(par)
    if fibre < top:
        c, c_l = pennation_cosine(par, top)[0], 0.0
    else:
        c, c_l = pennation_cosine(par, fibre)
    return (active + passive) * c, (by_l + passive_l) * c + (active + passive) * c_l, by_v * c, by_a * c


@compiled
def surplus(par, length, fibre, a):
    """Force along the tendon of a fibre at rest, its stop left out, less that of the tendon [N]."""
    active, passive = fibre_state(par, fibre, 0.0, a)[:2]
    return (active + passive) * pennation_cosine(par, fibre)[0] - tendon_state(par, length, fibre)[0]


@compiled
def _rest_on_stop(par, length, a):
    """Fibre length [m] on the stop at which it pulls as much as the tendon, to rounding."""
    low, high = smallest_fibre(par), stop_begins(par)
    for _ in range(MOST_TRIALS):
        x = 0.5 * (low + high)
        if not low < x < high:
            break
        if fibre_pull(par, x, 0.0, a)[0] > tendon_state(par, length, x)[0]:
            high = x
        else:
            low = x
    return high


@compiled
def fibre_at_rest(par, length, a):
    """Fibre length [m] at which the fibre row is 0 at rate 0, to rounding; on the stop where there is no more room."""
    height, room = par[MUSCLE.height], length - par[MUSCLE.Ls]
    top = stop_begins(par)
    low = max(steepest_fibre(par), 1e-3 * par[MUSCLE.L0]) * (1.0 + 1e-12)
    # The tendon is slack at the upper end, where the fibre pulls; it is strained most at the lower end.
    high = math.hypot(max(room, 0.0), height)
    if high <= top:
        return _rest_on_stop(par, length, a)
    f_low, f_high, moved = surplus(par, length, low, a), surplus(par, length, high, a), 0.0
    if f_low >= 0.0:
        low, f_low = top, surplus(par, length, top, a)
    if f_low >= 0.0:
        return _rest_on_stop(par, length, a)
    for _ in range(MOST_TRIALS):
        x = trial(low, f_low, high, f_high)
        if not low < x < high:
            break
        low, f_low, high, f_high, moved = narrowed(low, f_low, high, f_high, moved, x, surplus(par, length, x, a))
    found = low if -f_low < f_high else high
    return found if found > top else _rest_on_stop(par, length, a)
