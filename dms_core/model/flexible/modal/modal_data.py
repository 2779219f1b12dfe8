"""What a modal body is to the equations of motion: a few numbers, computed once from mass, stiffness and modes.

The nodes of a finite-element model lie at x_k in the floating frame and have three displacements each, or three
displacements and three rotations. With its mass M, its stiffness K and modes Phi, displacements u = Phi eta, the
velocity of the frame (w, omega, in its axes) and the modal rates give the model's nodes the velocities

    V = S_t w + S_r(x + u) omega + Phi eta_t       (S_r: omega x (x_k + u_k), and omega for the rotations)

and T = 1/2 V^T M V is polynomial in eta. Its coefficients are the invariants (A. A. Shabana (2013), Dynamics of
Multibody Systems, sect. 5.3; from a mass matrix alone, A. Zwölfer and J. Gerstmayr (2020), Acta Mech. 231:2757-2782):

    m = S_t^T M S_t,   c = c_0 + P eta,  P = S_t^T M Phi,   J = J_0 + eta_a J1_a + eta_a eta_b J2_ab,
    R = R_0 + eta_a R1_a,  R_0 = S_r^T M Phi:    T = m w.w / 2 + w.(omega x c + P eta_t) + omega.J omega / 2
                                                     + omega.R eta_t + eta_t.Phi^T M Phi eta_t / 2
"""

from __future__ import annotations

from typing import Annotated, Any, Self

import numpy as np
from pydantic import Field, model_validator

from dms_core.errors import ModelError
from dms_core.model.element import Vector
from dms_core.validation import Checked, check_sizes

Six = Annotated[tuple[float, float, float, float, float, float], Field(description="xx, yy, zz, xy, xz, yz")]

ORTHOGONAL = 1e-6
"""Cosine between two modes, in the metric of mass or stiffness, from which they count as not orthogonal."""
ALIKE = 1e-8
"""Relative difference up to which a matrix counts as symmetric, and a mass as the same in all directions."""
ROUNDING = 1e-12
"""Share of what a product of shapes could be at most that is not told from 0."""
STIFF = 1e-10
"""Share of the largest modal stiffness over modal mass below which a mode is a motion without strain."""


