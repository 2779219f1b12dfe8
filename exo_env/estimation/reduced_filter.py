"""The elbow's filter with one freedom, compiled: what a worn device knows, at a price that an environment can pay.

In a device that is worn as it should be, elbow and hinge turn as one, and the nominal elbow (nominal_elbow.py) is

    I theta'' = net,    F d = grip - I_l theta'',    others = net - grip,    I = I_f + I_l

with F the cuff's force, d its lever, I_f and I_l the inertias of forearm and lower link. A Kalman filter of
(theta, theta', net, grip) sees angle, rate and F; net forgets in a short time and has a power that is learnt, grip
walks. Both filters are one model: this one steps it exactly, the other as differential-algebraic equations.

What others put on the elbow is then split, by a second, slow filter of (intended, left):

    others = intended - left hold(theta),    muscles = others + own + load kilogram + inertia of what is held

hold is what the nominal arm and a usual load need at rest, and `left` the part of it that the patient leaves to the
device. `intended` is what the muscles give beyond the part that they have carried lately: nothing at rest, whoever
carries, and that by which the arm is to be moved.

From others alone load and muscles cannot be told apart, however long one looks. So the load is what its prior and the
present `left` say together, as if that were a single reading, and keeps nearly all of its prior's deviation; the
muscles' moment has it too. Where the elbow rests on a stop, nothing tells what the stop carries.
"""

from __future__ import annotations

import math

from dms_core.compiled.jit import compiled
from exo_env.places import places

SENSED = places(("angle", "rate", "force"))
"""Places of what the device measures: hinge [rad], its rate [rad/s], and the cuff's force [N]."""
BELIEF = places(("angle", "rate", "net", "grip", "intended", "left"))
"""Places in the mean: the first four are those of the fast filter, the others those of the slow one."""
LEARNT = places(("net_power", "lost"))
"""Places of what is learnt on the way: mean square of net [Nm^2]; and how often the filter began anew."""
CURVES = places(("own", "kilogram", "held_inertia", "flexors", "extensors"))
"""Columns of the table over the angle: moments that hold arm with handle [Nm] and a kilogram [Nm/kg], inertia of a
kilogram about the elbow [m^2], and the most that nominal flexors and extensors give, both from 0 [Nm]."""
ESTIMATE_NAMES = ("others_moment", "muscle_moment", "intended_moment", "load", "effort")
"""What is estimated; effort is the muscles' moment over the most that nominal ones give."""
DEVIATION = "_deviation"
"""Ending of the name of an estimate's standard deviation."""
ESTIMATE = places(x + end for x in ESTIMATE_NAMES for end in ("", DEVIATION))
"""Places of the estimates, each with its standard deviation behind it."""
NUMBERS = places((
    "period", "first_angle", "angle_step", "arm_share", "link_share", "lever", "handle_inertia", "by_inertia",
    "angle_by_net", "rate_by_net", "net_keep", "angle_noise", "rate_noise", "force_noise",
    "start_angle", "start_rate", "start_net", "start_grip", "least_power", "learning", "walk", "walk_share",
    "inertia_doubt", "weight_doubt", "intended_keep", "intended_least", "intended_share", "left_keep", "left_mean",
    "left_deviation", "load_mean", "load_by_left", "load_deviation", "straight", "bent", "stop_doubt",
))  # fmt: skip
"""Numbers of the filter; see reduced_elbow.py for what each is."""
FAST, SLOW = 4, 2
UNSEEN_RATE = 2.0
"""Deviation of a rate that was not seen at the start [rad/s]."""


