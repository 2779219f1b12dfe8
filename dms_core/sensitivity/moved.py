"""A model with other values of some declared numbers, whose runs begin where the model's own do."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from dms_core.assembly.derivatives.parameter_derivatives import declared_number, system_with
from dms_core.assembly.model import Model
from dms_core.errors import InputError
from dms_core.sensitivity.nodes import Number


class MovedNumbers:
    """Some declared numbers of a model, and models in which they have other values.

    Args:
        model: a compiled model.
        numbers: which ones.

    Raises:
        InputError: there is no such number, or one places a joint, so that the start would not fit its other values.
    """

    def __init__(self, model: Model, numbers: Sequence[Number]) -> None:
        self.model, self.numbers = model, tuple(numbers)
        self.declared = np.array([declared_number(model.system, *x) for x in self.numbers])
        """Declared values, shape (n,)."""
        self._last: tuple[list[float], Model] = (self.declared.tolist(), model)
        for x in self.numbers:
            if model.parameter_derivatives.direction(*x).constraints.any():
                raise InputError(
                    f"'{x.name}' places a joint or a rope of constant length, and the start of a run would not fit its "
                    "other values. Expected a number of forces, masses or motors."
                )

    def at(self, values: np.ndarray) -> Model:
        """The model with these values, shape (n,).

        Raises:
            InputError: a value is not finite, or there are more or fewer of them.
        """
        if values.shape != self.declared.shape or not np.isfinite(values).all():
            names = ", ".join(x.name for x in self.numbers) or "none"
            raise InputError(
                f"numbers = {values.tolist()}: Expected {len(self.numbers)} finite numbers ({names}), shape "
                f"({len(self.numbers)},)."
            )
        if values.tolist() != self._last[0]:
            there = zip(self.numbers, values.tolist(), self.declared.tolist(), strict=True)
            changed = {(x.element, x.path): p for x, p, before in there if p != before}
            system = system_with(self.model.system, changed)
            self._last = values.tolist(), Model(system, like=self.model) if changed else self.model
        return self._last[1]
