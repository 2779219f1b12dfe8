"""Slider-crank and four-bar linkage with a flexible coupler, as beam and as modal body: rigid limit and each other."""

from __future__ import annotations

import math

import numpy as np
import pytest

from dms_core.assembly.model import Model
from dms_core.model import (
    AngleDriver,
    Beam,
    BeamSection,
    Function,
    Input,
    LineGuide,
    ModalBody,
    PointMass,
    Revolute,
    RigidBody,
    Spherical,
    System,
    craig_bampton,
)
from dms_core.model.element import Composition
from dms_core.model.geometry.frames import quaternion
from dms_core.results import Trajectory
from dms_core.simulation.dynamics import SolverOptions, simulate
from tests.dms_core.model.flexible.linear_beam import linear_beam

CRANK, ROD = 0.15, 0.3
STEEL = BeamSection(
    youngs_modulus=2e11, shear_modulus=7.7e10, area=math.pi * 9e-6, inertia_y=math.pi / 4.0 * 81e-12,
    inertia_z=math.pi / 4.0 * 81e-12, torsion_constant=math.pi / 2.0 * 81e-12, shear_factor_y=0.9, shear_factor_z=0.9,
    density=7870.0,
)  # fmt: skip
"""A steel rod of 6 mm, as in J. B. Jonker's slider-crank ((1989), Comput. Methods Appl. Mech. Eng. 76:17-57): crank
0.15 m, connecting rod 0.3 m, slider half the rod's mass."""
SPEED, RISE, END = 25.0, 0.16, 0.4
"""Slower than Jonker's 150 rad/s, so that axial loads stay small beside the buckling load: modes do not know these."""
TIMES = np.linspace(RISE, END, 241)


def turned(t):
    """Crank: angle, rate and second derivative; at rest at first, then at constant speed."""
    w = 2.0 * math.pi / RISE
    if t < RISE:
        angle, rate, second = (
            0.5 * t * t + (math.cos(w * t) - 1.0) / w**2,
            t - math.sin(w * t) / w,
            1.0 - math.cos(w * t),
        )
        return SPEED / RISE * angle, SPEED / RISE * rate, SPEED / RISE * second
    return SPEED * (t - 0.5 * RISE), SPEED, 0.0


def coupler(kind: str, length: float, at: tuple[float, float], angle: float) -> tuple[Composition, list[str]]:
    """A rod from a point in a direction [rad], and its first, middle and last frame."""
    place = {"position": (*at, 0.0), "orientation": tuple(quaternion((0.0, 0.0, 1.0), angle))}
    if kind == "beam":
        beam = Beam(name="rod", section=STEEL, length=length, elements=4, **place)
        return beam, [beam.node(k) for k in (0, 2, 4)]
    fe, ends = linear_beam(STEEL, length, 8), [*range(6), *range(48, 54)]
    modes = craig_bampton(fe.mass, fe.stiffness, ends, 2)
    # Stretch and twist are far beyond what the motion excites.
    bending = modes[:, np.abs(modes.reshape(9, 6, -1)[:, [0, 3]]).max(axis=(0, 1)) < 1e-6]
    body = ModalBody.of("rod", fe.nodes, fe.mass, fe.stiffness, bending, {"a": 0, "b": 4, "c": 8}, **place)
    return body, ["rod.a", "rod.b", "rod.c"]


def crank(angle: float) -> RigidBody:
    return RigidBody(
        name="crank", mass=0.1, inertia=(1e-5, 2e-4, 2e-4), orientation=tuple(quaternion((0.0, 0.0, 1.0), angle))
    )


def driven(name: str, rod: Composition, bodies, constraints) -> Model:
    """The crank on its bearing, turned by the course from its start."""
    bearing = Revolute(name="bearing", body_j="crank", axis_i=(0.0, 0.0, 1.0))
    motor = AngleDriver(name="motor", joint="bearing", input="turn")
    return Model(
        System(
            name, compositions=[rod], bodies=bodies, constraints=[bearing, motor, *constraints],
            inputs=[Input(name="turn", signal=Function(function=turned))],
        )
    )  # fmt: skip


def slider_crank(kind: str) -> tuple[Model, list[str]]:
    """From the stretched position on."""
    rod, frames = coupler(kind, ROD, (CRANK, 0.0), 0.0)
    slider = PointMass(name="slider", mass=0.5 * STEEL.mass_per_length * ROD, position=(CRANK + ROD, 0.0, 0.0))
    joints = [
        Revolute(name="pin", body_i="crank", body_j=frames[0], point_i=(CRANK, 0.0, 0.0), point_j=(0.0, 0.0, 0.0)),
        Spherical(name="wrist", body_i=frames[2], body_j="slider", point_j=(0.0, 0.0, 0.0)),
        LineGuide(name="guide", body_j="slider", axis_i=(1.0, 0.0, 0.0), point_j=(0.0, 0.0, 0.0)),
    ]
    return driven("slider-crank", rod, [crank(0.0), slider], joints), frames


