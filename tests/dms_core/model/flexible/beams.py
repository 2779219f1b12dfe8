"""Beams of the tests, with their energy."""

from __future__ import annotations

import numpy as np

from dms_core.assembly.model import Model
from dms_core.model import Beam, BeamElement, BeamSection, Fixed, Input, LumpedLoad, RigidBody, System
from dms_core.model.flexible.beams.beam_element import BEAM, beam_forces
from dms_core.model.geometry.frames import g_matrix, rotation_matrix
from dms_core.model.geometry.rotations import bilinear

EI, LENGTH = 200.0, 1.0
SLENDER = BeamSection(
    youngs_modulus=2e11, shear_modulus=8e10, area=1e-3, inertia_y=2e-9, inertia_z=1e-9, torsion_constant=1e-9,
    density=7800.0,
)  # fmt: skip
"""EI about z is 200 N m^2; over 1 m, stretch and shear change deflections by a share of 1e-6 to 3e-6."""


def cantilever(elements: int, section: BeamSection = SLENDER, length: float = LENGTH, forces=(), **settings) -> Model:
    """A beam along x, clamped at its first node; `load` scales a force at its tip, 1 N along y by default.

    Args:
        elements: number of elements.
        section: of the beam.
        length: of the beam [m].
        forces: further forces.
        settings: `force`, `moment` and `axes` of the load; the others are the beam's.
    """
    load = {k: settings.pop(k) for k in ("force", "moment", "axes") if k in settings} or {"force": (0.0, 1.0, 0.0)}
    beam = Beam(name="boom", section=section, length=length, elements=elements, **settings)
    tip = LumpedLoad(name="tip_load", body=beam.node(-1), input="load", **load)
    return Model(
        System(
            "cantilever", compositions=[beam], constraints=[Fixed(name="clamp", body_j=beam.node(0))],
            forces=[tip, *forces], inputs=[Input(name="load")],
        )
    )  # fmt: skip


def tip(model: Model, q: np.ndarray) -> np.ndarray:
    """Position of the last node [m], shape (3,)."""
    beam = model.system.compositions[0]
    assert isinstance(beam, Beam)
    o = model.layout.offset[beam.node(-1)]
    return q[o : o + 3]


def strain_energy(model: Model, q: np.ndarray) -> float:
    """Of all beam elements [J]: half of each section load times what it strains."""
    total = 0.0
    for call in model.layout.dynamics:
        if isinstance(call.element, BeamElement):
            par = np.array(call.placement.numbers)
            whole = np.concatenate([q, [0, 0, 0, 1, 0, 0, 0]])[call.iq]
            for load, stiffness in zip(
                beam_forces(par, whole, 0.0 * whole), (BEAM.stretching, BEAM.turning), strict=True
            ):
                total += 0.5 * float(np.array(load) ** 2 @ (1.0 / par[stiffness : stiffness + 3]))
    return total


def momenta(model: Model, q: np.ndarray, v: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
    """Kinetic energy [J], momentum [N s] and angular momentum about the origin [N m s] of rigid nodes and couplings."""
    energy, linear, angular = 0.0, np.zeros(3), np.zeros(3)
    for body in model.system.bodies:
        assert isinstance(body, RigidBody)
        o = model.layout.offset[body.name]
        omega, J = 2.0 * g_matrix(q[o + 3 : o + 7]) @ v[o + 3 : o + 7], body.inertia_matrix()
        energy += 0.5 * body.mass * v[o : o + 3] @ v[o : o + 3] + 0.5 * omega @ J @ omega
        linear += body.mass * v[o : o + 3]
        angular += body.mass * np.cross(q[o : o + 3], v[o : o + 3]) + rotation_matrix(q[o + 3 : o + 7]) @ J @ omega
    for call in model.layout.dynamics:
        if isinstance(call.element, BeamElement):
            par = call.placement.numbers
            X, X_t = (_cubic(q[call.iq], x[call.iq], par[BEAM.length], k) for k, x in enumerate((q, v)))
            M = par[BEAM.mass_share] * HERMITE
            energy += 0.5 * float(np.einsum("ai,ab,bi", X_t, M, X_t))
            linear += M[[0, 2]].sum(axis=0) @ X_t
            angular += np.einsum("ab,abi->i", M, np.cross(X[:, None], X_t[None]))
    return float(energy), linear, angular


HERMITE = np.array([[-54, 22, 54, -13], [22, 4, 13, -3], [54, 13, -54, -22], [-13, -3, -22, 4]], float)
"""Mass of the cubic over rho A L / 420, less the nodes'."""


def _cubic(q: np.ndarray, x: np.ndarray, length: float, order: int) -> np.ndarray:
    """(r_i, L t_i, r_j, L t_j) for x = q and order 0, their rates for x = v and order 1; shape (4, 3)."""
    rows = []
    for o in (0, 7):
        p = tuple(q[o + 3 : o + 7])
        t = bilinear(p, tuple(x[o + 3 : o + 7]), (1.0, 0.0, 0.0))
        rows += [x[o : o + 3], length * (1.0 + order) * np.array(t)]
    return np.array(rows)
