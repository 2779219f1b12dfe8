"""Distance of a point from the surface of a solid cylinder: of its side, an end, or the rim between them.

With the radius R and half of the length h, at rho > 0 from the axis and at z along it from the middle,

    x = rho - R,   y = |z| - h
    D = sqrt(x^2 + y^2) where both are above 0, beside the rim;   D = max(x, y) elsewhere

D is negative within. Its slopes (w_r, w_a) by rho and z have length 1 and pass into each other without a jump outside;
within they jump where side and end are as near as each other, so that a point which presses on an end is led out there.
"""

from __future__ import annotations

import math

from dms_core.compiled.jit import compiled

SHARPEST = 1e-9
"""Distance from the rim below which its normal is not resolved [m]."""


@compiled
def distance(R, h, rho, z):
    """(D, w_r, w_a, 1 / D beside the rim and 0 elsewhere)."""
    x, y, side = rho - R, abs(z) - h, 1.0 if z >= 0.0 else -1.0
    if x > 0.0 and y > 0.0:
        D = max(math.sqrt(x * x + y * y), SHARPEST)
        return D, x / D, side * y / D, 1.0 / D
    if x > y:
        return x, 1.0, 0.0, 0.0
    return y, 0.0, side, 0.0


@compiled
def distance_change(w_r, w_a, bend, d_rho, dz):
    """(dD, dw_r, dw_a) for changes of rho and z; `bend` is the last value of `distance`."""
    dD = w_r * d_rho + w_a * dz
    return dD, bend * (d_rho - w_r * dD), bend * (dz - w_a * dD)
