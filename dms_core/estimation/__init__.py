"""State estimation (paper Fig. 1): Kalman filter, smoother, observability, measurement.

A model and noisy readings of some of its sensors give its state, inputs and constants that no sensor shows, all its
other sensors ("virtual sensing"), and how far each can be trusted.
"""

from dms_core.estimation.compiled.batch import FilterBatch
from dms_core.estimation.compiled.filter import CompiledFilter
from dms_core.estimation.filter.forms import filter_of
from dms_core.estimation.filter.kalman import KalmanFilter
from dms_core.estimation.measurement import Measurements, read_measurements
from dms_core.estimation.observability import empirical_observability, local_observability
from dms_core.estimation.record import estimate
from dms_core.estimation.settings import Bias, Channel, EstimatedConstant, EstimatedInput, FilterSettings

__all__ = [
    "Bias",
    "Channel",
    "CompiledFilter",
    "EstimatedConstant",
    "EstimatedInput",
    "FilterBatch",
    "FilterSettings",
    "KalmanFilter",
    "Measurements",
    "empirical_observability",
    "estimate",
    "filter_of",
    "local_observability",
    "read_measurements",
]
