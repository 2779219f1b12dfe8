"""Rotations and poses outside compiled code: what declarations need once, with numpy."""

from __future__ import annotations

import numpy as np

from dms_core.errors import ModelError


def unit(vector, what: str) -> np.ndarray:
    """The vector divided by its length; a vector of length 0 is an error that names `what`."""
    x = np.asarray(vector, float)
    length = float(np.linalg.norm(x))
    if length < 1e-12:
        raise ModelError(f"{what} = {tuple(map(float, x))} has length 0; give a direction, for example (0, 0, 1).")
    return x / length


def perpendicular(axis) -> np.ndarray:
    """A unit vector perpendicular to `axis`, chosen the same way every time."""
    a = np.asarray(axis, float)
    e = np.zeros(3)
    e[int(np.argmin(np.abs(a)))] = 1.0
    x = np.cross(a, e)
    return x / np.linalg.norm(x)


def rotation_matrix(p) -> np.ndarray:
    """A(p), shape (3, 3), of Euler parameters p (scalar first), which are normalised."""
    p0, e1, e2, e3 = np.asarray(p, float) / np.linalg.norm(p)
    e = np.array([e1, e2, e3])
    skew = np.array([[0.0, -e3, e2], [e3, 0.0, -e1], [-e2, e1, 0.0]])
    return (p0 * p0 - e @ e) * np.eye(3) + 2.0 * np.outer(e, e) + 2.0 * p0 * skew


def euler_parameters(A) -> np.ndarray:
    """Euler parameters (scalar first) of a rotation matrix, shape (3, 3); inverse of `rotation_matrix` but for a sign.

    With t = tr A, p0^2 = (1 + t) / 4 and e_k^2 = (1 + 2 A_kk - t) / 4; the largest is taken as a root, and the others
    follow from A_ij - A_ji = 4 p0 e_k and A_ij + A_ji = 4 e_i e_j, so that nothing is divided by a small number
    (Shepperd 1978, J. Guidance and Control 1(3):223-224).
    """
    A = np.asarray(A, float)
    odd = np.array([A[2, 1] - A[1, 2], A[0, 2] - A[2, 0], A[1, 0] - A[0, 1]])
    trace, k = np.trace(A), int(np.argmax(np.diag(A)))
    if trace >= A[k, k]:
        p0 = 0.5 * np.sqrt(1.0 + trace)
        return np.concatenate([[p0], odd / (4.0 * p0)])
    e_k = 0.5 * np.sqrt(1.0 + 2.0 * A[k, k] - trace)
    e = (A[k] + A[:, k]) / (4.0 * e_k)
    e[k] = e_k
    return np.concatenate([[odd[k] / (4.0 * e_k)], e])


def quaternion(axis, angle: float) -> np.ndarray:
    """Euler parameters of a rotation by `angle` [rad] about `axis`."""
    a = unit(axis, "rotation axis")
    return np.concatenate([[np.cos(angle / 2.0)], np.sin(angle / 2.0) * a])


def quaternion_product(p, s) -> np.ndarray:
    """Euler parameters of A(p) A(s)."""
    p0, e = p[0], np.asarray(p[1:], float)
    s0, f = s[0], np.asarray(s[1:], float)
    return np.concatenate([[p0 * s0 - e @ f], p0 * f + s0 * e + np.cross(e, f)])


def euler_rates(p, angular_velocity) -> np.ndarray:
    """Rates of unit Euler parameters p [1/s], shape (4,), for an angular velocity in ground axes [rad/s]."""
    return 0.5 * g_matrix(p).T @ (rotation_matrix(p).T @ np.asarray(angular_velocity, float))


def g_matrix(p) -> np.ndarray:
    """G(p), shape (3, 4): omega in body axes = 2 G(p) pdot, and pdot = G(p)^T omega / 2."""
    p0, e1, e2, e3 = p
    return np.array([[-e1, p0, e3, -e2], [-e2, -e3, p0, e1], [-e3, e2, -e1, p0]])
