"""A modal body against the finite-element model it comes from, and what its motion conserves."""

from __future__ import annotations

import math

import numpy as np
import pytest
import scipy.linalg as la

from dms_core.assembly.model import Model
from dms_core.errors import ModelError
from dms_core.model import (
    DistributedLoad,
    Fixed,
    Gravity,
    Input,
    Interface,
    LumpedLoad,
    ModalBody,
    ModalData,
    System,
    craig_bampton,
    orthogonal,
)
from dms_core.model.flexible.modal.modal_data import skew
from dms_core.model.geometry.frames import g_matrix, rotation_matrix
from dms_core.model_files.model_file import dump, load
from dms_core.simulation.dynamics import SolverOptions, simulate
from tests.dms_core.model.flexible.beams import EI, SLENDER
from tests.dms_core.model.flexible.equilibrium import at_rest, equilibrium, frequencies, place
from tests.dms_core.model.flexible.linear_beam import linear_beam, loads_per_length

ELEMENTS = 10
FE = linear_beam(SLENDER, 1.0, ELEMENTS)
ENDS = [*range(6), *range(6 * ELEMENTS, 6 * ELEMENTS + 6)]


def link(inner_modes: int = 4, **settings) -> ModalBody:
    """The slender beam with frames at both ends."""
    modes = craig_bampton(FE.mass, FE.stiffness, ENDS, inner_modes)
    return ModalBody.of("link", FE.nodes, FE.mass, FE.stiffness, modes, {"root": 0, "tip": ELEMENTS}, **settings)


def clamped(*forces, inner_modes: int = 4) -> Model:
    """A cantilever of it, 1 N along y at its tip times `load`."""
    tip_load = LumpedLoad(name="tip_load", body="link.tip", force=(0.0, 1.0, 0.0), input="load")
    return Model(
        System(
            compositions=[link(inner_modes)], constraints=[Fixed(name="clamp", body_j="link.root")],
            forces=[tip_load, *forces], inputs=[Input(name="load")],
        )
    )  # fmt: skip


