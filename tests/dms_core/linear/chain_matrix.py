"""The Newton matrix of a chain of rigid bodies on hinges, written out by hand from the elements' own kernels.

Unknowns (dq, dv', dlam', dmu') of the stabilised index-2 equations (paper eq. 1 to 4) under BDF2, c0 = 1.5 / h:

    -dq + dv' - G^T dmu'                                  = .      (n_q)
    (Jq + H) / c0^2 dq + (Ja + Jv / c0) dv' + G^T dlam'   = .      (n_q)
    G dq                                                  = .      (n_phi)
    (W / c0) dq + G dv'                                   = .      (n_phi)

A link has 7 coordinates, 1 norm row and 5 hinge rows: 26 unknowns a link, one degree of freedom a link.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from dms_core.model.bodies.rigid_body import RigidBody, rigid_body
from dms_core.model.constraints.euler_norm import EulerNorm, euler_norm
from dms_core.model.constraints.joints.revolute import Revolute, revolute
from dms_core.model.system import System

NO_INTEGERS = np.zeros(0, np.int32)
NO_INPUTS = np.zeros((0, 3))


def chain_system(links: int) -> System:
    """Links of 0.3 m, hinges about z at x = 0, 0.3, 0.6 ... m."""
    bodies = [
        RigidBody(
            name=f"b{i}", mass=1.0 + 0.1 * (i % 5), inertia=(1e-3, 8e-3, 8.5e-3), position=(0.3 * i + 0.15, 0.0, 0.0)
        )
        for i in range(links)
    ]
    hinges = [
        Revolute(
            name=f"j{i}",
            body_i="ground" if i == 0 else f"b{i - 1}",
            body_j=f"b{i}",
            point_i=(0.0, 0.0, 0.0) if i == 0 else (0.15, 0.0, 0.0),
        )
        for i in range(links)
    ]
    return System(bodies=bodies, constraints=hinges)


class _Entries:
    """Triplets with a structural pattern: entries of the pattern stay although their value is 0."""

    def __init__(self) -> None:
        self.rows, self.cols, self.values = [], [], []

    def add(self, row_index, col_index, values, pattern) -> None:
        """values[i, j] at (row_index[i], col_index[j]) wherever the pattern holds and both indices exist (>= 0)."""
        assert not np.any((values != 0.0) & ~pattern), "a derivative outside its pattern"
        for i, j in np.argwhere(pattern):
            if row_index[i] >= 0 and col_index[j] >= 0:
                self.rows.append(row_index[i])
                self.cols.append(col_index[j])
                self.values.append(values[i, j])


def chain_newton_matrix(links: int, h: float = 1e-3, seed: int = 0) -> sp.coo_matrix:
    """Newton matrix of the chain near its start, at random velocities, accelerations and multipliers.

    Returns:
        Duplicate-free coordinates in row-major order, explicit zeros of the pattern included, shape (26 links,) * 2.
    """
    system, rng = chain_system(links), np.random.default_rng(seed)
    n_q, n_phi, c0 = 7 * links, 6 * links, 1.5 / h
    q = np.array([c.start for b in system.bodies for c in b.coordinates()])
    q += 0.1 * rng.standard_normal(n_q)
    v, a = rng.standard_normal(n_q), 10.0 * rng.standard_normal(n_q)
    lam = 20.0 * rng.standard_normal(n_phi)
    found = _Entries()
    names = {b.name: i for i, b in enumerate(system.bodies)}
    eye = np.eye(n_q, dtype=bool)
    found.add(np.arange(n_q), np.arange(n_q), -np.eye(n_q), eye)
    found.add(np.arange(n_q), n_q + np.arange(n_q), np.eye(n_q), eye)

    def local(bodies):
        """Global coordinates of the bodies named; -1 for the ground."""
        return np.concatenate([np.arange(7) + 7 * names[b] if b in names else np.full(7, -1) for b in bodies])

    def gathered(x, index, ground):
        return np.where(index >= 0, x[index], ground)

    for body in system.bodies:
        p = body.place(system)
        index = local(p.bodies)
        r, jac = np.zeros(7), [np.zeros((7, 7)) for _ in range(3)]
        rigid_body(NO_INTEGERS, np.array(p.numbers), q[index], v[index], a[index], NO_INPUTS, 1, r, *jac)
        jq, jv, ja = jac
        found.add(n_q + index, index, jq / c0**2, p.pattern.q)
        found.add(n_q + index, n_q + index, ja + jv / c0, p.pattern.a | p.pattern.v)
    row = 0
    for element in system.constraints:
        kernel = {EulerNorm: euler_norm, Revolute: revolute}[type(element)]
        p, m = element.place(system), len(element.rows())
        index = local(p.bodies)
        n = index.size
        still = np.tile([0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0], n // 7)
        phi, phi_t, G, W, H = np.zeros(m), np.zeros((m, 2)), np.zeros((m, n)), np.zeros((m, n)), np.zeros((n, n))
        k = row + np.arange(m)
        kernel(
            NO_INTEGERS, np.array(p.numbers), gathered(q, index, still), gathered(v, index, 0.0), lam[k], NO_INPUTS, 1,
            phi, phi_t, G, W, H,
        )  # fmt: skip
        there = index >= 0
        global_index = np.where(there, index, -(10**9))
        found.add(global_index, 2 * n_q + n_phi + k, -G.T, p.pattern.G.T)
        found.add(n_q + global_index, global_index, H / c0**2, p.pattern.H)
        found.add(n_q + global_index, 2 * n_q + k, G.T, p.pattern.G.T)
        found.add(2 * n_q + k, global_index, G, p.pattern.G)
        found.add(2 * n_q + n_phi + k, global_index, W / c0, p.pattern.W)
        found.add(2 * n_q + n_phi + k, n_q + global_index, G, p.pattern.G)
        row += m
    return _merged(found, 2 * (n_q + n_phi))


def _merged(found: _Entries, n: int) -> sp.coo_matrix:
    """Sums duplicates, keeps explicit zeros."""
    matrix = sp.csr_matrix((found.values, (found.rows, found.cols)), shape=(n, n))
    matrix.sum_duplicates()
    return matrix.tocoo()
