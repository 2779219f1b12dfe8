"""Planar and spherical loops of joints in space: three rows of each loop are redundant; and some with ball joints."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from dms_core.model.element import GROUND
from tests.dms_core.mechanisms.sketch import Sketch

Z = np.array([0.0, 0.0, 1.0])
Place = Callable[[float, float], tuple[np.ndarray, np.ndarray]]
"""Point and axis of a hinge from two numbers: in a plane, or on a sphere about the origin."""


def _in_plane(x: float, y: float) -> tuple[np.ndarray, np.ndarray]:
    return np.array([x, y, 0.0]), Z


def _on_sphere(x: float, y: float) -> tuple[np.ndarray, np.ndarray]:
    a = np.array([0.8 * x, 0.8 * y, 1.0])
    a /= np.linalg.norm(a)
    return a, a


def _cranks(sketch: Sketch, rng: np.random.Generator, place: Place, most: int = 6) -> Sketch:
    """Two to `most` cranks of any lengths, each joined to the next by a coupler: one freedom."""
    count = int(rng.integers(2, most + 1))
    for k in range(count):
        foot = (0.9 * k + 0.1 * rng.normal(), 0.1 * rng.normal())
        head = (foot[0] + 0.2 * rng.normal(), rng.uniform(0.4, 0.9))
        sketch.revolute(GROUND, f"crank{k}", *place(*foot))
        if k > 0:
            sketch.revolute(f"coupler{k}", f"crank{k}", *place(*head))
        if k + 1 < count:
            sketch.revolute(f"crank{k}", f"coupler{k + 1}", *place(head[0] + 0.05 * rng.normal(), head[1] - 0.1))
    return sketch


def planar_cranks(rng: np.random.Generator) -> Sketch:
    """A chain of four-bars of any lengths."""
    return _cranks(Sketch("planar four-bars"), rng, _in_plane)


def spherical_cranks(rng: np.random.Generator) -> Sketch:
    """A chain of spherical four-bars: all axes meet in a point."""
    return _cranks(Sketch("spherical four-bars"), rng, _on_sphere)


def _ring(sketch: Sketch, rng: np.random.Generator, place: Place, most: int) -> Sketch:
    """One loop of five to `most` hinges: two freedoms and more."""
    count = int(rng.integers(5, most + 1))
    turns = np.sort(rng.uniform(0.0, 2.0 * np.pi, count)) + np.arange(count)
    turns *= 2.0 * np.pi / (turns[-1] + 1.0)
    names = [GROUND, *(f"b{k}" for k in range(1, count)), GROUND]
    for k, (turn, radius) in enumerate(zip(turns, rng.uniform(0.5, 1.0, count), strict=True)):
        sketch.revolute(names[k], names[k + 1], *place(radius * np.cos(turn), radius * np.sin(turn)))
    return sketch


def planar_ring(rng: np.random.Generator) -> Sketch:
    """A closed chain of bars in a plane."""
    return _ring(Sketch("planar ring"), rng, _in_plane, 13)


def spherical_ring(rng: np.random.Generator) -> Sketch:
    """A closed chain of bars whose axes meet in a point."""
    return _ring(Sketch("spherical ring"), rng, _on_sphere, 8)


def parallel_cranks(rng: np.random.Generator) -> Sketch:
    """A chain of parallelograms, or one platform on parallel cranks: they pass flat positions."""
    sketch, count = Sketch("parallel four-bars"), int(rng.integers(2, 6))
    arm = np.array([0.3 * rng.normal(), rng.uniform(0.5, 0.9), 0.0])
    platform = bool(rng.integers(2))
    for k in range(count):
        foot = np.array([0.9 * k, 0.3 * rng.normal() if platform else 0.0, 0.0])
        sketch.revolute(GROUND, f"crank{k}", foot, Z)
        if platform:
            sketch.revolute(f"crank{k}", "platform", foot + arm, Z)
        else:
            if k > 0:
                sketch.revolute(f"coupler{k}", f"crank{k}", foot + arm, Z)
            if k + 1 < count:
                sketch.revolute(f"crank{k}", f"coupler{k + 1}", foot + arm, Z)
    return sketch


def slider_cranks(rng: np.random.Generator) -> Sketch:
    """One crank that drives one to three sliders through rods."""
    sketch = Sketch("slider-cranks")
    sketch.revolute(GROUND, "crank", (0, 0, 0), Z)
    for k in range(int(rng.integers(1, 4))):
        turn = 2.0 * np.pi * rng.uniform()
        pin = rng.uniform(0.2, 0.4) * np.array([np.cos(turn), np.sin(turn), 0.0])
        along = np.array([np.cos(2.1 * k), np.sin(2.1 * k), 0.0])
        end = along * rng.uniform(1.2, 1.6)
        sketch.revolute("crank", f"rod{k}", pin, Z)
        sketch.revolute(f"rod{k}", f"slider{k}", end, Z)
        sketch.slider(GROUND, f"slider{k}", end, along)
    return sketch


def ball_ended(rng: np.random.Generator) -> Sketch:
    """Two cranks about skew axes and a rod with a ball joint at both ends, which turns about itself."""
    sketch = Sketch("cranks and ball joints")
    for k in range(2):
        foot = np.array([1.2 * k, 0.0, 0.3 * rng.normal()])
        axis = Z + 0.5 * rng.normal(size=3)
        sketch.revolute(GROUND, f"crank{k}", foot, axis)
        sketch.spherical(f"crank{k}", "rod", foot + [0.2 * rng.normal(), rng.uniform(0.4, 0.8), 0.1 * rng.normal()])
    return sketch


def twice_hinged(rng: np.random.Generator) -> Sketch:
    """Four-bars whose ground hinges are there twice on the same axis, as of a door, with a double pendulum."""
    sketch = _cranks(Sketch("hinged twice"), rng, _in_plane, 5)
    for kind, i, j, point, axis in list(sketch.joints):
        if i == GROUND:
            sketch.joints.append((kind, i, j, point + 0.3 * axis, axis))
    sketch.spherical("coupler1", "upper", sketch.joints[1][3] + 0.1)
    sketch.spherical("upper", "lower", sketch.joints[1][3] + 0.4)
    sketch.revolute("lower", "bob", sketch.joints[1][3] + 0.7, rng.normal(size=3))
    return sketch


FAMILIES = (
    planar_cranks, spherical_cranks, planar_ring, spherical_ring, parallel_cranks, slider_cranks, ball_ended,
    twice_hinged,
)  # fmt: skip
