"""Loads per length and volume on a modal body against the deflections of a cantilever, mode by mode."""

from __future__ import annotations

import math

import numpy as np
import pytest
import scipy.linalg as la
from scipy.optimize import brentq

from dms_core.assembly.model import Model
from dms_core.errors import ModelError
from dms_core.model import DistributedLoad, Fixed, LoadDistribution, ModalBody, System, craig_bampton
from tests.dms_core.model.flexible.beams import EI, SLENDER
from tests.dms_core.model.flexible.equilibrium import equilibrium, place
from tests.dms_core.model.flexible.linear_beam import linear_beam, loads_per_length

ELEMENTS = 40
FE = linear_beam(SLENDER, 1.0, ELEMENTS)
ENDS = [*range(6), *range(6 * ELEMENTS, 6 * ELEMENTS + 6)]
LOAD = 0.01
"""[N/m]; deflections of 6e-6 m are small."""


def tip_of(modes: np.ndarray, load: DistributedLoad, loads) -> float:
    """Deflection of the clamped body's tip along y [m]."""
    body = ModalBody.of(
        "link", FE.nodes, FE.mass, FE.stiffness, modes, {"root": 0, "tip": ELEMENTS}, loads=loads
    )  # fmt: skip
    model = Model(System(compositions=[body], constraints=[Fixed(name="clamp", body_j="link.root")], forces=[load]))
    return float(place(model, equilibrium(model).q, "link.tip")[1])


def clamped_modes() -> np.ndarray:
    """The lowest modes of the clamped finite-element model that bend it along y, shape (d, 5)."""
    free = np.arange(6, len(FE.mass))
    _, shapes = la.eigh(FE.stiffness[np.ix_(free, free)], FE.mass[np.ix_(free, free)], subset_by_index=(0, 15))
    full = np.zeros((len(FE.mass), 16))
    full[free] = shapes
    return full[:, np.abs(full[6 * ELEMENTS + 1]) > 0.1][:, :5]


def root(k: int) -> float:
    """cos x cosh x = -1, the k-th root from 0."""
    middle = (k + 0.5) * math.pi
    return brentq(lambda x: math.cos(x) + 1.0 / math.cosh(x), middle - 0.4, middle + 0.4, xtol=1e-14)


def test_deflection_converges_with_the_modes_as_its_series_does():
    """w(L) = q L^4 / EI sum_k 4 (-1)^k s_k / x_k^5, s = (sinh x - sin x) / (cosh x + cos x): 1/8 in the limit.

    S. Timoshenko (1974), Vibration Problems in Engineering: x_k are the roots of cos x cosh x = -1.
    """
    modes, x = clamped_modes(), np.array([root(k) for k in range(5)])
    s = (np.sinh(x) - np.sin(x)) / (np.cosh(x) + np.cos(x))
    series = np.cumsum(4.0 * (-1.0) ** np.arange(5) * s / x**5)
    load = DistributedLoad(name="snow", body="link", per_length=(0.0, LOAD, 0.0))
    found = np.array([tip_of(modes[:, :n], load, {"length": loads_per_length(FE)}) for n in range(1, 6)])
    # The fifth mode of forty elements is off by 1e-6 of its frequency, and its share of the deflection is 1e-5.
    np.testing.assert_allclose(found * EI / LOAD, series, rtol=1e-7)
    errors = np.abs(found * EI / LOAD - 0.125)
    assert np.all(errors[1:] < 0.5 * errors[:-1]) and errors[0] > 1e-3 and errors[-1] < 1e-5


