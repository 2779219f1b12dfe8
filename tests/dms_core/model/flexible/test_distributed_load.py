"""Distributed loads against beam theory, the load's own resultant, and what they must refuse."""

from __future__ import annotations

import math

import numpy as np
import pytest

from dms_core.assembly.model import Model
from dms_core.errors import ModelError
from dms_core.model import DistributedLoad, Fixed, Gravity, Input, LumpedLoad, PointMass, Revolute, RigidBody, System
from tests.dms_core.model.flexible.beams import EI, SLENDER, cantilever, tip
from tests.dms_core.model.flexible.equilibrium import at_rest, equilibrium


def loaded(elements: int = 3, **settings) -> Model:
    """The slender cantilever under a distributed load alone."""
    return cantilever(elements, forces=[DistributedLoad(name="snow", body="boom", **settings)])


@pytest.mark.parametrize("elements", [1, 3])
def test_uniform_load(elements):
    """w = q L^4 / 8 EI + q L^2 / 2 GA at any number of elements."""
    model = loaded(elements, per_length=(0.0, 0.01, 0.0))
    wanted = 0.01 / (8.0 * EI) + 0.01 / (2.0 * 8e10 * 1e-3)
    assert tip(model, equilibrium(model).q)[1] == pytest.approx(wanted, rel=1e-6)


@pytest.mark.parametrize(("end_factor", "wanted"), [(0.0, 1.0 / 30.0), (2.0, 1.0 / 8.0 + 11.0 / 120.0)])
def test_linear_load(end_factor, wanted):
    """q L^4 / 30 EI where it falls to 0 at the tip; 11 q L^4 / 120 EI where it grows from 0 (Roark, table 8.1)."""
    model = loaded(3, per_length=(0.0, 0.01, 0.0), end_factor=end_factor)
    # Shear adds a share of 1e-5 or less.
    assert tip(model, equilibrium(model).q)[1] == pytest.approx(wanted * 0.01 / EI, rel=2e-5)


def test_a_following_load_stays_across_the_beam():
    """Work of a load that follows: the resultant of q along a beam rolled into a half circle points to its centre.

    With a moment M = pi EI / L the beam is half a circle. A uniform load along its sections' y axes has there the
    resultant int q A(s) e_y ds = q L (2 / pi) along -x of the clamp, none along y.
    """
    model = loaded(20, per_length=(0.0, 1e-9, 0.0), axes="body")
    q = equilibrium(cantilever(20, moment=(0.0, 0.0, 1.0), axes="body"), 0.125, load=math.pi * EI).q
    b = model.derivatives.blocks(at_rest(model, q))
    free = cantilever(20)
    rest = free.derivatives.blocks(at_rest(free, q))
    resultant = -(b.r2 - rest.r2).reshape(-1, 7)[:, :3].sum(axis=0)
    # Each section carries its share in its own direction: trapezoidal rule over 20 elements, pi^2 / 4800.
    np.testing.assert_allclose(resultant / 1e-9, [-2.0 / math.pi, 0.0, 0.0], atol=3e-3)


@pytest.mark.parametrize(
    "settings",
    [
        {"per_volume": (0.0, -7800.0 * 9.80665, 0.0)},
        {"per_mass": (0.0, -9.80665, 0.0)},
        {"per_mass": (0.0, -9.80665, 0.0), "input": "load"},
    ],
)
def test_weight(settings):
    """Per volume or per mass it is the weight per length; with it the tip sags exactly by w L^4 / 8 EI."""
    model = cantilever(2, force=(0.0, 0.0, 0.0), forces=[DistributedLoad(name="snow", body="boom", **settings)])
    at = equilibrium(model, 0.25, load=1.0)
    wanted = -7.8 * 9.80665 / (8.0 * EI)
    # A deflection of 48 mm over 1 m is not quite small.
    assert tip(model, at.q)[1] == pytest.approx(wanted, rel=3e-3)
    # The weight of a consistent mass is the same load.
    by_gravity = cantilever(2, forces=[Gravity(name="weight")])
    np.testing.assert_allclose(equilibrium(by_gravity, 0.25).q, at.q, atol=1e-9)


