"""What a worn device can know of its wearer from its own sensors: moments at the elbow by a Kalman filter.

`ElbowEstimator` filters with the nominal elbow as differential-algebraic equations; the environments have a reduced
filter of the same elbow (reduced_filter.py), which costs next to nothing.
"""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from exo_env.estimation.elbow_estimator import ElbowEstimator, Moment
    from exo_env.estimation.nominal_elbow import NominalElbow

__all__ = ["ElbowEstimator", "Moment", "NominalElbow"]


def __getattr__(name: str) -> Any:
    """Load the filter with the equations when it is asked for: environments do without."""
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from exo_env.estimation import elbow_estimator, nominal_elbow

    return getattr(nominal_elbow if name == "NominalElbow" else elbow_estimator, name)
