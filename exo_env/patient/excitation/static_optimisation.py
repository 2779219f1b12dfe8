"""Compiled core of the motor command (motor_command.py): arrays in, arrays out, no allocation inside the iteration.

The geometry is that of a hinge: a point p of the forearm is at x(theta) = elbow + R(theta) p, with x' = axis x (R p)
and x'' = axis x x', so that lengths, moment arms and their derivatives are exact.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from dms_core.compiled.jit import compiled
from dms_core.model.geometry.rotations import add, cross, dot, sub, turned, vec
from dms_core.model.muscles.activation import MINIMUM
from dms_core.model.muscles.fibre import (
    MUSCLE,
    fibre_at_rest,
    fibre_state,
    pennation_cosine,
    smallest_fibre,
    tendon_state,
)
from dms_core.model.muscles.thelen_curves import TOE_FORCE, TOE_SHAPE

TOE_GROWTH = math.expm1(TOE_SHAPE)


class ArmTable(NamedTuple):
    """An arm and its load as arrays."""

    muscles: np.ndarray
    """Numbers of each muscle (`ThelenMuscle.numbers`), shape (n, 15), n muscles."""
    sign: np.ndarray
    """+1 for a flexor, -1 for an extensor, shape (n,)."""
    first: np.ndarray
    """First point of each muscle's path, then the number of all points, shape (n + 1,)."""
    moving: np.ndarray
    """True for a point of the forearm, False for one of the ground, shape (n,)."""
    points: np.ndarray
    """Points of the paths in the frame of the forearm or in ground axes [m], shape (n, 3)."""
    axis: np.ndarray
    """Axis of the elbow [-], shape (3,)."""
    elbow: np.ndarray
    """Centre of the elbow [m], shape (3,)."""


class LoadTable(NamedTuple):
    """Forearm, handle and weight, which the muscles carry."""

    inertia: float
    """Inertia of the forearm about the elbow [kg m^2]."""
    mass: float
    """Mass of the forearm [kg]."""
    centre_of_mass: np.ndarray
    """Centre of mass of the forearm in its frame [m], shape (3,)."""
    grip: np.ndarray
    """Centre of the grip in the forearm's frame [m], shape (3,)."""
    handle: float
    """Mass of the handle [kg]."""
    weight: float
    """Expected mass of the weight [kg]."""
    pulley: np.ndarray
    """Low pulley in ground axes [m], shape (3,)."""
    gravity: np.ndarray
    """Gravity in ground axes [m/s^2], shape (3,)."""


@compiled
def row(x, k):
    """Row k as a tuple: an array of it would be dear inside a loop."""
    return x[k, 0], x[k, 1], x[k, 2]


@compiled
def path_geometry(arm, muscle, angle):
    """(length [m], moment arm -dl/dtheta [m]) of a muscle at an elbow angle [rad]."""
    return path_at(arm, muscle, math.cos(angle), math.sin(angle))


@compiled
def path_at(arm, muscle, c, s):
    """`path_geometry` at an angle of that cosine and sine.

    Only segments between forearm and ground change; the others are as long as in the frame of their points.
    """
    n, e = vec(arm.axis, 0), vec(arm.elbow, 0)
    length, lever = 0.0, 0.0
    for k in range(arm.first[muscle] + 1, arm.first[muscle + 1]):
        a, b = row(arm.points, k - 1), row(arm.points, k)
        if arm.moving[k] == arm.moving[k - 1]:
            d = sub(b, a)
            length += math.sqrt(dot(d, d))
            continue
        if arm.moving[k - 1]:
            a, b = b, a
        r = turned(n, c, s, b)
        d = sub(add(e, r), a)
        segment = math.sqrt(dot(d, d))
        length += segment
        lever -= dot(d, cross(n, r)) / segment
    return length, lever


@compiled
def muscle_moment(arm, angle, activations):
    """Moment that muscles at rest give about the elbow [Nm]; a fibre on its stop leaves its tendon slack."""
    found = 0.0
    for i in range(arm.muscles.shape[0]):
        par = arm.muscles[i]
        length, lever = path_geometry(arm, i, angle)
        found += lever * tendon_state(par, length, fibre_at_rest(par, length, activations[i]))[0]
    return found


