"""Kalman filters on the constraints, and the smoother."""
