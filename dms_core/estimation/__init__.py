"""State estimation (paper Fig. 1): Kalman filter, smoother, observability, measurement.

A model and noisy readings of some of its sensors give its state, inputs and constants that no sensor shows, all its
other sensors ("virtual sensing"), and how far each can be trusted.
"""

from dms_core.estimation.kalman import KalmanFilter
from dms_core.estimation.settings import Bias, Channel, EstimatedConstant, EstimatedInput, FilterSettings

__all__ = ["Bias", "Channel", "EstimatedConstant", "EstimatedInput", "FilterSettings", "KalmanFilter"]
