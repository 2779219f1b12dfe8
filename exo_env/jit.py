"""Compiled functions of this package: as those of dms_core."""

from dms_core.compiled.jit import compiled

__all__ = ["compiled"]