def six(J: np.ndarray) -> np.ndarray:
    """(xx, yy, zz, xy, xz, yz) of matrices, their symmetric parts: shape (..., 3, 3) to (..., 6)."""
    S = 0.5 * (J + J.swapaxes(-1, -2))
    return S[..., [0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]


def nested(x: np.ndarray, size: np.ndarray | float) -> Any:
    """The array as nested tuples, with 0 for what is rounding beside `size`, of a shape that x broadcasts with."""
    clean = np.where(np.abs(x) > ROUNDING * size, x, 0.0).tolist()
    return _tuples(clean)


def _tuples(x: Any) -> Any:
    return tuple(map(_tuples, x)) if isinstance(x, list) else x


def skew(x: np.ndarray) -> np.ndarray:
    """The matrix of x cross, shape (3, 3)."""
    return np.array([[0.0, -x[2], x[1]], [x[2], 0.0, -x[0]], [-x[1], x[0], 0.0]])


class ModalData(Checked):
    """Invariants of a modal body, moments about the origin of its floating frame, in its axes; n modes.

    `ModalData.of` computes them from a finite-element model.
    """

    wrong = ModelError
    mass: float = Field(gt=0.0, description="m [kg]")
    mass_moment: Vector = Field(description="c_0 [kg m]")
    inertia: Six = Field(description="J_0 [kg m^2]")
    modal_mass: tuple[float, ...] = Field(min_length=1, description="Phi^T M Phi of each mode [kg, if Phi has no unit]")
    modal_stiffness: tuple[float, ...] = Field(description="Phi^T K Phi of each mode [N/m]")
    translation: tuple[Vector, ...] = Field(description="P, a column for each mode [kg]")
    rotation: tuple[Vector, ...] = Field(description="R_0, a column for each mode [kg m]")
    inertia_rate: tuple[Six, ...] = Field(description="J1, for each mode [kg m]")
    inertia_curvature: tuple[tuple[Six, ...], ...] = Field(description="J2, for each pair of modes [kg]")
    rotation_rate: tuple[tuple[Vector, ...], ...] = Field(description="R1, for each pair of modes [kg]")

    def model_post_init(self, _) -> None:
        """Refuse numbers that are no measure of anything."""
        check_sizes(self)

    @model_validator(mode="after")
    def _fits(self) -> Self:
        n = self.size
        for name in (
            "modal_stiffness", "translation", "rotation", "inertia_rate", "inertia_curvature", "rotation_rate"
        ):  # fmt: skip
            value = getattr(self, name)
            nested = name in ("inertia_curvature", "rotation_rate")
            if len(value) != n or (nested and any(len(row) != n for row in value)):
                raise ValueError(f"{name}: Expected {'a square of ' if nested else ''}{n} items, as many as modes")
        J2 = np.array(self.inertia_curvature)
        if np.abs(J2 - J2.swapaxes(0, 1)).max() > ALIKE * np.abs(J2).max():
            raise ValueError("inertia_curvature: Expected the same for the modes a, b as for b, a")
        for k, (m, s) in enumerate(zip(self.modal_mass, self.modal_stiffness, strict=True)):
            if not (m > 0.0 and s > 0.0):
                raise ValueError(
                    f"mode {k}: Expected a modal mass and a modal stiffness above 0, got {m:.6g} and {s:.6g}"
                )
        return self

    @property
    def size(self) -> int:
        """Number of modes."""
        return len(self.modal_mass)

    @classmethod
    def of(cls, nodes: np.ndarray, mass: np.ndarray, stiffness: np.ndarray, modes: np.ndarray) -> ModalData:
        """The invariants of a finite-element model.

        Args:
            nodes: positions of the nodes in the floating frame [m], shape (k, 3).
            mass: M, shape (d, d), d = 3 k (displacements of node 0, of node 1, ...) or 6 k (and rotations).
            stiffness: K, shape (d, d).
            modes: Phi, shape (d, n): orthogonal in M and in K, none of them a rigid motion.

        Raises:
            ModelError: shapes do not fit, a matrix is not symmetric, modes are not orthogonal or do not strain.
        """
        x, M, K, Phi = (np.asarray(a, float) for a in (nodes, mass, stiffness, modes))
        _check_shapes(x, M, K, Phi)
        _check_modes(Phi, M, K)
        per = len(M) // len(x)
        S_t, S_r = rigid_motions(x, per)
        total, A = S_t.T @ M @ S_t, M @ Phi
        if np.abs(total - total[0, 0] * np.eye(3)).max() > ALIKE * abs(total[0, 0]):
            raise ModelError(
                f"mass matrix: Expected one mass in all directions, got {np.diag(total)} kg along x, y, z and "
                f"{np.abs(total - np.diag(np.diag(total))).max():.3g} kg between them."
            )
        turned = np.array([_turned(Phi[:, a], per) for a in range(Phi.shape[1])])
        # S_t^T M S_r = -skew(c_0).
        first, M_r, M_turned = S_t.T @ M @ S_r, M @ S_r, M @ turned
        J, J1 = S_r.T @ M_r, np.einsum("ij,aik->ajk", M_r, turned)
        m, m_a = float(total[0, 0]), np.einsum("ia,ia->a", Phi, A)
        # What is rounding is told by what Cauchy and Schwarz allow.
        length, root = np.sqrt(np.trace(J) / m), np.sqrt(m_a)
        alone, both = np.sqrt(m) * root[:, None], root[:, None, None] * root[:, None]
        return cls(
            mass=m,
            mass_moment=nested(first[[1, 2, 0], [2, 0, 1]], m * length),
            inertia=nested(six(J), m * length**2),
            modal_mass=nested(m_a, 0.0),
            modal_stiffness=nested(np.einsum("ia,ia->a", Phi, K @ Phi), 0.0),
            translation=nested((S_t.T @ A).T, alone),
            rotation=nested((S_r.T @ A).T, alone * length),
            inertia_rate=nested(six(J1 + J1.swapaxes(1, 2)), alone * length),
            inertia_curvature=nested(six(np.einsum("aij,bik->abjk", turned, M_turned)), both),
            rotation_rate=nested(np.einsum("aij,ib->abj", turned, A), both),
        )


def rigid_motions(x: np.ndarray, per: int) -> tuple[np.ndarray, np.ndarray]:
    """S_t and S_r at the nodes x, shapes (per k, 3) each, `per` degrees of freedom a node."""
    S_t, S_r = np.zeros((len(x), per, 3)), np.zeros((len(x), per, 3))
    S_t[:, :3] = np.eye(3)
    S_r[:, :3] = [-skew(p) for p in x]
    if per == 6:
        S_r[:, 3:] = np.eye(3)
    return S_t.reshape(-1, 3), S_r.reshape(-1, 3)


def _turned(u: np.ndarray, per: int) -> np.ndarray:
    """Velocities omega x u_k of the nodes by omega, shape (per k, 3)."""
    out = np.zeros((len(u) // per, per, 3))
    out[:, :3] = [-skew(p) for p in u.reshape(-1, per)[:, :3]]
    return out.reshape(-1, 3)


def _check_shapes(x: np.ndarray, M: np.ndarray, K: np.ndarray, Phi: np.ndarray) -> None:
    if x.ndim != 2 or x.shape[1] != 3 or len(x) == 0:
        raise ModelError(f"nodes: Expected positions of shape (nodes, 3), got {x.shape}.")
    if M.shape not in ((3 * len(x),) * 2, (6 * len(x),) * 2):
        raise ModelError(
            f"mass matrix: Expected 3 or 6 rows and columns for each of {len(x)} nodes, got shape {M.shape}."
        )
    if K.shape != M.shape:
        raise ModelError(f"stiffness matrix: Expected the shape of the mass matrix, {M.shape}, got {K.shape}.")
    if Phi.ndim != 2 or len(Phi) != len(M) or Phi.shape[1] == 0:
        raise ModelError(f"modes: Expected shape ({len(M)}, number of modes), got {Phi.shape}.")
    for name, value in (("nodes", x), ("mass matrix", M), ("stiffness matrix", K), ("modes", Phi)):
        if not np.isfinite(value).all():
            raise ModelError(f"{name}: Expected finite numbers, got {value[~np.isfinite(value)][0]}.")
    for name, value in (("mass matrix", M), ("stiffness matrix", K)):
        off = np.abs(value - value.T).max()
        if off > ALIKE * np.abs(value).max():
            raise ModelError(f"{name}: Expected a symmetric matrix, got entries that differ by {off:.3g}.")


def _check_modes(Phi: np.ndarray, M: np.ndarray, K: np.ndarray) -> None:
    """Modes are orthogonal in both matrices, have mass, and strain the body."""
    products = [(name, Phi.T @ B @ Phi) for name, B in (("mass", M), ("stiffness", K))]
    m, k = (np.diag(B) for _, B in products)
    if not m.min() > 0.0:
        a = int(np.argmin(m))
        raise ModelError(f"modes: Expected a mass above 0 of each mode, got {m[a]:.3g} of mode {a}.")
    if not (k / m).min() > STIFF * np.abs(k / m).max():
        a = int(np.argmin(k / m))
        raise ModelError(
            f"modes: Expected modes that strain the body, got the stiffness {k[a]:.3g} of mode {a}. Leave rigid "
            "motions out: the floating frame makes them."
        )
    for name, B in products:
        size = np.sqrt(np.diag(B))
        cosine = np.abs(B / np.outer(size, size) - np.eye(len(B)))
        one, other = divmod(int(np.argmax(cosine)), len(B))
        if cosine[one, other] > ORTHOGONAL:
            raise ModelError(
                f"modes: Expected modes that are {name}-orthogonal, got a cosine of {cosine[one, other]:.3g} between "
                f"modes {min(one, other)} and {max(one, other)}. `craig_bampton` and `orthogonal` give such modes."
            )
