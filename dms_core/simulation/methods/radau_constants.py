"""Numbers of the three-stage Radau IIA method of order 5 (Hairer and Wanner 1996, table IV.5.6 and sect. IV.8).

A is the matrix of the method, A^-1 = T Lambda T^-1 with one real and two conjugate complex eigenvalues: that turns the
linear system of all three stages into one real and one complex system of the size of a single stage.
"""

import math

import numpy as np

STAGES = 3
ORDER_OF_ERROR = 4
"""The local error estimate goes with h^4: that of the embedded formula of order 3."""

_R = math.sqrt(6.0)
A = np.array(
    [
        [(88.0 - 7.0 * _R) / 360.0, (296.0 - 169.0 * _R) / 1800.0, (-2.0 + 3.0 * _R) / 225.0],
        [(296.0 + 169.0 * _R) / 1800.0, (88.0 + 7.0 * _R) / 360.0, (-2.0 - 3.0 * _R) / 225.0],
        [(16.0 - _R) / 36.0, (16.0 + _R) / 36.0, 1.0 / 9.0],
    ]
)
C = ((4.0 - _R) / 10.0, (4.0 + _R) / 10.0, 1.0)
"""Places of the stages in a step."""

REAL = 3.0 + 3.0 ** (2.0 / 3.0) - 3.0 ** (1.0 / 3.0)
"""The real eigenvalue of A^-1."""
COMPLEX = complex(
    3.0 + 0.5 * (3.0 ** (1.0 / 3.0) - 3.0 ** (2.0 / 3.0)), -0.5 * (3.0 ** (5.0 / 6.0) + 3.0 ** (7.0 / 6.0))
)
"""Eigenvalue of the complex system in W_2 + i W_3, where (W_1, W_2, W_3) = T^-1 (Y_1, Y_2, Y_3)."""

ERROR = (-(13.0 + 7.0 * _R) / 3.0, (-13.0 + 7.0 * _R) / 3.0, -1.0 / 3.0)
"""The embedded formula compares f(y_n) with -(ERROR_1 Z_1 + ERROR_2 Z_2 + ERROR_3 Z_3) / h."""


def _eigenvector(value: complex) -> np.ndarray:
    """Of A^-1, its last component 1: from the first two rows of (A - 1 / value) x = 0, by Cramer's rule."""
    a, d = A[0, 0] - 1.0 / value, A[1, 1] - 1.0 / value
    b, c, right = A[0, 1], A[1, 0], -A[:2, 2]
    det = a * d - b * c
    return np.array([(right[0] * d - b * right[1]) / det, (a * right[1] - c * right[0]) / det, 1.0])


def _rows(matrix: np.ndarray) -> tuple[tuple[float, ...], ...]:
    """A matrix as compiled code takes it for constant."""
    return tuple(tuple(float(x) for x in row) for row in matrix)


_PAIR = _eigenvector(COMPLEX.conjugate())
_BASIS = np.column_stack([_eigenvector(complex(REAL)).real, _PAIR.real, _PAIR.imag])
T, T_INVERSE, A_INVERSE = _rows(_BASIS), _rows(np.linalg.inv(_BASIS)), _rows(np.linalg.inv(A))
