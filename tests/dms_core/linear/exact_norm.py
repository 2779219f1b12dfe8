"""Least-norm multipliers by singular values: what minimum_norms is held against."""

import numpy as np


def exact_norm(G: np.ndarray, lam: np.ndarray, tol: float = 1e-9) -> np.ndarray:
    """Projection of lam on the range of G, shapes (m, n) and (m,); singular values below tol of the largest are 0."""
    left, values, _ = np.linalg.svd(G, full_matrices=False)
    basis = left[:, values > tol * values[0]]
    return basis @ (basis.T @ lam)