def test_invariants_are_those_of_a_rod():
    """7.8 kg, its centre half-way, J = m L^2 / 3 about its end; a mode's momentum is that of its nodes."""
    data = link().data
    assert data.mass == pytest.approx(7.8)
    np.testing.assert_allclose(data.mass_moment, [3.9, 0.0, 0.0], atol=1e-12)
    polar = 7800.0 * 3e-9
    np.testing.assert_allclose(data.inertia, [polar, 2.6, 2.6, 0.0, 0.0, 0.0], rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(data.modal_mass, 1.0, rtol=1e-9)
    # Modes of mass 1 that are orthogonal to all rigid motions have no momentum.
    np.testing.assert_allclose(data.translation, 0.0, atol=1e-6)
    np.testing.assert_allclose(data.rotation, 0.0, atol=1e-6)


def test_tip_deflection():
    """P L^3 / 3 EI, and the slope P L^2 / 2 EI, from static modes of the boundary alone."""
    model = clamped(inner_modes=0)
    at = equilibrium(model, load=1e-2)
    moved = place(model, at.q, "link.tip")
    # A rotation whose tangent of a half is half its size is one to third order, here to 1e-9.
    assert moved[1] == pytest.approx(1e-2 / (3.0 * EI), rel=1e-6)
    o = model.layout.offset["link.tip"]
    assert 2.0 * math.atan2(at.q[o + 6], at.q[o + 3]) == pytest.approx(1e-2 / (2.0 * EI), rel=1e-6)


def test_frequencies_of_the_clamped_body():
    """Those of the clamped finite-element model, better with each mode within, from above."""
    free = slice(6, None)
    wanted = np.sqrt(la.eigh(FE.stiffness[free, free], FE.mass[free, free], eigvals_only=True, subset_by_index=(0, 3)))
    errors = []
    for inner_modes in (0, 4, 12):
        model = clamped(inner_modes=inner_modes)
        errors.append(frequencies(model, at_rest(model), 4) / wanted - 1.0)
    assert np.all(np.diff(np.array(errors), axis=0) < 1e-9)
    assert errors[0].max() > 1e-3
    assert 0.0 <= errors[2].min() + 1e-9
    assert errors[2].max() < 1e-4


def test_weight():
    """The tip sags by w L^4 / 8 EI under gravity, and alike under a load per mass."""
    weight = Gravity(name="weight", acceleration=(0.0, -1.0, 0.0))
    spread = DistributedLoad(name="weight", body="link", per_mass=(0.0, -1.0, 0.0))
    sags = []
    for force in (weight, spread):
        model = clamped(force, inner_modes=8)
        sags.append(place(model, equilibrium(model).q, "link.tip")[1])
    assert sags[0] == pytest.approx(sags[1], rel=1e-12)
    # The deflection of 5 mm, 1 / 200 of the length; eight modes within hold the shape of a uniform load to 1e-4.
    assert sags[0] == pytest.approx(-7.8 / (8.0 * EI), rel=1e-3)


@pytest.mark.parametrize("axes", ["ground", "body"])
def test_in_free_fall_nothing_bends(axes):
    body = link(0, position=(1.0, 2.0, 3.0), orientation=(0.5, 0.5, -0.5, 0.5))
    load = DistributedLoad(name="weight", body="link", per_mass=(0.0, -9.0, 1.0), axes=axes)
    run = simulate(System(compositions=[body], forces=[load]), 0.3).check()
    modes = [run.model.layout.index[name] for name in body.modes]
    assert np.abs(run.q[:, modes]).max() < 1e-10
    acceleration = np.array([0.0, -9.0, 1.0])
    if axes == "body":
        acceleration = rotation_matrix((0.5, 0.5, -0.5, 0.5)) @ acceleration
    np.testing.assert_allclose(run.q[-1, :3] - run.q[0, :3], 0.5 * 0.09 * acceleration, atol=1e-8)


class Truss:
    """Six point masses in general position, every two of them joined by a spring: displacements alone, 18 freedoms."""

    nodes = np.random.default_rng(3).uniform(-0.5, 0.5, (6, 3)) + [0.3, 0.0, 0.1]
    masses = np.array([1.0, 0.7, 1.3, 0.5, 0.9, 1.1])
    mass = np.diag(np.repeat(masses, 3))
    stiffness = np.zeros((18, 18))
    for i in range(6):
        for j in range(i):
            n = (nodes[i] - nodes[j]) / np.linalg.norm(nodes[i] - nodes[j])
            part = 60.0 * np.kron([[1.0, -1.0], [-1.0, 1.0]], np.outer(n, n))
            at = [*range(3 * i, 3 * i + 3), *range(3 * j, 3 * j + 3)]
            stiffness[np.ix_(at, at)] += part
    # Shapes that hold one mass, and so have momentum.
    modes = orthogonal(mass, stiffness, np.eye(18)[:, 3:12])


def energy_and_momenta(q: np.ndarray, v: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
    """Energy [J], momentum [N s] and angular momentum about the origin [N m s] of the truss's masses."""
    p, A = q[3:7], rotation_matrix(q[3:7])
    u, u_t = ((Truss.modes @ x[7:]).reshape(-1, 3) for x in (q, v))
    x = q[:3] + (Truss.nodes + u) @ A.T
    x_t = v[:3] + (np.cross(2.0 * g_matrix(p) @ v[3:7], Truss.nodes + u) + u_t) @ A.T
    impulse = Truss.masses[:, None] * x_t
    energy = 0.5 * np.sum(x_t * impulse) + 0.5 * u.ravel() @ Truss.stiffness @ u.ravel()
    return float(energy), impulse.sum(axis=0), np.cross(x, impulse).sum(axis=0)


def test_a_free_body_keeps_energy_and_momenta():
    """Spinning and vibrating by a tenth of its size, its frame off the centre of mass.

    Energies and momenta are those of the masses, in which the invariants have no part.
    """
    body = ModalBody.of(
        "truss", Truss.nodes, Truss.mass, Truss.stiffness, Truss.modes, position=(0.2, 0.0, 0.1),
        orientation=(0.9, 0.1, 0.3, -0.2), velocity=(0.3, -0.2, 0.1), angular_velocity=(1.0, 2.0, 1.5),
    )  # fmt: skip
    assert np.abs(body.data.translation).max() > 0.1
    model = Model(System(compositions=[body]))
    model.start.q[7:11] = [0.1, -0.08, 0.05, 0.02]
    run = simulate(model, 1.0, SolverOptions(rtol=1e-7)).check()
    kept = [energy_and_momenta(q, v) for q, v in zip(run.q[::20], run.v[::20], strict=True)]
    energy, linear, angular = (np.array(x) for x in zip(*kept, strict=True))
    assert np.ptp(run.q[:, 7]) > 0.1
    np.testing.assert_allclose(energy, energy[0], rtol=2e-5)
    np.testing.assert_allclose(linear, linear[[0]].repeat(len(linear), 0), atol=1e-5 * np.abs(linear[0]).max())
    np.testing.assert_allclose(angular, angular[[0]].repeat(len(angular), 0), atol=1e-5 * np.abs(angular[0]).max())


def test_a_rigid_motion_is_that_of_a_rigid_body():
    """Accelerations of the frame without modal deformation, against m, c and J of the rod."""
    data = link().data
    M = np.zeros((6, 6))
    M[:3, :3], M[:3, 3:] = data.mass * np.eye(3), -skew(np.array(data.mass_moment))
    M[3:, :3], M[3:, 3:] = M[:3, 3:].T, np.diag(data.inertia[:3])
    model = Model(System(compositions=[link()]))
    b = model.derivatives.blocks(at_rest(model))
    G = np.zeros((6, 7))
    G[:3, :3], G[3:, 3:] = np.eye(3), 2.0 * g_matrix((1.0, 0.0, 0.0, 0.0))
    np.testing.assert_allclose(b.r2_a.toarray()[:7, :7], G.T @ M @ G, atol=1e-12)


def test_model_file(tmp_path):
    """Invariants are written out in full and read again."""
    path = tmp_path / "link.yaml"
    body = link(0, loads={"length": loads_per_length(FE)})
    system = System(compositions=[body], constraints=[Fixed(name="clamp", body_j="link.root")])
    path.write_text(dump(system))
    assert list(load(path).everything()) == list(system.everything())


def broken(**changes):
    arrays = {"nodes": FE.nodes, "mass": FE.mass, "stiffness": FE.stiffness, "modes": MODES, **changes}
    return ModalData.of(**arrays)


MODES = craig_bampton(FE.mass, FE.stiffness, ENDS, 2)
SKEWED = np.column_stack([MODES[:, 0], MODES[:, 1] + 0.1 * MODES[:, 0]])
RIGID = np.column_stack([MODES, np.tile([0.0, 1.0, 0.0, 0.0, 0.0, 0.0], ELEMENTS + 1)])


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"modes": SKEWED}, r"Expected modes that are mass-orthogonal, got a cosine of 0.0995 between modes 0 and 1"),
        ({"modes": RIGID}, r"got the stiffness .* of mode 8. Leave rigid motions out"),
        ({"stiffness": -FE.stiffness}, "Expected modes that strain the body, got the stiffness -"),
        ({"mass": -FE.mass}, "Expected a mass above 0 of each mode"),
        ({"modes": MODES[:-1]}, r"modes: Expected shape \(66, number of modes\), got \(65, 8\)"),
        ({"modes": MODES[:, :0]}, "modes: Expected shape"),
        ({"nodes": FE.nodes[:5]}, "Expected 3 or 6 rows and columns for each of 5 nodes"),
        ({"nodes": np.zeros((0, 3))}, r"nodes: Expected positions of shape \(nodes, 3\)"),
        ({"stiffness": FE.stiffness + np.triu(FE.stiffness, 1)}, "stiffness matrix: Expected a symmetric matrix"),
        ({"stiffness": FE.stiffness * np.nan}, "stiffness matrix: Expected finite numbers, got nan"),
        ({"stiffness": FE.stiffness[:6, :6]}, "stiffness matrix: Expected the shape of the mass matrix"),
        ({"mass": FE.mass * np.tile([1, 2, 1, 1, 1, 1], 11)[:, None] * np.tile([1, 2, 1, 1, 1, 1], 11)}, "Expected"),
    ],
)
def test_what_a_finite_element_model_must_be(changes, said):
    with pytest.raises(ModelError, match=said):
        broken(**changes)


