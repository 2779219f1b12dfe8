"""Quaternions as 4-tuples, scalar first: the algebra of Euler parameters of any length, and of their changes.

Like the vectors of rotations.py they live in registers: nothing here allocates.
"""

from dms_core.compiled.jit import compiled
from dms_core.model.geometry.rotations import cross, dot

PARAMETERS = ((1.0, 0.0, 0.0, 0.0), (0.0, 1.0, 0.0, 0.0), (0.0, 0.0, 1.0, 0.0), (0.0, 0.0, 0.0, 1.0))
"""One Euler parameter 1 and the others 0: directions of derivatives."""


@compiled
def conjugate(p):
    """(p0, -e)."""
    return (p[0], -p[1], -p[2], -p[3])


@compiled
def product(p, s):
    """p s: A(product(p, s)) = A(p) A(s)."""
    e, f = (p[1], p[2], p[3]), (s[1], s[2], s[3])
    c = cross(e, f)
    return (
        p[0] * s[0] - dot(e, f),
        p[0] * f[0] + s[0] * e[0] + c[0],
        p[0] * f[1] + s[0] * e[1] + c[1],
        p[0] * f[2] + s[0] * e[2] + c[2],
    )


@compiled
def inner4(p, s):
    """p . s."""
    return p[0] * s[0] + p[1] * s[1] + p[2] * s[2] + p[3] * s[3]


@compiled
def scaled4(factor, p):
    """factor p."""
    return (factor * p[0], factor * p[1], factor * p[2], factor * p[3])


@compiled
def sum4(p, s):
    """p + s."""
    return (p[0] + s[0], p[1] + s[1], p[2] + s[2], p[3] + s[3])
