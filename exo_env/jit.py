"""Compiled functions of this package: as those of dms_core, and dropped from disk when one of either changes."""

from pathlib import Path

from dms_core.compiled.compilation import drop_stale_code
from dms_core.compiled.jit import compiled

__all__ = ["compiled"]

drop_stale_code(Path(__file__).parent)
