"""Loops that move although counting says that they are rigid, each with the paper that found it."""

from __future__ import annotations

import numpy as np

from dms_core.model.element import GROUND
from tests.dms_core.mechanisms.sketch import Sketch

Line = tuple[np.ndarray, np.ndarray]
"""Point and direction of a joint's axis."""


def _unit(rng: np.random.Generator) -> np.ndarray:
    x = rng.normal(size=3)
    return x / np.linalg.norm(x)


def _loop(family: str, lines: list[Line]) -> Sketch:
    """One loop of hinges; the ground is the link between the last and the first."""
    sketch, names = Sketch(family), [GROUND, *(f"b{k}" for k in range(1, len(lines))), GROUND]
    for k, (point, axis) in enumerate(lines):
        sketch.revolute(names[k], names[k + 1], point, axis)
    return sketch


def _step(T: np.ndarray, turn: float, length: float, twist: float) -> np.ndarray:
    """T Rz(turn) Tx(length) Rx(twist): from one axis (z) to the next, after Denavit and Hartenberg."""
    c, s, ca, sa = np.cos(turn), np.sin(turn), np.cos(twist), np.sin(twist)
    along = np.array([[c, -s * ca, s * sa, length * c], [s, c * ca, -c * sa, length * s], [0, sa, ca, 0], [0, 0, 0, 1]])
    return T @ along


def _bennett_lines(a: float, alpha: float, b: float, turn: float) -> list[Line]:
    """Axes of Bennett's loop (1903): lengths a, b, a, b, twists with sin alpha / a = sin beta / b, no offsets.

    The first two axes belong to the link (a, alpha) along x: they do not depend on b and the turn at the second axis.
    """
    beta = np.arcsin(b * np.sin(alpha) / a)
    other = 2.0 * np.arctan(np.sin(0.5 * (beta + alpha)) / np.sin(0.5 * (beta - alpha)) / np.tan(0.5 * turn))
    T = np.eye(4)
    frames = [T]
    for angle, length, twist in ((0.0, a, alpha), (turn, b, beta), (-other, a, alpha)):
        T = _step(T, angle, length, twist)
        frames.append(T)
    return [(F[:3, 3].copy(), F[:3, 2].copy()) for F in frames]


def bennett(rng: np.random.Generator) -> Sketch:
    """Four skew hinges, 3 rows too many."""
    a, alpha = rng.uniform(0.5, 1.0), rng.uniform(0.4, 1.1)
    return _loop("Bennett", _bennett_lines(a, alpha, a * rng.uniform(0.4, 0.85), rng.uniform(0.8, 2.4)))


def goldberg(rng: np.random.Generator) -> Sketch:
    """Five skew hinges, of two Bennett loops whose common link is left out (Goldberg 1943)."""
    a, alpha = rng.uniform(0.5, 1.0), rng.uniform(0.4, 1.1)
    first = _bennett_lines(a, alpha, a * rng.uniform(0.4, 0.6), rng.uniform(0.8, 2.4))
    second = _bennett_lines(a, alpha, a * rng.uniform(0.65, 0.85), rng.uniform(0.8, 2.4))
    return _loop("Goldberg", [first[3], first[2], first[1], second[2], second[3]])


def line_symmetric(rng: np.random.Generator) -> Sketch:
    """Six skew hinges, three of which are the others after half a turn (Bricard 1897)."""
    half = [(0.7 * _unit(rng) + np.array([0.6, 0.0, 0.4 * k]), _unit(rng)) for k in range(3)]
    back = np.diag([-1.0, -1.0, 1.0])
    return _loop("Bricard line-symmetric", half + [(back @ p, back @ d) for p, d in half])


def plane_symmetric(rng: np.random.Generator) -> Sketch:
    """Six hinges, two of them in a plane that mirrors the other four (Bricard 1927)."""
    flat, mirror = np.diag([1.0, 1.0, 0.0]), np.diag([1.0, 1.0, -1.0])

    def in_plane(x: float) -> Line:
        d = flat @ _unit(rng)
        return np.array([x, rng.normal() * 0.2, 0.0]), d / np.linalg.norm(d)

    side = [(np.array([x, 0.2 * rng.normal(), rng.uniform(0.4, 0.9)]), _unit(rng)) for x in (0.3, 0.7)]
    other = [(mirror @ p, -mirror @ d) for p, d in side]
    return _loop("Bricard plane-symmetric", [in_plane(0.0), *side, in_plane(1.0), *other[::-1]])


def trihedral(rng: np.random.Generator) -> Sketch:
    """Six hinges along the edges of a box, each at a right angle to the next (Bricard 1927)."""
    x, y, z = rng.uniform(0.5, 1.2, 3)
    corners = np.array([[0, 0, 0], [x, 0, 0], [x, -y, 0], [x, -y, z], [0, -y, z], [0, 0, z]], float)
    axes = np.eye(3)[[1, 2, 0, 1, 2, 0]]
    return _loop("Bricard trihedral", list(zip(corners, axes, strict=True)))


def sarrus(rng: np.random.Generator) -> Sketch:
    """A platform on two or three pairs of plates with parallel hinges moves along a line (Sarrus 1853)."""
    sketch = Sketch("Sarrus")
    for k in range(int(rng.integers(2, 4))):
        turn = 2.1 * k + 0.4 * rng.normal()
        axis, out = np.array([-np.sin(turn), np.cos(turn), 0.0]), np.array([np.cos(turn), np.sin(turn), 0.0])
        up, foot = rng.uniform(0.4, 0.9), 0.4 * out
        knee, top = foot + out * rng.uniform(0.3, 0.7) + [0, 0, 0.5 * up], 0.35 * out + [0, 0, up]
        sketch.revolute(GROUND, f"shin{k}", foot, axis)
        sketch.revolute(f"shin{k}", f"thigh{k}", knee, axis)
        sketch.revolute(f"thigh{k}", "platform", top, axis)
    return sketch


FAMILIES = (bennett, goldberg, line_symmetric, plane_symmetric, trihedral, sarrus)
