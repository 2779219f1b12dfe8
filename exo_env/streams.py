"""Streams of random numbers by name: what is drawn for one thing never moves what is drawn for another.

An episode has one key, a number that the environment's generator gives at each reset. Every thing that is drawn in it,
a field of the patient, the load, a number of the movement, the noise of a channel, has a stream of its own, which is
known by the key and the thing's name. Number i of a stream is a function of key, name and i alone (a counter-based
generator), so that nothing is stored, nothing depends on an order, and compiled code draws without a Python object.

The function is Philox4x32-10 (Salmon, Moraes, Dror and Shaw 2011, Parallel random numbers: as easy as 1, 2, 3, SC11):
the key is the episode's, the counter holds the name and i / 2. Two words of 32 bits make a number of 53 bits.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Iterable

import numpy as np

from dms_core.compiled.jit import compiled

_WORD = np.uint64(0xFFFFFFFF)
_HALF = np.uint64(32)
_MULTIPLIER_0, _MULTIPLIER_1 = np.uint64(0xD2511F53), np.uint64(0xCD9E8D57)
_WEYL_0, _WEYL_1 = np.uint64(0x9E3779B9), np.uint64(0xBB67AE85)
_ROUNDS = 10


def stream(name: str) -> np.uint64:
    """The number by which compiled code knows the stream of a name."""
    return np.uint64(int.from_bytes(hashlib.blake2b(name.encode(), digest_size=8).digest(), "little"))


def streams(names: Iterable[str]) -> np.ndarray:
    """Numbers of several streams, see `stream`, shape (n,)."""
    return np.array([stream(name) for name in names], np.uint64)


@compiled
def philox(c0, c1, c2, c3, k0, k1):
    """Four words of 32 bits from a counter of four and a key of two; all are held in 64 bits without sign."""
    for _ in range(_ROUNDS):
        first, second = _MULTIPLIER_0 * c0, _MULTIPLIER_1 * c2
        c0, c1, c2, c3 = (
            (second >> _HALF) ^ c1 ^ k0, second & _WORD, (first >> _HALF) ^ c3 ^ k1, first & _WORD,
        )  # fmt: skip
        k0, k1 = (k0 + _WEYL_0) & _WORD, (k1 + _WEYL_1) & _WORD
    return c0, c1, c2, c3


@compiled
def block(key, name, i):
    """Numbers 2 i and 2 i + 1 of a stream as whole numbers of 53 bits."""
    a, b, c, d = philox(np.uint64(i), np.uint64(0), name & _WORD, name >> _HALF, key & _WORD, key >> _HALF)
    low, high, shift = np.uint64(5), np.uint64(6), np.uint64(26)
    return ((a >> low) << shift) | (b >> high), ((c >> low) << shift) | (d >> high)


@compiled
def uniform(key, name, i):
    """Number i of a stream, at least 0 and below 1."""
    even, odd = block(key, name, i // 2)
    return float(even if i % 2 == 0 else odd) / 9007199254740992.0


@compiled
def uniforms(key, names, out):
    """The first number of each of several streams, shape (n,)."""
    for k in range(names.shape[0]):
        out[k] = uniform(key, names[k], 0)


@compiled
def fill_normals(key, name, out):
    """Standard normal numbers of a stream into a vector."""
    n = out.shape[0]
    for i in range((n + 1) // 2):
        even, odd = block(key, name, i)
        out[2 * i] = normal_quantile(_open(even))
        if 2 * i + 1 < n:
            out[2 * i + 1] = normal_quantile(_open(odd))


@compiled
def _open(whole):
    """A number of 53 bits as one that is neither 0 nor 1; half of the last bit is added exactly."""
    return (float(whole >> np.uint64(1)) + 0.5) / 4503599627370496.0


@compiled
def _ratio(p, q, x):
    """Ratio of two polynomials of degree 7."""
    above, below = p[7], q[7]
    for k in range(6, -1, -1):
        above, below = above * x + p[k], below * x + q[k]
    return above / below


@compiled
def normal_quantile(p):
    """Quantile of the standard normal distribution, 0 < p < 1 (algorithm AS 241: Wichura 1988, Appl. Stat. 37:477)."""
    q = p - 0.5
    if abs(q) <= 0.425:
        return q * _ratio(_NEAR[0], _NEAR[1], 0.180625 - q * q)
    r = math.sqrt(-math.log(p if q < 0.0 else 1.0 - p))
    x = _ratio(_FAR[0], _FAR[1], r - 1.6) if r <= 5.0 else _ratio(_VERY_FAR[0], _VERY_FAR[1], r - 5.0)
    return x if q >= 0.0 else -x


_NEAR = (
    (3.3871328727963666080e0, 1.3314166789178437745e2, 1.9715909503065514427e3, 1.3731693765509461125e4,
     4.5921953931549871457e4, 6.7265770927008700853e4, 3.3430575583588128105e4, 2.5090809287301226727e3),
    (1.0, 4.2313330701600911252e1, 6.8718700749205790830e2, 5.3941960214247511077e3,
     2.1213794301586595867e4, 3.9307895800092710610e4, 2.8729085735721942674e4, 5.2264952788528545610e3),
)  # fmt: skip
_FAR = (
    (1.42343711074968357734e0, 4.63033784615654529590e0, 5.76949722146069140550e0, 3.64784832476320460504e0,
     1.27045825245236838258e0, 2.41780725177450611770e-1, 2.27238449892691845833e-2, 7.74545014278341407640e-4),
    (1.0, 2.05319162663775882187e0, 1.67638483018380384940e0, 6.89767334985100004550e-1,
     1.48103976427480074590e-1, 1.51986665636164571966e-2, 5.47593808499534494600e-4, 1.05075007164441684324e-9),
)  # fmt: skip
_VERY_FAR = (
    (6.65790464350110377720e0, 5.46378491116411436990e0, 1.78482653991729133580e0, 2.96560571828504891230e-1,
     2.65321895265761230930e-2, 1.24266094738807843860e-3, 2.71155556874348757815e-5, 2.01033439929228813265e-7),
    (1.0, 5.99832206555887937690e-1, 1.36929880922735805310e-1, 1.48753612908506148525e-2,
     7.86869131245613259100e-4, 1.84631831751005468180e-5, 1.42151175831644588870e-7, 2.04426310338993978564e-15),
)  # fmt: skip