@compiled
def begin_estimates(sensed, numbers, curves, disturbance, mean, fast, slow, learnt, out):
    """Begin with first readings; one that is missing, or no finite number, leaves its place to a guess that is unsure.

    Where numbers come out that are not finite, no reading was worth anything, and all are left out.

    Args:
        sensed: readings, at the places of SENSED.
        numbers: at the places of NUMBERS.
        curves: table over the angle with the columns of CURVES, shape (k, 5).
        disturbance: covariance that a unit of net's power adds in a period, shape (3, 3).
        mean: at the places of BELIEF; filled.
        fast: covariance of the first four of them, shape (4, 4); filled.
        slow: covariance of the others, shape (2, 2); filled.
        learnt: at the places of LEARNT; filled but for the count of new beginnings.
        out: at the places of ESTIMATE; filled.
    """
    _start(sensed[SENSED.angle], sensed[SENSED.rate], numbers, curves, mean, fast, slow, learnt)
    _correct_fast(sensed, numbers, mean, fast, learnt)
    if not _conclude(numbers, curves, mean, fast, slow, out):
        _start(math.nan, math.nan, numbers, curves, mean, fast, slow, learnt)
        _conclude(numbers, curves, mean, fast, slow, out)


@compiled
def _start(angle, rate, n, curves, mean, fast, slow, learnt):
    """What is believed at first, of an angle and a rate that are seen or not."""
    for i in range(FAST):
        mean[i] = 0.0
        for j in range(FAST):
            fast[i, j] = 0.0
    for i in range(SLOW):
        for j in range(SLOW):
            slow[i, j] = 0.0
    reach = 0.5 * n[NUMBERS.angle_step] * (curves.shape[0] - 1)
    mean[BELIEF.angle], fast[0, 0] = angle, n[NUMBERS.start_angle] ** 2
    if not abs(angle) < math.inf:
        # Anywhere between the ends of the table.
        mean[BELIEF.angle], fast[0, 0] = n[NUMBERS.first_angle] + reach, reach**2
    mean[BELIEF.rate], fast[1, 1] = rate, n[NUMBERS.start_rate] ** 2
    if not abs(rate) < math.inf:
        mean[BELIEF.rate], fast[1, 1] = 0.0, UNSEEN_RATE**2
    fast[2, 2], fast[3, 3] = n[NUMBERS.start_net] ** 2, n[NUMBERS.start_grip] ** 2
    learnt[LEARNT.net_power] = fast[2, 2]
    mean[BELIEF.intended], mean[BELIEF.left] = 0.0, n[NUMBERS.left_mean]
    slow[0, 0], slow[1, 1] = n[NUMBERS.intended_least] ** 2, n[NUMBERS.left_deviation] ** 2


@compiled
def step_estimates(sensed, numbers, curves, disturbance, mean, fast, slow, learnt, out):
    """Go on to the readings of the next period; where numbers are not finite any more, begin anew.

    A reading that is no finite number is a missing one: what it would tell is left to the prediction, whose deviation
    grows.

    Arguments are those of `begin_estimates`.
    """
    _predict_fast(numbers, disturbance, mean, fast, learnt)
    _correct_fast(sensed, numbers, mean, fast, learnt)
    _predict_slow(numbers, mean, slow, learnt)
    if not _conclude(numbers, curves, mean, fast, slow, out):
        learnt[LEARNT.lost] += 1.0
        begin_estimates(sensed, numbers, curves, disturbance, mean, fast, slow, learnt, out)


@compiled
def _predict_fast(n, disturbance, mean, P, learnt):
    """mean <- A mean, P <- A P A^T + Q, with A and Q as the exact solution over a period gives them."""
    power = max(learnt[LEARNT.net_power], n[NUMBERS.least_power])
    T, keep = n[NUMBERS.period], n[NUMBERS.net_keep]
    by_angle, by_rate = n[NUMBERS.angle_by_net], n[NUMBERS.rate_by_net]
    mean[0] += T * mean[1] + by_angle * mean[2]
    mean[1] += by_rate * mean[2]
    mean[2] *= keep
    for j in range(FAST):
        P[0, j] += T * P[1, j] + by_angle * P[2, j]
        P[1, j] += by_rate * P[2, j]
        P[2, j] *= keep
    for i in range(FAST):
        P[i, 0] += T * P[i, 1] + by_angle * P[i, 2]
        P[i, 1] += by_rate * P[i, 2]
        P[i, 2] *= keep
    for i in range(3):
        for j in range(3):
            P[i, j] += power * disturbance[i, j]
    walk = n[NUMBERS.walk] + n[NUMBERS.walk_share] * math.sqrt(power)
    P[3, 3] += walk * walk * T