@pytest.mark.parametrize("inner_modes", [0, 4])
@pytest.mark.parametrize(
    ("settings", "near", "far", "share"),
    [
        ({"per_length": (0.0, LOAD, 0.0)}, 1.0, 1.0, 1.0 / 8.0),
        ({"per_length": (0.0, LOAD, 0.0)}, 1e-9, 1.0, 11.0 / 120.0),
        ({"per_length": (0.0, LOAD, 0.0)}, 1.0, 1e-9, 1.0 / 30.0),
        ({"per_length": (0.0, LOAD, 0.0), "axes": "body"}, 1.0, 1.0, 1.0 / 8.0),
        ({"per_volume": (0.0, 1e3 * LOAD, 0.0)}, 1.0, 1.0, 1.0 / 8.0),
    ],
)
def test_static_modes_of_the_tip_hold_its_deflection(inner_modes, settings, near, far, share):
    """q L^4 / 8 EI; 11 q L^4 / 120 EI and q L^4 / 30 EI of loads that grow to the tip and to the clamp (Roark 8.1).

    Static modes of the ends and modes within are orthogonal in stiffness: the tip is exact without any of the latter.
    """
    loads = {"length": loads_per_length(FE, near, far), "volume": 1e-3 * loads_per_length(FE, near, far)}
    modes = craig_bampton(FE.mass, FE.stiffness, ENDS, inner_modes)
    found = tip_of(modes, DistributedLoad(name="snow", body="link", **settings), loads)
    assert found == pytest.approx(share * LOAD / EI, rel=1e-7)


def test_the_mass_as_a_distribution_is_the_load_per_mass():
    """B = M S_t, the loads of a weight of 1: both ways give the same invariants."""
    S_t = np.tile(np.eye(6)[:, :3], (ELEMENTS + 1, 1))
    modes = craig_bampton(FE.mass, FE.stiffness, ENDS, 4)
    body = ModalBody.of("link", FE.nodes, FE.mass, FE.stiffness, modes, loads={"volume": FE.mass @ S_t})
    (one,) = body.distributions
    assert one.total == pytest.approx(body.data.mass)
    np.testing.assert_allclose(one.moment, body.data.mass_moment, atol=1e-12)
    np.testing.assert_allclose(one.translation, body.data.translation, atol=1e-9)


B, RISING, FALLING = loads_per_length(FE), loads_per_length(FE, 0.0, 1.0), loads_per_length(FE, 1.0, 0.0)
MODES = craig_bampton(FE.mass, FE.stiffness, ENDS, 1)


@pytest.mark.parametrize(
    ("loads", "said"),
    [
        (B[:-1], r"loads by 'length': Expected shape \(246, 3\), nodal loads along x, y and z, got shape \(245, 3\)"),
        (B * np.nan, "Expected finite numbers, got nan"),
        (-B, "Expected one total above 0 in all directions"),
        (B * [1.0, 2.0, 1.0], r"Expected one total above 0 in all directions, got \[1. 2. 1.\]"),
        (np.column_stack([RISING[:, 0], FALLING[:, 1], RISING[:, 2]]), "Expected moments about the origin that belong"),
    ],
)
def test_loads_that_are_no_measure_are_refused(loads, said):
    with pytest.raises(ModelError, match=said):
        LoadDistribution.of("length", FE.nodes, MODES, loads)


def test_what_a_body_must_have_of_them():
    body = ModalBody.of("link", FE.nodes, FE.mass, FE.stiffness, MODES, loads={"length": B})
    (one,) = body.distributions
    short = one.model_copy(update={"translation": one.translation[:-1]})
    given = {name: getattr(body, name) for name in ("name", "data")}
    with pytest.raises(ModelError, match="distributions: length: translation: Expected 7 items, as many as modes, got"):
        ModalBody(**given, distributions=(short,))
    with pytest.raises(ModelError, match="Expected each measure once, got length, length"):
        ModalBody(**given, distributions=(one, one))
    for settings, said in (
        (
            {"per_volume": (1.0, 0.0, 0.0)},
            "of its volume, got 'link' with length: .*loads={'volume': ...}",
        ),
        ({"per_length": (1.0, 0.0, 0.0), "end_factor": 0.0}, "Expected no start, end and end_factor for the modal bo"),
    ):
        with pytest.raises(ModelError, match=said):
            Model(System(compositions=[body], forces=[DistributedLoad(name="x", body="link", **settings)]))
