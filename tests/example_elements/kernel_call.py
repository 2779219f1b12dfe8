"""One kernel call of an example with arrays of its own: what the system does with element kernels, in the small."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from dms_core.compiled.entries import derivative_kernel
from dms_core.model.element import Constraint, Declaration, DynamicElement, Placement, Sensor
from tests.example_elements import Example, Range


class Point(NamedTuple):
    """A state at which a kernel is called: local coordinates, rates, accelerations, multipliers, inputs (k, 3)."""

    q: np.ndarray
    v: np.ndarray
    a: np.ndarray
    lam: np.ndarray
    u: np.ndarray


class KernelCall(NamedTuple):
    """A kernel with its placement; m rows, and the scales of its n local coordinates and rates."""

    branch: type
    kernel: Any
    placement: Placement
    example: Example
    m: int
    multipliers: int
    q_scale: np.ndarray
    v_scale: np.ndarray

    def __call__(self, x: Point, level: int = 1) -> list[np.ndarray]:
        """All outputs, in the contract's order, zero before the call."""
        m, n, k = self.m, self.placement.size, len(self.placement.inputs)
        shapes = {
            DynamicElement: (n, (n, n), (n, n), (n, n)),
            Constraint: (m, (m, 2), (m, n), (m, n), (n, n)),
            Sensor: (m, (m, n), (m, n), (m, n), (m, self.multipliers), (m, k)),
        }[self.branch]
        out = [np.zeros(s) for s in shapes]
        ip, par = np.array(self.placement.integers, np.int32), np.array(self.placement.numbers, float)
        state = {
            DynamicElement: (x.q, x.v, x.a, x.u),
            Constraint: (x.q, x.v, x.lam, x.u),
            Sensor: (x.q, x.v, x.a, x.lam, x.u),
        }[self.branch]
        self.kernel(ip, par, *state, level, *out)
        return out

    def slopes(self, x: Point, attribute: str) -> np.ndarray | None:
        """What the element's `input_kernel`, (n, k, 3), or `parameter_kernel`, (n, n_par), writes; None without it."""
        kernel = derivative_kernel(type(self.example.element), attribute) if self.branch is DynamicElement else None
        if kernel is None:
            return None
        p = self.placement
        shape = (p.size, len(p.inputs), 3) if attribute == "input_kernel" else (p.size, len(p.numbers))
        out = np.zeros(shape)
        kernel(np.array(p.integers, np.int32), np.array(p.numbers, float), x.q, x.v, x.a, x.u, out)
        return out

    def with_numbers(self, numbers: np.ndarray) -> KernelCall:
        """The same call with other numbers."""
        return self._replace(placement=replace(self.placement, numbers=tuple(numbers)))

    @property
    def outputs(self) -> int:
        """Number of output arrays."""
        return {DynamicElement: 4, Constraint: 5, Sensor: 6}[self.branch]

    @property
    def value_outputs(self) -> int:
        """How many of them are values, written at level 0: r; phi, phi_t, G; y."""
        return 3 if self.branch is Constraint else 1

    def patterned(self, out: list[np.ndarray]) -> Iterator[tuple[str, np.ndarray, np.ndarray]]:
        """(name, derivative, where it may be non-zero) for each part of the declared pattern."""
        if self.placement.pattern is None:
            return
        names = {DynamicElement: ("r", "q", "v", "a"), Constraint: ("phi", "phi_t", "G", "W", "H")}
        names[Sensor] = ("y", "q", "v", "a", "lam", "u")
        for name, derivative in zip(names[self.branch], out, strict=True):
            if hasattr(self.placement.pattern, name):
                yield name, derivative, np.asarray(getattr(self.placement.pattern, name))

    def random_point(self, seed: int) -> Point:
        """A state of general position; Euler parameters are of unit length for even seeds only."""
        rng, p, ex = np.random.default_rng(seed), self.placement, self.example
        q, v = rng.uniform(-0.5, 0.5, p.size), self.v_scale * rng.uniform(-1.0, 1.0, p.size)
        for o in range(0, 7 * len(p.bodies), 7):
            e = rng.normal(size=4)
            q[o + 3 : o + 7] = e / np.linalg.norm(e) * (1.0 if seed % 2 == 0 else rng.uniform(0.8, 1.25))
        for k, name in enumerate(p.coordinates, 7 * len(p.bodies)):
            about = _coordinate(ex, name).start
            q[k] = _draw(rng, ex.q.get(name, (about - self.q_scale[k], about + self.q_scale[k])))
            v[k] = _draw(rng, ex.v.get(name, (-self.v_scale[k], self.v_scale[k])))
        a = self.v_scale * rng.uniform(-1.0, 1.0, p.size)
        lam = rng.uniform(-1.0, 1.0, self.multipliers)
        u = rng.uniform(-1.0, 1.0, (len(p.inputs), 3))
        for k, name in enumerate(p.inputs):
            u[k, 0] = _draw(rng, ex.u.get(name, (-1.0, 1.0)))
        return Point(q, v, a, lam, u)


def _draw(rng: np.random.Generator, bounds: Range) -> float:
    return float(rng.uniform(*bounds))


def _coordinate(example: Example, name: str):
    """The declared coordinate of that full name."""
    owner, _, local = name.rpartition(".")
    return next(c for c in example.system.element(owner).coordinates() if c.name == local)


def _scales(example: Example, p: Placement) -> tuple[np.ndarray, np.ndarray]:
    """Scales of the local coordinates and rates; those of a body are 1."""
    own = [_coordinate(example, name) for name in p.coordinates]
    body = [1.0] * 7 * len(p.bodies)
    return np.array(body + [c.scale for c in own]), np.array(body + [c.rate_scale for c in own])


def kernel_calls(example: Example) -> list[KernelCall]:
    """Every call of the element's own kernel; what reads a sensor is tested with the system (test_connections.py)."""
    element, system = example.element, example.system
    branch = next(b for b in (DynamicElement, Constraint, Sensor) if isinstance(element, b))
    placements = element.placements(system) if branch is DynamicElement else (element.place(system),)
    return [
        KernelCall(
            branch,
            type(element).kernel,
            p,
            example,
            _rows(element),
            _multipliers(element, system, p),
            *_scales(example, p),
        )
        for p in placements
        if not p.reads
    ]


def _rows(element: Declaration) -> int:
    if isinstance(element, Constraint):
        return len(element.rows())
    return len(element.outputs()) if isinstance(element, Sensor) else 0


def _multipliers(element: Declaration, system, p: Placement) -> int:
    """Size of lam: the element's own rows, or those of the constraint that a sensor watches."""
    if isinstance(element, Constraint):
        return len(element.rows())
    return len(system.element(p.constraint, Constraint).rows()) if p.constraint else 0