@compiled
def _correct_fast(sensed, n, mean, P, learnt):
    """Take the readings one after the other, then learn the power of net."""
    _take(mean, P, sensed[SENSED.angle], n[NUMBERS.angle_noise], 1.0, 0.0, 0.0, 0.0)
    _take(mean, P, sensed[SENSED.rate], n[NUMBERS.rate_noise], 0.0, 1.0, 0.0, 0.0)
    d = n[NUMBERS.lever]
    _take(mean, P, sensed[SENSED.force], n[NUMBERS.force_noise], 0.0, 0.0, -n[NUMBERS.link_share] / d, 1.0 / d)
    learnt[LEARNT.net_power] += n[NUMBERS.learning] * (mean[2] ** 2 + P[2, 2] - learnt[LEARNT.net_power])


@compiled
def _take(mean, P, reading, noise, h0, h1, h2, h3):
    """Correct by one reading h . x with a variance of noise, in Joseph's form; one that is no number tells nothing."""
    if not abs(reading) < math.inf:
        return
    v0 = P[0, 0] * h0 + P[0, 1] * h1 + P[0, 2] * h2 + P[0, 3] * h3
    v1 = P[1, 0] * h0 + P[1, 1] * h1 + P[1, 2] * h2 + P[1, 3] * h3
    v2 = P[2, 0] * h0 + P[2, 1] * h1 + P[2, 2] * h2 + P[2, 3] * h3
    v3 = P[3, 0] * h0 + P[3, 1] * h1 + P[3, 2] * h2 + P[3, 3] * h3
    S = h0 * v0 + h1 * v1 + h2 * v2 + h3 * v3 + noise
    surprise = reading - (h0 * mean[0] + h1 * mean[1] + h2 * mean[2] + h3 * mean[3])
    v, k = (v0, v1, v2, v3), (v0 / S, v1 / S, v2 / S, v3 / S)
    for i in range(FAST):
        mean[i] += k[i] * surprise
    for i in range(FAST):
        for j in range(i + 1):
            # (1 - k h) P (1 - k h)^T + noise k k^T, multiplied out.
            P[i, j] += S * k[i] * k[j] - k[i] * v[j] - v[i] * k[j]
            P[j, i] = P[i, j]


@compiled
def _predict_slow(n, mean, P, learnt):
    """What is intended is soon forgotten; `left` goes back, in seconds, to what it is of most patients."""
    a, b, usual = n[NUMBERS.intended_keep], n[NUMBERS.left_keep], n[NUMBERS.left_mean]
    mean[BELIEF.intended] *= a
    mean[BELIEF.left] = usual + b * (mean[BELIEF.left] - usual)
    size = n[NUMBERS.intended_least] ** 2 + n[NUMBERS.intended_share] ** 2 * learnt[LEARNT.net_power]
    P[0, 0] = a * a * P[0, 0] + (1.0 - a * a) * size
    P[0, 1] = P[1, 0] = a * b * P[0, 1]
    P[1, 1] = b * b * P[1, 1] + (1.0 - b * b) * n[NUMBERS.left_deviation] ** 2


