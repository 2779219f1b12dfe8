"""What a joint needs of two bodies' poses: given by the user, or taken from the declared start poses."""

from __future__ import annotations

import numpy as np

from dms_core.errors import ModelError
from dms_core.model.geometry.frames import rotation_matrix


def second_point(system, joint) -> np.ndarray:
    """point_j, by default where point_i starts, in the frame of body_j [m], shape (3,)."""
    if joint.point_j is None:
        return system.start_point(joint.body_i, joint.point_i, joint.body_j)
    return np.asarray(joint.point_j, float)


def joint_arms(system, joint) -> tuple[np.ndarray, np.ndarray]:
    """point_i and point_j (by default where point_i starts) from the centres of mass [m], shape (3,) each."""
    return system.arm(joint.body_i, joint.point_i), system.arm(joint.body_j, second_point(system, joint))


def relative_rotation(system, who: str, body_i: str, body_j: str, orientation) -> np.ndarray:
    """A_i^T A_j, shape (3, 3): its rows are the axes of body_i in the frame of body_j."""
    if orientation is None:
        return np.column_stack([system.start_direction(body_j, axis, body_i) for axis in np.eye(3)])
    if np.linalg.norm(orientation) < 1e-6:
        raise ModelError(f"{who}: orientation = {orientation} has length 0; (1, 0, 0, 0) is no rotation.")
    return rotation_matrix(orientation)
