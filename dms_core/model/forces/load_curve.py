"""A load as a function of a deflection: a straight line, or a smooth curve through the points of a table.

Between two points the curve is the cubic that has the points' slopes; these are chosen so that it rises where the
points rise and has no bump between them (F. N. Fritsch and J. Butland 1984, SIAM J. Sci. Stat. Comput. 5:300-304, as
in SciPy's PchipInterpolator). Beyond the last point at either end it goes on straight. Load and slope are continuous.

A curve in a kernel's table of numbers, from index j: n points, then for each (x, load, slope); n = 0: the stiffness.
"""

from __future__ import annotations

from typing import ClassVar, Self

import numpy as np
from pydantic import Field, model_validator
from scipy.interpolate import PchipInterpolator

from dms_core.compiled.jit import compiled
from dms_core.errors import DmsError, ModelError
from dms_core.validation import Checked


@compiled
def curve_load(par, j, x):
    """(load, slope) at the deflection x of the curve at par[j]."""
    n = int(par[j])
    if n == 0:
        return par[j + 1] * x, par[j + 1]
    low, high = 0, n - 1
    while high - low > 1:
        middle = (low + high) // 2
        if par[j + 1 + 3 * middle] <= x:
            low = middle
        else:
            high = middle
    a, b = j + 1 + 3 * low, j + 1 + 3 * high
    if x <= par[j + 1] or x >= par[j + 1 + 3 * (n - 1)]:
        end = a if x <= par[j + 1] else b
        return par[end + 1] + par[end + 2] * (x - par[end]), par[end + 2]
    h = par[b] - par[a]
    s, chord = (x - par[a]) / h, (par[b + 1] - par[a + 1]) / h
    # Hermite's cubic: load_a + h s (m_a + s (c2 + s c3)).
    c2, c3 = 3.0 * chord - 2.0 * par[a + 2] - par[b + 2], par[a + 2] + par[b + 2] - 2.0 * chord
    load = par[a + 1] + h * s * (par[a + 2] + s * (c2 + s * c3))
    return load, par[a + 2] + s * (2.0 * c2 + 3.0 * s * c3)


def stiffness_numbers(stiffness: float) -> list[float]:
    """The table of a straight line through 0."""
    return [0.0, stiffness]


class LoadCurve(Checked):
    """A load against a deflection, as points through which a smooth curve without bumps is laid.

    Beyond the first and the last point it goes on straight. A spring pushes back where load and deflection have the
    same sign.
    """

    wrong: ClassVar[type[DmsError]] = ModelError
    deflections: tuple[float, ...] = Field(min_length=2, description="rising deflections [m or rad]")
    loads: tuple[float, ...] = Field(min_length=2, description="one load a deflection [N or N m]")

    @model_validator(mode="after")
    def _matching(self) -> Self:
        x, n = self.deflections, len(self.deflections)
        if n != len(self.loads):
            raise ValueError(f"{n} deflections but {len(self.loads)} loads; give one load for each deflection")
        for k in range(n - 1):
            if x[k + 1] <= x[k]:
                raise ValueError(
                    f"deflections must rise; deflections[{k}] = {x[k]:g}, deflections[{k + 1}] = {x[k + 1]:g}"
                )
        return self

    def table(self) -> list[float]:
        """The curve for the kernel."""
        slopes = PchipInterpolator(self.deflections, self.loads).derivative()(self.deflections)
        points = np.column_stack([self.deflections, self.loads, slopes])
        return [float(len(points)), *map(float, points.ravel())]
