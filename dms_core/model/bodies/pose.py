"""The seven coordinates of a body that has a pose, position r and Euler parameters p, as it declares them."""

from __future__ import annotations

from collections.abc import Iterable

from dms_core.model.element import Coordinate


def pose_coordinates(
    position: Iterable[float], parameters: Iterable[float], velocity: Iterable[float], rates: Iterable[float]
) -> tuple[Coordinate, ...]:
    """Coordinates 'x', 'y', 'z' [m] and 'p0' to 'p3' [-] at the start, with their rates."""
    start = zip("xyz", position, velocity, strict=True)
    euler = zip(("p0", "p1", "p2", "p3"), parameters, rates, strict=True)
    return tuple(Coordinate(n, float(x), float(xd)) for n, x, xd in (*start, *euler))
