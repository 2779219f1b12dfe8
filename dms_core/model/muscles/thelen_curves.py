"""Force curves of a muscle after Thelen (2003), J. Biomech. Eng. 125(1):70-77, each with its slope.

Forces are over the maximum isometric force F0, l is fibre length / optimal fibre length, e tendon strain, w fibre
velocity / maximum contraction velocity (lengthening positive), a activation.

    active     fl = exp(-(l - 1)^2 / gamma)
    passive    fp = [exp(kPE (l - 1) / e0M) - 1] / [exp(kPE) - 1],  0 for l <= 1
    tendon     ft = 0.33 [exp(3 e / etoe) - 1] / [exp(3) - 1],  0 for e <= 0,  0.33 + klin (e - etoe) for e > etoe
    velocity   w = (0.25 + 0.75 a) x(fv),   x = (fv - 1) / (1 + fv / Af)                             for fv <= 1
                                            x = (fv - 1) (Flen - 1) / ((2 + 2/Af) (Flen - fv))       for fv > 1

Since w enters only as x = w / (0.25 + 0.75 a), the last curve is inverted in closed form. It is continued along its
tangent below fv = 0 and above fv = 0.95 Flen, so that it is defined and rising for every velocity.
"""

from __future__ import annotations

import math
from typing import ClassVar, Literal

from pydantic import Field

from dms_core.compiled.jit import compiled
from dms_core.errors import DmsError, ModelError
from dms_core.validation import Checked

TOE_FORCE = 0.33
"""Tendon force over F0 where the exponential toe goes over into the straight line."""
TOE_SHAPE = 3.0
LENGTHENING_LIMIT = 0.95
"""Share of Flen above which the force-velocity curve follows its tangent (Flen itself is a pole)."""


@compiled
def active_force(l, gamma):  # noqa: E741
    """(fl, dfl/dl)."""
    f = math.exp(-(l - 1.0) * (l - 1.0) / gamma)
    return f, -2.0 * (l - 1.0) / gamma * f


@compiled
def passive_force(l, k, e0):  # noqa: E741
    """(fp, dfp/dl)."""
    if l <= 1.0:
        return 0.0, 0.0
    f, scale = math.exp(k * (l - 1.0) / e0), 1.0 / (math.exp(k) - 1.0)
    return (f - 1.0) * scale, k / e0 * f * scale


@compiled
def tendon_force(e, e_toe, k_lin):
    """(ft, dft/de)."""
    if e <= 0.0:
        return 0.0, 0.0
    if e > e_toe:
        return TOE_FORCE + k_lin * (e - e_toe), k_lin
    f, scale = math.exp(TOE_SHAPE * e / e_toe), TOE_FORCE / (math.exp(TOE_SHAPE) - 1.0)
    return (f - 1.0) * scale, TOE_SHAPE / e_toe * f * scale


@compiled
def _velocity_shape(x, af, f_len):
    """(fv, dfv/dx) at the reduced velocity x."""
    if x <= 0.0:
        if x <= -1.0:
            return (x + 1.0) / (1.0 + 1.0 / af), 1.0 / (1.0 + 1.0 / af)
        d = 1.0 - x / af
        return (1.0 + x) / d, (1.0 + 1.0 / af) / (d * d)
    c = (2.0 + 2.0 / af) / (f_len - 1.0)
    f_end = LENGTHENING_LIMIT * f_len
    x_end = (f_end - 1.0) / (c * (f_len - f_end))
    if x <= x_end:
        d = 1.0 + c * x
        return (1.0 + c * f_len * x) / d, c * (f_len - 1.0) / (d * d)
    d = 1.0 + c * x_end
    slope = c * (f_len - 1.0) / (d * d)
    return f_end + slope * (x - x_end), slope


@compiled
def force_velocity(w, a, af, f_len):
    """(fv, dfv/dw, dfv/da); the activation counts as 0 below 0, where the curve would lose its meaning."""
    reach = 0.25 + 0.75 * max(a, 0.0)
    x = w / reach
    f, slope = _velocity_shape(x, af, f_len)
    by_a = -0.75 * x * slope / reach if a > 0.0 else 0.0
    return f, slope / reach, by_a


class ThelenCurves(Checked):
    """Shape parameters. The defaults are Thelen's young adult, which are OpenSim's class defaults too."""

    wrong: ClassVar[type[DmsError]] = ModelError
    tendon_strain: float = Field(default=0.04, ge=1e-6, description="tendon strain e0T at maximum isometric force [-]")
    passive_strain: float = Field(default=0.6, gt=0.0, description="fibre strain e0M at which passive force is F0 [-]")
    active_shape: float = Field(default=0.45, gt=0.0, description="width gamma of the active curve [-]")
    passive_shape: float = Field(default=5.0, gt=0.0, description="exponent kPE of the passive curve [-]")
    velocity_shape: float = Field(default=0.25, gt=0.0, description="curvature Af of the force-velocity curve [-]")
    lengthening_force: float = Field(
        default=1.4, gt=1.0 / LENGTHENING_LIMIT, description="greatest active force Flen when lengthening, over F0 [-]"
    )
    tendon_constants: Literal["exact", "rounded"] = Field(
        default="exact",
        description="'exact': toe and line meet with equal slope, ft(e0T) = 1; 'rounded': 0.609 e0T, 1.712/e0T",
    )

    def toe(self) -> tuple[float, float]:
        """Strain e_toe [-] at the end of the toe and slope k_lin [-] of the line behind it."""
        if self.tendon_constants == "rounded":
            return 0.609 * self.tendon_strain, 1.712 / self.tendon_strain
        big = math.exp(TOE_SHAPE)
        e_toe = 99.0 * self.tendon_strain * big / (166.0 * big - 67.0)
        return e_toe, 0.67 / (self.tendon_strain - e_toe)
