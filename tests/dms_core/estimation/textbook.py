"""A Kalman filter as in the textbooks (e.g. Simon 2006, sect. 5.1), in plain numpy, without any code of the package."""

from __future__ import annotations

import numpy as np


def predict(x, P, A, Q):
    return A @ x, A @ P @ A.T + Q


def correct(x, P, C, R, y):
    S = C @ P @ C.T + R
    K = P @ C.T @ np.linalg.inv(S)
    r = y - C @ x
    return x + K @ r, P - K @ C @ P, float(r @ np.linalg.inv(S) @ r)


def least_squares(x0, P0, A, Q, C, R, readings):
    """All states at once: minimum of the weighted squares of start, steps and readings, shape (k, n).

    The start is that at the first reading.
    """
    n, k = len(x0), len(readings)
    rows, right = [], []

    def add(blocks, value, weight):
        root = np.linalg.inv(np.linalg.cholesky(weight))
        row = np.zeros((len(value), n * k))
        for at, block in blocks:
            row[:, n * at : n * (at + 1)] = block
        rows.append(root @ row)
        right.append(root @ value)

    add([(0, np.eye(n))], x0, P0)
    for i, y in enumerate(readings):
        add([(i, C)], y, R)
        if i + 1 < k:
            add([(i + 1, np.eye(n)), (i, -A)], np.zeros(n), Q)
    return np.linalg.lstsq(np.vstack(rows), np.concatenate(right), rcond=None)[0].reshape(k, n)
