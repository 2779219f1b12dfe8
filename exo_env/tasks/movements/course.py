"""The course of a movement: psi, its rate and its acceleration at times, from polynomials in pieces."""

from __future__ import annotations

from dms_core.compiled.jit import compiled


@compiled
def course_of(starts, c, times, out):
    """Fill value, rate and acceleration of a signal, whose pieces go on behind the last and before the first.

    Args:
        starts: starts of the pieces [s], shape (n,).
        c: their coefficients, shape (n, 6).
        times: times in rising order [s], shape (k,).
        out: the course, filled, shape (k, 3).
    """
    i = 0
    for k in range(times.shape[0]):
        while i + 1 < starts.shape[0] and starts[i + 1] <= times[k]:
            i += 1
        x = times[k] - starts[i]
        out[k, 0] = out[k, 1] = out[k, 2] = 0.0
        for j in range(c.shape[1] - 1, -1, -1):
            # Horner's scheme of a polynomial, its rate and half its acceleration.
            out[k, 2] = out[k, 2] * x + out[k, 1]
            out[k, 1] = out[k, 1] * x + out[k, 0]
            out[k, 0] = out[k, 0] * x + c[i, j]
        out[k, 2] *= 2.0