def pendulum(*forces) -> Model:
    """A rod on a hinge, its centre of mass off its origin."""
    rod = RigidBody(
        name="rod", mass=2.0, inertia=(0.1, 0.2, 0.3), centre_of_mass=(0.4, 0.1, 0.0), position=(0.1, 0.0, 0.0),
        orientation=(0.8, 0.0, 0.0, 0.6),
    )  # fmt: skip
    hinge = Revolute(name="hinge", body_j="rod")
    return Model(System("rod", bodies=[rod], constraints=[hinge], forces=forces, inputs=[]))


@pytest.mark.parametrize("axes", ["ground", "body"])
@pytest.mark.parametrize("end_factor", [1.0, 0.0, -1.0])
def test_resultant_on_a_rigid_body(axes, end_factor):
    """Force int q ds and moment int x x q ds of a thousand point loads on the line, in any pose and its derivative."""
    a, b, q = np.array([0.2, -0.1, 0.3]), np.array([0.9, 0.5, -0.2]), np.array([3.0, -5.0, 2.0])
    load = DistributedLoad(
        name="load", body="rod", per_length=tuple(q), end_factor=end_factor, start=tuple(a), end=tuple(b), axes=axes
    )
    n, length = 1000, float(np.linalg.norm(b - a))
    middles = (np.arange(n) + 0.5) / n
    points = [
        LumpedLoad(
            name=f"p{k}", body="rod", axes=axes, point=tuple(a + x * (b - a)),
            force=tuple(q * length / n * (1.0 + (end_factor - 1.0) * x)),
        )
        for k, x in enumerate(middles)
    ]  # fmt: skip
    one, many = pendulum(load), pendulum(*points)
    for model in (one, many):
        assert model.n_q == 7
    for found, wanted in zip(*((b.r2, b.r2_q.toarray()) for b in _blocks(one, many)), strict=True):
        # The rule of midpoints errs by 1 / n^2 of a quadratic moment.
        np.testing.assert_allclose(found, wanted, atol=1e-5)


def _blocks(*models: Model):
    return [m.derivatives.blocks(at_rest(m)) for m in models]


def test_weight_of_a_rigid_body_is_that_of_gravity():
    weight = DistributedLoad(name="weight", body="rod", per_mass=(0.0, -9.0, 2.0))
    one, other = _blocks(pendulum(weight), pendulum(Gravity(name="weight", acceleration=(0.0, -9.0, 2.0))))
    np.testing.assert_allclose(one.r2, other.r2, atol=1e-15)


ROD = RigidBody(name="rod", mass=1.0, inertia=(1.0, 1.0, 1.0))
BALL = PointMass(name="ball", mass=1.0)


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        ({"body": "rod"}, "Expected one of per_length, per_volume and per_mass, got none of them"),
        ({"body": "rod", "per_length": (1, 0, 0), "per_mass": (1, 0, 0)}, "got per_length and per_mass"),
        ({"body": "rod", "per_length": (1, 0, 0)}, "Expected per_length with start and end"),
        ({"body": "rod", "per_volume": (1, 0, 0)}, "Expected per_length with start and end"),
        ({"body": "rod", "per_length": (1, 0, 0), "start": (1, 2, 3), "end": (1, 2, 3)}, "are the same point"),
        ({"body": "boom", "per_length": (1, 0, 0), "start": (0, 0, 0)}, "the load lies on all of the beam 'boom'"),
        (
            {"body": "ball", "per_mass": (1, 0, 0)},
            "a modal body or a rigid body, got the point_mass 'ball'",
        ),
        ({"body": "boon", "per_mass": (1, 0, 0)}, "'boon' does not exist"),
    ],
)
def test_what_is_refused(settings, said):
    from dms_core.model import Beam

    boom = Beam(name="boom", section=SLENDER, length=1.0, elements=2)
    with pytest.raises(ModelError, match=said):
        load = DistributedLoad(name="load", **settings)
        clamp = Fixed(name="clamp", body_j="boom.node0")
        Model(
            System(
                compositions=[boom], bodies=[ROD, BALL], constraints=[clamp], forces=[load], inputs=[Input(name="x")]
            )
        )
