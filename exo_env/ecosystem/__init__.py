"""Section 4.1 of the paper: person and arm, exoskeleton, gym machine, joined into one system."""

from typing import Any

from dms_core.renamed import inside, moved_name
from exo_env.old_names import NAMES


def __getattr__(name: str) -> Any:
    """Names that a module of this name had in version 0.1."""
    return moved_name(__name__, name, inside("exo_env", NAMES["ecosystem"]))
