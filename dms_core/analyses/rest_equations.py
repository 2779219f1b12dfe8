"""The equations of a system at rest, with loads that grow (paper Fig. 1, static simulation).

    r(q, lam, s) = phi_q^T lam - f(q, 0, u(s)) = 0,      phi(q, u(s)) = 0

s is the load factor. A named input is s times its value; a named force element acts s times. What is not named acts in
full. Velocities, accelerations and the rates of all inputs are 0; element states (fibres, activations, ropes' tensions)
are among q, and their rows say that they rest.

A controller that integrates its error e has the row vdot_c = edot, which does not hold its integral at rest. There
e = 0 is solved instead, e being the rate that the element's own `start_states` gives; its derivative is a central
difference. Where the integral moves nothing (a controller without integral gain or without authority), it is held, and
its rate is e.

Readings of sensors and driven inputs are rates of own coordinates too (dms_core.assembly.pattern.connections), whose
positions nothing reads. There the rate, the signal itself, is the unknown, in the position's place: with such signals
among them, "q" is a vector of unknowns here, and `point` gives the state that it stands for. A state whose row says no
more than v = 0, as the integral of a sensor_pid without integral gain, is held.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from dms_core.assembly.derivatives.blocks import Blocks, OperatingPoint
from dms_core.assembly.derivatives.input_derivatives import STEP
from dms_core.assembly.layout import Call
from dms_core.assembly.model import Model
from dms_core.errors import InputError, ModelError, ModelWarning, choices
from dms_core.flags import input_values
from dms_core.model.element import Force
from dms_core.model.system import System


class RestBlocks(NamedTuple):
    """The equations at one position, dense."""

    f: np.ndarray
    """r without multipliers, -f, shape (n_q,)."""
    K: np.ndarray
    """r by q, multipliers included, shape (n_q, n_q)."""
    C: np.ndarray
    """r by v, shape (n_q, n_q)."""
    M: np.ndarray
    """r by vdot, shape (n_q, n_q)."""
    phi: np.ndarray
    """Shape (n_phi,)."""
    G: np.ndarray
    """phi_q, shape (n_phi, n_q)."""
    f_s: np.ndarray
    """r by the load factor, shape (n_q,)."""
    phi_s: np.ndarray
    """phi by the load factor, shape (n_phi,)."""


def without(system: System, names: Sequence[str]) -> System:
    """The system without these forces, and without the sensors and inputs that nothing else needs.

    Raises:
        ModelError: a name is that of no force, or another element cannot do without it.
    """
    for name in names:
        system.element(name, Force)
    forces = [f for f in system.forces if f.name not in names]
    bare = System(
        system.name, bodies=system.bodies, constraints=system.constraints, forces=forces, inputs=system.inputs
    )
    sensors = [s for s in system.sensors if _places(s, bare)]
    kept = System(
        system.name, bodies=system.bodies, constraints=system.constraints, forces=forces, sensors=sensors,
        inputs=system.inputs,
    )  # fmt: skip
    return kept


def _places(sensor, bare: System) -> bool:  # noqa: ANN001
    """Whether a sensor finds in a system what it reads."""
    try:
        place = sensor.place(bare)
        coordinates = {f"{e.name}.{c.name}" for e in (*bare.bodies, *bare.forces) for c in e.coordinates()}
        return set(place.coordinates) <= coordinates
    except ModelError:
        return False


def quiet(system: System) -> Model:
    """A model without a word on inputs that only left-out elements read."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ModelWarning)
        return Model(system)


