"""Sparse linear algebra for one fixed pattern: order of elimination, compiled LU, rank of the constraints."""