def changed(**changes):
    return ModalData(**{**link(0).data.model_dump(), **changes})


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: changed(modal_stiffness=(1.0,)), "modal_stiffness: Expected 6 items, as many as modes"),
        (
            lambda: changed(modal_stiffness=(1.0, 1.0, -5.0, 1.0, 1.0, 1.0)),
            "mode 2: Expected a modal mass and a modal stiffness above 0, got 1 and -5",
        ),
        (lambda: changed(mass=0.0), "mass = 0.0: Expected a number above 0"),
        (
            lambda: ModalBody(
                name="link",
                data=link(0).data,
                interfaces=(Interface(name="tip", point=(0, 0, 0), translations=(), rotations=()),),
            ),
            "interface 'tip': translations: Expected 6 items, as many as modes, got 0",
        ),
        (lambda: link(0, orientation=(0.0, 0.0, 0.0, 0.0)), "Expected Euler parameters of a length above 0"),
        (lambda: link(0, damping_ratio=-0.1), "damping_ratio = -0.1: Expected a number of at least 0"),
        (
            lambda: ModalBody.of("link", FE.nodes, FE.mass, FE.stiffness, MODES, {"tip": 11}),
            "interface 'tip': Expected a node from 0 to 10, got 11",
        ),
        (lambda: craig_bampton(FE.mass, FE.stiffness, [], 2), "boundary: Expected degrees of freedom from 0 to 65"),
        (lambda: craig_bampton(FE.mass, FE.stiffness, ENDS, 90), "inner_modes: Expected from 0 to 54 modes, got 90"),
        (
            lambda: Model(
                System(
                    compositions=[link(0)], forces=[DistributedLoad(name="x", body="link", per_length=(1.0, 0.0, 0.0))]
                )
            ),
            "Expected per_mass, or a modal body with a distribution of its length, got 'link' with none: ",
        ),
    ],
)
def test_what_is_refused(make, said):
    with pytest.raises(ModelError, match=said):
        make()


def test_orthogonal_modes_of_dependent_shapes():
    """Twice the same shape, and a rigid one among them, give the modes of their span."""
    shapes = np.column_stack([MODES, MODES[:, 1], RIGID[:, -1]])
    found = orthogonal(FE.mass, FE.stiffness, shapes)
    assert found.shape == MODES.shape
    np.testing.assert_allclose(np.abs(found.T @ FE.mass @ MODES), np.eye(8), atol=1e-6)
