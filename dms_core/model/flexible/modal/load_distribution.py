"""How a length or a volume is spread over a modal body, so that a load by it does its work on frame and modes.

A finite-element model gives the nodal loads B (d, 3) of a load of 1 per length (or volume) along x, y and z of the
floating frame. Fixed in direction, a load g then has the potential -g . (W r + A (s + P eta)) with

    W I = S_t^T B,   skew(s) = S_r^T B,   P^T = Phi^T B

which is that of a weight, whose B is M S_t, with the length or volume W in place of the mass (modal_data.py).
"""

from __future__ import annotations

from typing import Literal

import numpy as np
from pydantic import Field

from dms_core.errors import ModelError
from dms_core.model.element import Vector
from dms_core.model.flexible.modal.modal_data import ALIKE, nested, rigid_motions
from dms_core.validation import Checked, check_sizes


class LoadDistribution(Checked):
    """Length or volume of a modal body, spread over frame and modes; `LoadDistribution.of` computes it."""

    wrong = ModelError
    measure: Literal["length", "volume"] = Field(description="what loads of it are per: per_length or per_volume")
    total: float = Field(gt=0.0, description="W, the whole length [m] or volume [m^3]")
    moment: Vector = Field(description="s, integral of the place in the floating frame over it [m^2] or [m^4]")
    translation: tuple[Vector, ...] = Field(
        description="P, integral of the displacement over it for each mode [m^2] or [m^4], if modes have no unit"
    )

    def model_post_init(self, _) -> None:
        """Refuse numbers that are no measure of anything."""
        check_sizes(self)

    @classmethod
    def of(
        cls, measure: Literal["length", "volume"], nodes: np.ndarray, modes: np.ndarray, loads: np.ndarray
    ) -> LoadDistribution:
        """From a finite-element model.

        Args:
            measure: "length" or "volume".
            nodes: positions of the nodes in the floating frame [m], shape (k, 3).
            modes: Phi, shape (d, n).
            loads: B, nodal forces (and moments, if d = 6 k) of a load of 1 along x, along y and along z, shape (d, 3).

        Raises:
            ModelError: the shape is wrong, or the loads are not those of one measure in all three directions.
        """
        x, Phi, B = (np.asarray(a, float) for a in (nodes, modes, loads))
        who = f"loads by '{measure}'"
        if B.shape != (len(Phi), 3):
            raise ModelError(
                f"{who}: Expected shape ({len(Phi)}, 3), nodal loads along x, y and z, got shape {B.shape}."
            )
        if not np.isfinite(B).all():
            raise ModelError(f"{who}: Expected finite numbers, got {B[~np.isfinite(B)][0]}.")
        S_t, S_r = rigid_motions(x, len(Phi) // len(x))
        total, turning = S_t.T @ B, S_r.T @ B
        W, span = float(np.trace(total)) / 3.0, float(np.abs(x).max())
        if not W > 0.0 or np.abs(total - W * np.eye(3)).max() > ALIKE * W:
            raise ModelError(
                f"{who}: Expected one total above 0 in all directions, got {np.diag(total)} along x, y, z and "
                f"{np.abs(total - np.diag(np.diag(total))).max():.3g} between them."
            )
        off = np.abs(turning + turning.T).max()
        if off > ALIKE * W * span:
            raise ModelError(
                f"{who}: Expected moments about the origin that belong to one centre, got a difference of {off:.3g}: "
                "moments of a load along x about y and of one along y about x are opposite."
            )
        shapes = np.abs(Phi).max(axis=0)[:, None]
        return cls(
            measure=measure, total=W, moment=nested(turning[[2, 0, 1], [1, 2, 0]], W * span),
            translation=nested(Phi.T @ B, W * shapes),
        )  # fmt: skip
