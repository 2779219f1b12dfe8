"""The tension of each rope is commanded: a = -1 is a slack rope, a = 1 the largest tension (rope_motors.py)."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np

from exo_env.drives.drive import affine
from exo_env.drives.rope_motors import CommandedTensions
from exo_env.ecosystem.exoskeleton import Exoskeleton


class RopeTension(CommandedTensions):
    """Drive of action mode 'rope_tension': one action a rope."""

    kernel: ClassVar[Any] = affine
    rtol: ClassVar[float] = 0.01
    """Over an episode the elbow stays within 0.4e-3 rad of the exact solution in half of the patients, within 1.3e-3 in
    nine of ten."""

    def actions(self, device: Exoskeleton) -> tuple[str, ...]:
        """The tension of each rope."""
        return tuple(f"{rope} tension" for rope in self.largest(device))

    def numbers(self, device: Exoskeleton) -> np.ndarray:
        """Offset and gain from an action to a command [N], shape (n, 2)."""
        return np.array([[0.5 * most, 0.5 * most] for most in self.largest(device).values()])