class RestEquations:
    """Equations of rest of one model.

    Args:
        model: a compiled model.
        loads: names of force elements and of inputs that the load factor multiplies; elements must own no coordinate.
        time: at which the inputs are taken [s].
        inputs: values in place of the declared ones, by name.

    Raises:
        InputError: a load is neither an input nor a force without coordinates, a value is not finite, or an input that
            is named is driven by an element.
    """

    def __init__(
        self,
        model: Model,
        loads: Sequence[str] = (),
        time: float = 0.0,
        inputs: dict[str, float] | None = None,
    ) -> None:
        self.model, layout = model, model.layout
        for name in (*loads, *(inputs or {})):
            if name in layout.driven:
                by = layout.driven[name].rpartition(".")[0]
                raise InputError(f"input '{name}' is driven by '{by}'. Expected an input that nothing drives.")
        u = input_values(model, model.new_signals(), np.array([time]), np.zeros((1, model.n_q)), np.array([True]))[0]
        for name, value in (inputs or {}).items():
            if not np.isfinite(value):
                raise InputError(f"input '{name}': Expected a finite number, got {value}.")
            u[model.input_index(name)] = value
        self.u = u
        self.scaled = np.zeros(len(u), bool)
        elements = []
        own = {f.name: f for f in model.system.forces}
        for name in loads:
            if name in layout.input_index:
                self.scaled[layout.input_index[name]] = True
            elif name in own and not own[name].coordinates():
                elements.append(name)
            else:
                allowed = choices([*layout.input_index, *(f for f, e in own.items() if not e.coordinates())])
                raise InputError(
                    f"load '{name}': Expected an input, or a force element without coordinates. There are: {allowed}."
                )
        self._bare = quiet(without(model.system, elements)) if elements else None
        self._second = model.second_order
        self.signals = _signals(model)
        """Coordinates whose rates are readings or driven inputs, and unknowns in place of their positions."""
        self.constant = np.zeros(0, int)
        """States whose rate is 0 whatever happens; they are held."""
        self._integrators: list[tuple[int, Call, int]] = []
        self.held = np.zeros(model.n_q, bool)
        self._integrators = self._find_integrators()
        self.held = self._without_effect()
        self.constant = self._constant()

    def unknowns(self, q: np.ndarray) -> np.ndarray:
        """The unknowns to begin with at a position: its signals start at 0."""
        q = np.array(q, float)
        q[self.signals] = 0.0
        return q

    def inputs(self, s: float) -> np.ndarray:
        """Value and zero rates of each input at load factor s, shape (n_u, 3)."""
        u = np.zeros((len(self.u), 3))
        u[:, 0] = np.where(self.scaled, s * self.u, self.u)
        return u

    def point(self, q: np.ndarray, lam: np.ndarray, s: float) -> OperatingPoint:
        """The state of rest at q, whose signals are rates."""
        n, m = self.model.n_q, self.model.n_phi
        v, zero, u = np.zeros(n), np.zeros(n), self.inputs(s)
        if len(self.signals):
            v[self.signals], q = q[self.signals], q.copy()
            q[self.signals] = self.model.start.q[self.signals]
            self.model.layout.put_driven(u[:, 0], v)
        for i, call, k in self._integrators:
            if self.held[i]:
                v[i] = self._rate(call, k, q, s)
        return OperatingPoint(q, v, v, zero, lam, np.zeros(m), u)

    def at(self, q: np.ndarray, lam: np.ndarray, s: float) -> RestBlocks:
        """Residual and derivatives at position q with multipliers lam (which enter K) and load factor s."""
        point = self.point(q, lam, s)
        b, growing = self._loaded(point, s)
        G, by_s = b.phi_q.toarray(), np.where(self.scaled, self.u, 0.0)
        f, K, C, M = b.r2 - G.T @ lam, b.r2_q.toarray(), b.r2_v.toarray(), b.r2_a.toarray()
        blocks = RestBlocks(f, K, C, M, b.r3.copy(), G, growing + b.r2_u[:, :, 0] @ by_s, b.r3_u[:, :, 0] @ by_s)
        self._put_integrators(blocks, q, s)
        self._put_signals(blocks)
        return blocks

    def blocks(self, point: OperatingPoint, s: float) -> Blocks:
        """The model's equations at a point, with loads at load factor s."""
        return self._loaded(point, s)[0]

    def _loaded(self, point: OperatingPoint, s: float) -> tuple[Blocks, np.ndarray]:
        """The equations at load factor s, and the rows of the elements that it multiplies."""
        whole = self.model.derivatives.blocks(point)
        if self._bare is None:
            return whole, np.zeros_like(whole.r2)
        bare = self._bare.derivatives.blocks(point)
        mixed = {
            name: (1.0 - s) * getattr(bare, name) + s * getattr(whole, name)
            for name in ("r2", "r2_q", "r2_v", "r2_a", "r2_u")
        }
        return whole._replace(**mixed), whole.r2 - bare.r2

    def _put_signals(self, b: RestBlocks) -> None:
        """Derivatives by signals in place of those by their positions; what is constant does not change."""
        b.K[:, self.signals] = b.C[:, self.signals]
        b.C[:, self.signals] = b.M[:, self.signals] = 0.0
        b.K[self.constant, self.constant] = 1.0

    def _constant(self) -> np.ndarray:
        """States of first order beside signals whose row is v = 0."""
        if not len(self.signals):
            return self.constant
        model = self.model
        b = model.derivatives.blocks(self.point(self.unknowns(model.start.q), np.zeros(model.n_phi), 1.0))
        C, own = b.r2_v.toarray(), np.arange(model.n_q)
        C[own, own] = 0.0
        moved = [b.r2[:, None], b.r2_q.toarray(), C, b.r2_a.toarray(), b.r2_u.reshape(model.n_q, -1)]
        still = ~np.any(np.hstack(moved), axis=1) & ~model.second_order
        still[self.signals] = False
        return np.flatnonzero(still)

    def _find_integrators(self) -> list[tuple[int, Call, int]]:
        """(coordinate, call, place among its own) of integrals: of second order, and in no row of their own at rest."""
        model, found = self.model, []
        b = model.derivatives.blocks(self.point(model.start.q, np.zeros(model.n_phi), 1.0))
        K, G = b.r2_q.toarray(), b.phi_q.toarray()
        for element in model.system.forces:
            own = model.layout.offset[element.name]
            for k, _ in enumerate(element.coordinates()):
                i = own + k
                if self._second[i] and not K[i, i] and not G[:, i].any() and hasattr(element, "start_states"):
                    call = next(c for c in model.layout.dynamics if c.element is element)
                    found.append((i, call, k))
        return found

    def _without_effect(self) -> np.ndarray:
        """Integrals that move nothing, and are held."""
        model = self.model
        b = model.derivatives.blocks(self.point(model.start.q, np.zeros(model.n_phi), 1.0))
        K = b.r2_q.toarray()
        held = np.zeros(model.n_q, bool)
        for i, _, _ in self._integrators:
            held[i] = not np.delete(K[:, i], i).any()
        return held

    def _rate(self, call: Call, k: int, q: np.ndarray, s: float) -> float:
        """Rate of the call's own coordinate k that belongs to a position: the error that is integrated."""
        local = np.concatenate([q, [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]])[call.iq]
        return call.element.start_states(self.model.system, local, self.inputs(s)[call.iu])[k][1]  # type: ignore[union-attr]

    def _put_integrators(self, b: RestBlocks, q: np.ndarray, s: float) -> None:
        """Rows of integrals: v_c - e = 0, or dq_c = 0 where one is held."""
        for i, call, k in self._integrators:
            b.f[i], b.K[i], b.C[i], b.M[i], b.f_s[i] = 0.0, 0.0, 0.0, 0.0, 0.0
            by_s = (self._rate(call, k, q, s + STEP) - self._rate(call, k, q, s - STEP)) / (2.0 * STEP)
            by_q = np.zeros(self.model.n_q)
            for j in {int(x) for x in call.iq if x < self.model.n_q and x != i}:
                near, far = q.copy(), q.copy()
                near[j] -= STEP
                far[j] += STEP
                by_q[j] = (self._rate(call, k, far, s) - self._rate(call, k, near, s)) / (2.0 * STEP)
            if self.held[i]:
                b.K[:] += np.outer(b.C[:, i], by_q)
                b.f_s[:] += b.C[:, i] * by_s
                b.K[i, i] = 1.0
            else:
                b.f[i], b.C[i, i] = -self._rate(call, k, q, s), 1.0
                b.K[i], b.f_s[i] = -by_q, -by_s


def _signals(model: Model) -> np.ndarray:
    """Own coordinates of elements whose rates are readings or driven inputs."""
    found = {int(call.iq[-1]) for call in model.layout.dynamics if call.sensor is not None}
    for element in model.system.forces:
        found |= {model.layout.index[f"{element.name}.{name}"] for _, name in element.driven_inputs()}
    return np.array(sorted(found), int)