@compiled
def needed_moment(arm, load, angle, rate, acceleration):
    """Moment that the muscles must give about the elbow axis [Nm]."""
    n, g = vec(arm.axis, 0), vec(load.gravity, 0)
    g_size = math.sqrt(dot(g, g))
    c, s = math.cos(angle), math.sin(angle)
    grip = vec(load.grip, 0)
    centre, r = turned(n, c, s, vec(load.centre_of_mass, 0)), turned(n, c, s, grip)
    slope = cross(n, r)
    bend = cross(n, slope)
    e, p = vec(arm.elbow, 0), vec(load.pulley, 0)
    d = sub(add(e, r), p)
    rope = math.sqrt(dot(d, d))
    rope_1 = dot(d, slope) / rope
    rope_2 = (dot(slope, slope) + dot(d, bend) - rope_1 * rope_1) / rope
    lifted = load.weight * rope_1 * (g_size + rope_1 * acceleration + rope_2 * rate * rate)
    handle = load.handle * (g_size * slope[1] + dot(grip, grip) * acceleration)
    own = load.inertia * acceleration - load.mass * dot(n, cross(centre, g))
    return own + lifted + handle


@compiled
def needed_moments(arm, load, weights, course, moment):
    """moment[k] of psi, its rate and its acceleration in course[k] with the weight weights[k] on the machine [Nm]."""
    for k in range(course.shape[0]):
        moment[k] = needed_moment(arm, with_weight(load, weights[k]), course[k, 0], course[k, 1], course[k, 2])


@compiled
def with_weight(load, weight):
    """A LoadTable with another weight [kg]."""
    return LoadTable(
        load.inertia, load.mass, load.centre_of_mass, load.grip, load.handle, weight, load.pulley, load.gravity
    )


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
def given_moment(full, multiplier):
    """(moment [Nm] of the activations multiplier times full, within their limits; its slope by the multiplier)."""
    moment, slope = 0.0, 0.0
    for i in range(full.shape[0]):
        a = multiplier * full[i]
        if a <= MINIMUM:
            moment += MINIMUM * full[i]
        elif a >= 1.0:
            moment += full[i]
        else:
            moment += a * full[i]
            slope += full[i] * full[i]
    return moment, slope


@compiled
def least_squares(wanted, full, out):
    """Activations of least squares that give a moment; returns what they give too much [Nm].

    The moment is a rising, piecewise straight function of the multiplier: Newton's method ends exactly on its zero,
    and bisection takes over where a step leaves the bracket.
    """
    smallest = math.inf
    for i in range(full.shape[0]):
        smallest = min(smallest, abs(full[i]))
    high = 1.0 / max(smallest, 1e-6)
    low = -high
    multiplier = 0.0
    if given_moment(full, high)[0] <= wanted:
        multiplier = high
    elif given_moment(full, low)[0] >= wanted:
        multiplier = low
    else:
        for _ in range(200):
            moment, slope = given_moment(full, multiplier)
            if moment > wanted:
                high = multiplier
            else:
                low = multiplier
            trial = multiplier - (moment - wanted) / slope if slope > 0.0 else math.inf
            trial = trial if low < trial < high else 0.5 * (low + high)
            if abs(trial - multiplier) <= 1e-14 * (1.0 + abs(trial)):
                break
            multiplier = trial
    for i in range(full.shape[0]):
        out[i] = min(max(multiplier * full[i], MINIMUM), 1.0)
    return given_moment(full, multiplier)[0] - wanted


@compiled
def forces(arm, interval, lengths, tendon_force, activations, fibre, full, passive):
    """Force along the tendon at full activation without the passive part, and that part [N], shapes (n, m)."""
    n, last = lengths.shape[0], lengths.shape[0] - 1
    for i in range(arm.muscles.shape[0]):
        par = arm.muscles[i]
        for k in range(n):
            along = max(lengths[k, i] - tendon_length(par, tendon_force[k, i]), 1e-3 * par[MUSCLE.L0])
            fibre[k] = max(math.hypot(along, par[MUSCLE.height]), smallest_fibre(par))
        for k in range(n):
            here, there = min(k + 1, last), max(k - 1, 0)
            velocity = (fibre[here] - fibre[there]) / ((here - there) * interval)
            active, parallel = fibre_state(par, fibre[k], velocity, activations[k, i])[:2]
            cosine = pennation_cosine(par, fibre[k])[0]
            full[k, i], passive[k, i] = active / activations[k, i] * cosine, parallel * cosine