@compiled
def _conclude(n, curves, mean, fast, slow, out):
    """Split what others put on the elbow, and fill the estimates with their deviations.

    Returns:
        Whether belief and estimates can be used. Where the belief cannot, the table is not read, since an angle that is
        no number has no place in it, and the estimates are no numbers.
    """
    if not _usable(mean, fast, slow):
        for i in range(out.shape[0]):
            out[i] = math.nan
        return False
    place = (mean[BELIEF.angle] - n[NUMBERS.first_angle]) / n[NUMBERS.angle_step]
    place = min(max(place, 0.0), curves.shape[0] - 1.000001)
    k = int(place)
    part = place - k
    own = _between(curves, k, part, CURVES.own)
    kilogram = _between(curves, k, part, CURVES.kilogram)
    net, grip, acceleration = mean[BELIEF.net], mean[BELIEF.grip], mean[BELIEF.net] * n[NUMBERS.by_inertia]
    others = net - grip
    doubt = n[NUMBERS.inertia_doubt] * n[NUMBERS.arm_share]
    variance = fast[2, 2] - 2.0 * fast[2, 3] + fast[3, 3] + doubt * doubt * (net * net + fast[2, 2])
    _split(others, variance, own + n[NUMBERS.load_mean] * kilogram, mean, slow)
    load = n[NUMBERS.load_mean] + n[NUMBERS.load_by_left] * (mean[BELIEF.left] - n[NUMBERS.left_mean])
    load, unsure_load = max(load, 0.0), n[NUMBERS.load_deviation]
    per_kilogram = kilogram + _between(curves, k, part, CURVES.held_inertia) * acceleration
    muscles = others + own + n[NUMBERS.handle_inertia] * acceleration + load * per_kilogram
    unsure = variance + (per_kilogram * unsure_load) ** 2 + (n[NUMBERS.weight_doubt] * own) ** 2
    if not n[NUMBERS.straight] < mean[BELIEF.angle] < n[NUMBERS.bent]:
        unsure += n[NUMBERS.stop_doubt] ** 2
    most = _between(curves, k, part, CURVES.flexors if muscles >= 0.0 else CURVES.extensors)
    out[ESTIMATE.others_moment], out[ESTIMATE.others_moment_deviation] = others, math.sqrt(variance)
    out[ESTIMATE.muscle_moment], out[ESTIMATE.muscle_moment_deviation] = muscles, math.sqrt(unsure)
    out[ESTIMATE.intended_moment], out[ESTIMATE.intended_moment_deviation] = (
        mean[BELIEF.intended],
        math.sqrt(slow[0, 0]),
    )
    out[ESTIMATE.load], out[ESTIMATE.load_deviation] = load, unsure_load
    out[ESTIMATE.effort], out[ESTIMATE.effort_deviation] = muscles / most, math.sqrt(unsure) / most
    total = 0.0
    for i in range(out.shape[0]):
        total += out[i]
    return math.isfinite(total) and _usable(mean, fast, slow)


@compiled
def _between(curves, k, part, column):
    """A column of the table between rows k and k + 1."""
    return curves[k, column] + part * (curves[k + 1, column] - curves[k, column])


@compiled
def _split(others, noise, hold, mean, P):
    """Correct the slow filter by others = intended - left hold, with a variance of noise, in Joseph's form."""
    v0, v1 = P[0, 0] - hold * P[0, 1], P[1, 0] - hold * P[1, 1]
    S = v0 - hold * v1 + noise
    k0, k1 = v0 / S, v1 / S
    surprise = others - mean[BELIEF.intended] + hold * mean[BELIEF.left]
    mean[BELIEF.intended] += k0 * surprise
    mean[BELIEF.left] += k1 * surprise
    P[0, 0] += S * k0 * k0 - 2.0 * k0 * v0
    P[0, 1] += S * k0 * k1 - k0 * v1 - v0 * k1
    P[1, 1] += S * k1 * k1 - 2.0 * k1 * v1
    P[1, 0] = P[0, 1]


@compiled
def _usable(mean, fast, slow):
    """Whether all that is believed is finite and no variance negative."""
    total, least = 0.0, 0.0
    for i in range(mean.shape[0]):
        total += mean[i]
    for P in (fast, slow):
        for i in range(P.shape[0]):
            least = min(least, P[i, i])
            for j in range(P.shape[0]):
                total += P[i, j]
    return math.isfinite(total) and least >= 0.0