BASE, COUPLER, ROCKER, SHORT = 0.3, 0.35, 0.25, 0.1


def four_bar(kind: str) -> tuple[Model, list[str]]:
    """Crank of 0.1 m, coupler of 0.35 m and rocker of 0.25 m on a base of 0.3 m."""
    far = BASE - SHORT
    phi = math.acos((COUPLER**2 + far**2 - ROCKER**2) / (2.0 * COUPLER * far))
    rod, frames = coupler(kind, COUPLER, (SHORT, 0.0), phi)
    end = np.array([SHORT + COUPLER * math.cos(phi), COUPLER * math.sin(phi)])
    psi = math.atan2(end[1], end[0] - BASE)
    rocker = RigidBody(
        name="rocker", mass=0.2, inertia=(1e-5, 1e-3, 1e-3), centre_of_mass=(0.5 * ROCKER, 0.0, 0.0),
        position=(BASE, 0.0, 0.0), orientation=tuple(quaternion((0.0, 0.0, 1.0), psi)),
    )  # fmt: skip
    joints = [
        Revolute(name="pin", body_i="crank", body_j=frames[0], point_i=(SHORT, 0.0, 0.0), point_j=(0.0, 0.0, 0.0)),
        Spherical(name="joint", body_i=frames[2], body_j="rocker", point_j=(ROCKER, 0.0, 0.0)),
        Revolute(name="pivot", body_j="rocker", point_i=(BASE, 0.0, 0.0), point_j=(0.0, 0.0, 0.0)),
    ]
    return driven("four-bar", rod, [crank(0.0), rocker], joints), frames


def motion(run: Trajectory, frames: list[str]) -> tuple[np.ndarray, np.ndarray]:
    """Deflection of the coupler's middle across the line of its ends, and the place of its far end, at TIMES [m]."""
    at = run.at(TIMES)
    a, b, c = (np.column_stack([at.coordinate(f"{frame}.{x}") for x in "xy"]) for frame in frames)
    along = (c - a) / np.linalg.norm(c - a, axis=1)[:, None]
    off = b - 0.5 * (a + c)
    return along[:, 0] * off[:, 1] - along[:, 1] * off[:, 0], c


@pytest.mark.parametrize("mechanism", [slider_crank, four_bar])
def test_beam_and_modal_body_bend_alike(mechanism):
    """Two formulations that share no line: geometrically exact elements, and modes of linear ones on a frame."""
    found = []
    for kind in ("beam", "modal"):
        model, frames = mechanism(kind)
        found.append(motion(simulate(model, END, SolverOptions(rtol=1e-5)).check(), frames))
    (bent, end), (bent_too, end_too) = found
    size = np.abs(bent).max()
    assert size > 3e-5
    # Axial loads soften and stiffen the beam, which the modes leave out: by a share that grows with the square of the
    # speed, here 1 and 3 per cent, four times that at twice the speed.
    np.testing.assert_allclose(bent_too, bent, atol=0.04 * size)
    np.testing.assert_allclose(end_too, end, atol=2e-5)


def test_the_slider_is_where_a_rigid_rod_puts_it():
    """x = r cos + sqrt(l^2 - r^2 sin^2), but for what the rod shortens by bending and stretching, some micrometres."""
    model, frames = slider_crank("beam")
    run = simulate(model, END, SolverOptions(rtol=1e-5)).check()
    bent, end = motion(run, frames)
    angle = np.array([turned(t)[0] for t in TIMES])
    wanted = CRANK * np.cos(angle) + np.sqrt(ROD**2 - (CRANK * np.sin(angle)) ** 2)
    # A half sine of height w is shorter by pi^2 w^2 / 4 l.
    assert np.abs(end[:, 0] - wanted).max() < 4.0 * np.pi**2 * np.abs(bent).max() ** 2 / (4.0 * ROD) + 2e-6


def test_its_middle_bends_as_its_inertia_says():
    """Quasi-static: a half sine under the first harmonic of the rod's inertia load across it, as far as it is slow.

    The ends of the rod move with the crank, w^2 r across it where it is square to it, and not at all: the load falls
    linearly, and its first sine is 2 / pi w^2 r per mass. The deflection is that over (pi / l)^4 EI / rho A less w^2.
    """
    model, frames = slider_crank("beam")
    bent, _ = motion(simulate(model, END, SolverOptions(rtol=1e-5)).check(), frames)
    stiff = (math.pi / ROD) ** 4 * 2e11 * STEEL.inertia_z / STEEL.mass_per_length
    estimate = 2.0 / math.pi * SPEED**2 * CRANK / (stiff - SPEED**2)
    # Vibration left by the start and higher harmonics add to it: half as much again, not an order.
    assert 0.8 * estimate < np.abs(bent).max() < 1.6 * estimate
