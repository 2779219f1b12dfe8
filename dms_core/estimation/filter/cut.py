"""Mean and variance of a standard normal distribution that is cut at two bounds, compiled."""

import math

from dms_core.compiled.jit import compiled

FAR = 30.0
"""Deviations beyond which what is left of the distribution lies at the bound."""
NOTHING = 36.0
"""Deviations below the mean below which nothing lies that a number can hold."""
LEAST_VARIANCE = 1e-12
IN_THE_TAIL, TERMS = 3.0, 60
"""Deviations from which on a continued fraction tells what lies beyond to the last digit, and its terms."""
NONE = 40.0
"""Logarithm of the ratio of two densities from which on the smaller one counts for nothing."""


@compiled
def _excess(z):
    """density(z) / (part above z) - z, for z of IN_THE_TAIL and more: 1 / (z + 2 / (z + 3 / (z + ...)))."""
    below = z
    for k in range(TERMS, 1, -1):
        below = z + k / below
    return 1.0 / below


@compiled
def _log_below(x):
    """Logarithm of the part of the distribution that lies below x, for x above -NOTHING."""
    if x == math.inf:
        return 0.0
    if x > 0.0:
        return math.log1p(-0.5 * math.erfc(x / math.sqrt(2.0)))
    return math.log(0.5 * math.erfc(-x / math.sqrt(2.0)))


@compiled
def _density(x, log_mass):
    """Density at x of the distribution, over the part that is left."""
    return math.exp(-0.5 * x * x - log_mass) / math.sqrt(2.0 * math.pi) if abs(x) < math.inf else 0.0


@compiled
def _moments_from_below(a, b):
    """As `cut_moments`, for a <= 0 and b >= -FAR: there the logarithms keep their digits."""
    if b < -IN_THE_TAIL and 0.5 * (a * a - b * b) > NONE:
        excess = _excess(-b)
        return b - excess, max(1.0 - excess * (excess - b), LEAST_VARIANCE)
    log_mass = _log_below(b)
    if a > -NOTHING:
        log_mass += math.log1p(-math.exp(min(_log_below(a) - log_mass, -1e-300)))
    at_a, at_b = _density(a, log_mass), _density(b, log_mass)
    mean = at_a - at_b
    ends = (a * at_a if abs(a) < math.inf else 0.0) - (b * at_b if abs(b) < math.inf else 0.0)
    return mean, max(1.0 + ends - mean * mean, LEAST_VARIANCE)


@compiled
def cut_moments(a, b):
    """(mean, variance) of a standard normal distribution cut at a < b, either of which may be infinite."""
    if a > FAR:
        return a + 1.0 / a, 1.0 / (a * a)
    if b < -FAR:
        return b + 1.0 / b, 1.0 / (b * b)
    if a > 0.0:
        mean, variance = _moments_from_below(-b, -a)
        return -mean, variance
    return _moments_from_below(a, b)
