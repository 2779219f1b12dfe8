"""Muscles (paper sect. 3.4): force curves, activation and the element itself."""

from dms_core.model.muscles.muscle import ThelenMuscle
from dms_core.model.muscles.thelen_curves import ThelenCurves

__all__ = ["ThelenCurves", "ThelenMuscle"]
