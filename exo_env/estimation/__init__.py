"""What a worn device can know of its wearer from its own sensors: moments at the elbow by a Kalman filter."""

from exo_env.estimation.elbow_estimator import ElbowEstimator, Moment
from exo_env.estimation.nominal_elbow import NominalElbow

__all__ = ["ElbowEstimator", "Moment", "NominalElbow"]
