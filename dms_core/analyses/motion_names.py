"""A motion dq of a model in words: which bodies move how, and at which joints."""

from __future__ import annotations

import numpy as np

from dms_core.assembly.model import Model
from dms_core.errors import counted
from dms_core.model.element import GROUND

MOST = 2
"""Bodies and states that a sentence names: those that move most."""
STILL = 1e-6
"""Share of the largest motion below which a part counts as at rest."""


def motion_in_words(model: Model, q: np.ndarray, dq: np.ndarray) -> str:
    """What moves, as "'rod' turns about (0, 0, 1) at 'hinge'".

    Args:
        model: a compiled model.
        q: position, shape (n_q,).
        dq: small motion there, shape (n_q,); its size does not matter.
    """
    layout, parts = model.layout, []
    size = float(np.abs(dq).max(initial=0.0))
    if size == 0.0:
        return "nothing moves"
    turns = _turns(model, q, dq / size)
    for body in model.system.bodies:
        shift = dq[layout.offset[body.name] :][:3] / size
        turn = turns[body.name]
        parts.append((max(np.linalg.norm(shift), np.linalg.norm(turn)), _of_body(body.name, shift, turn)))
    for element in model.system.forces:
        own = layout.offset[element.name]
        for k, coordinate in enumerate(element.coordinates()):
            parts.append((abs(dq[own + k]) / size, f"'{element.name}.{coordinate.name}' changes"))
    parts = sorted((p for p in parts if p[0] > STILL), key=lambda p: -p[0])
    said = ", ".join(words for _, words in parts[:MOST])
    others = len(parts) - MOST
    more = f" and {counted(others, 'other')} {'moves' if others == 1 else 'move'} with it" if others > 0 else ""
    joints = _moving_joints(model, q, dq / size, turns)
    return said + more + (f" (at {', '.join(joints[: MOST + 1])})" if joints else "")


def _turns(model: Model, q: np.ndarray, dq: np.ndarray) -> dict[str, np.ndarray]:
    """Rotation vector of each body in ground axes, w = 2 E(p) dp; 0 for the ground and for points."""
    found = {GROUND: np.zeros(3)}
    for body in model.system.bodies:
        k = model.layout.offset[body.name]
        if not body.rigid:
            found[body.name] = np.zeros(3)
            continue
        p, dp = q[k + 3 : k + 7], dq[k + 3 : k + 7]
        found[body.name] = 2.0 * (-p[1:] * dp[0] + p[0] * dp[1:] + np.cross(p[1:], dp[1:]))
    return found


def _of_body(name: str, shift: np.ndarray, turn: np.ndarray) -> str:
    """The larger of shift and turn in words."""
    if np.linalg.norm(turn) > STILL and np.linalg.norm(turn) >= 0.5 * np.linalg.norm(shift):
        return f"'{name}' turns about {_direction(turn)}"
    return f"'{name}' moves along {_direction(shift)}"


def _direction(x: np.ndarray) -> str:
    """A unit vector with two digits, its largest component positive."""
    x = x / max(float(np.linalg.norm(x)), np.finfo(float).tiny)
    x = x * np.sign(x[np.argmax(np.abs(x))])
    return f"({', '.join(f'{v + 0.0:.2g}' if abs(v) > 5e-3 else '0' for v in x)})"


def _moving_joints(model: Model, q: np.ndarray, dq: np.ndarray, turns: dict[str, np.ndarray]) -> list[str]:
    """Constraints between two bodies that move relative to each other, in the order of declaration."""
    found = []
    for call in model.layout.constraints:
        bodies = call.placement.bodies
        if len(bodies) != 2:
            continue
        i, j = bodies
        relative = np.linalg.norm(turns[i] - turns[j])
        slides = _gap_rate(model, q, dq, turns, call)
        if max(relative, slides) > STILL**0.5:
            found.append(f"{call.element.kind} '{call.element.name}'")
    return found


def _gap_rate(model: Model, q: np.ndarray, dq: np.ndarray, turns: dict[str, np.ndarray], call) -> float:  # noqa: ANN001
    """Rate at which the constraint's own points part [m]; 0 where it has none."""
    points = call.element.own_points
    if len(points) != 2:
        return 0.0
    rates = []
    for body, place in zip(call.placement.bodies, points, strict=True):
        if body == GROUND:
            rates.append(np.zeros(3))
            continue
        k = model.layout.offset[body]
        arm = np.array(call.placement.numbers[place : place + 3])
        p = q[k + 3 : k + 7] if model.system.body(body).rigid else np.array([1.0, 0.0, 0.0, 0.0])  # type: ignore[union-attr]
        rates.append(dq[k : k + 3] + np.cross(turns[body], rotate(p, arm)))
    return float(np.linalg.norm(rates[0] - rates[1]))


def rotate(p: np.ndarray, s: np.ndarray) -> np.ndarray:
    """A(p) s for Euler parameters p, shape (4,), and a vector s, shape (3,)."""
    e = p[1:]
    return (p[0] ** 2 - e @ e) * s + 2.0 * (e @ s) * e + 2.0 * p[0] * np.cross(e, s)