@compiled
def sweep(arm, interval, moment, lengths, levers, relaxation, tendon_force, activations, work, moments):
    """One iteration between tendon strain and activation. Gives (largest change of an activation, shortage [Nm]).

    work holds full and passive [N], shape (2, n, m); moments, shape (2, m), takes those of the muscles at full
    activation [Nm], then the activations.
    """
    n, m = lengths.shape
    full, passive = work[0], work[1]
    change, shortage = 0.0, 0.0
    for k in range(n):
        wanted = moment[k]
        for i in range(m):
            wanted -= levers[k, i] * passive[k, i]
            moments[0, i] = levers[k, i] * full[k, i]
        shortage = max(shortage, abs(least_squares(wanted, moments[0], moments[1])))
        for i in range(m):
            change = max(change, abs(moments[1, i] - activations[k, i]))
            activations[k, i] = moments[1, i]
            carried = activations[k, i] * full[k, i] + passive[k, i]
            tendon_force[k, i] += relaxation * (carried - tendon_force[k, i])
    return change, shortage


@compiled
def planned(arm, interval, course, moment, sweeps, relaxation, settled, activations):
    """Fill activations [-] that give a moment along a course, shape (n, m), m muscles.

    Gives the largest shortage [Nm] and the estimated error in an activation, at least `settled` where the iteration did
    not end by itself: changes fall by a rate r from one iteration to the next, and r / (1 - r) of the last is left.

    Args:
        arm: an ArmTable.
        interval: time between samples [s].
        course: psi, its rate and its acceleration, shape (n, 3).
        moment: that is needed [Nm], shape (n,).
        sweeps: largest number of iterations.
        relaxation: share of a new tendon force that an iteration takes over; the first takes all.
        settled: estimated error in an activation that ends the iteration.
        activations: filled.
    """
    n, m = activations.shape
    lengths, levers, tendon_force = np.zeros((n, m)), np.zeros((n, m)), np.zeros((n, m))
    work, moments, fibre = np.zeros((2, n, m)), np.zeros((2, m)), np.zeros(n)
    for k in range(n):
        c, s = math.cos(course[k, 0]), math.sin(course[k, 0])
        for i in range(m):
            lengths[k, i], levers[k, i] = path_at(arm, i, c, s)
            activations[k, i] = MINIMUM
    before, left, shortage = math.inf, math.inf, 0.0
    for k in range(sweeps):
        forces(arm, interval, lengths, tendon_force, activations, fibre, work[0], work[1])
        change, shortage = sweep(
            arm, interval, moment, lengths, levers, relaxation if k > 0 else 1.0, tendon_force, activations, work,
            moments,
        )  # fmt: skip
        # A tendon force that nothing answers to comes nearer at 1 - relaxation.
        rate = max(change / before, 1.0 - relaxation) if k > 0 else 0.5
        left = change * rate / (1.0 - rate) if rate < 1.0 else math.inf
        if left < settled:
            break
        before = change
    # Largest values do not see a number that is none; sums do.
    return (shortage, left) if np.abs(moment).sum() + activations.sum() < math.inf else (math.inf, math.inf)


@compiled
def interpolated(table, rows, interval, period, out):
    """Fill `out` by linear interpolation of a table in time.

    Args:
        table: values, shape (k, m).
        rows: row that holds at each multiple of the interval, shape (n,).
        interval: time between two samples of the table [s].
        period: time from one row of `out` to the next [s].
        out: filled, shape (p, m).
    """
    last = rows.shape[0] - 1
    for k in range(out.shape[0]):
        x = k * period / interval
        i = min(int(x), last - 1)
        part = min(x - i, 1.0)
        for j in range(out.shape[1]):
            near, far = table[rows[i], j], table[rows[i + 1], j]
            out[k, j] = near + part * (far - near)
