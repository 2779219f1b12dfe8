"""The declared system: bodies, constraints, forces, sensors and inputs by name (paper Fig. 3)."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from dms_core.errors import ModelError, choices
from dms_core.model.constraints.euler_norm import EulerNorm
from dms_core.model.element import (
    GROUND,
    Body,
    Composition,
    Constraint,
    Declaration,
    DynamicElement,
    Force,
    Parts,
    Sensor,
)
from dms_core.model.geometry.frames import rotation_matrix
from dms_core.model.signals import Input

_BRANCHES = (Body, Constraint, Declaration, DynamicElement, Force, Sensor)
"""Classes of so many kinds that a message names them alone."""


class System:
    """Everything a user declares, checked for names. Bodies' unit-norm equations (eq. 9) are added by themselves.

    Args:
        name: shown in reports.
        compositions: declarations that stand for several bodies, constraints and forces each, which come first.
        bodies, constraints, forces, sensors, inputs: declarations; every name is used once.

    Raises:
        ModelError: a name is used twice, or something of the wrong kind is in a list.
    """

    def __init__(
        self,
        name: str = "system",
        *,
        compositions: tuple[Composition, ...] | list[Composition] = (),
        bodies: tuple[Body, ...] | list[Body] = (),
        constraints: tuple[Constraint, ...] | list[Constraint] = (),
        forces: tuple[Force, ...] | list[Force] = (),
        sensors: tuple[Sensor, ...] | list[Sensor] = (),
        inputs: tuple[Input, ...] | list[Input] = (),
    ) -> None:
        self.name = name
        self.compositions = self._checked("compositions", compositions, Composition)
        made = {composition.name: composition.parts() for composition in self.compositions}
        parts = Parts(*(sum((p[k] for p in made.values()), ()) for k in range(len(Parts._fields))))
        self.composed = {part.name: name for name, p in made.items() for of_a_kind in p for part in of_a_kind}
        """Name of each part of a composition, and that of the composition."""
        self.bodies = parts.bodies + self._checked("bodies", bodies, Body)
        norms = tuple(EulerNorm(name=f"{b.name}.euler_norm", body=b.name) for b in self.bodies if b.rigid)
        # Those of another system may be among the constraints that were taken over from it.
        declared = tuple(c for c in self._checked("constraints", constraints, Constraint) if c not in norms)
        self.constraints = norms + parts.constraints + declared
        companions = tuple(e for c in self.constraints for e in c.companions())
        given = tuple(f for f in self._checked("forces", forces, Force) if f not in companions)
        self.forces = self._checked("companions of constraints", companions, Force) + parts.forces + given
        self.sensors = self._checked("sensors", sensors, Sensor)
        self.inputs = self._checked("inputs", inputs, Input)
        self._by_name: dict[str, Declaration] = {}
        for element in self.everything():
            if element.name == GROUND:
                raise ModelError("the name 'ground' is reserved for the fixed frame; choose another name.")
            if element.name in self._by_name:
                first = self._by_name[element.name]
                raise ModelError(
                    f"the name '{element.name}' is used by a {first.kind} and a {element.kind}; names must be unique."
                )
            self._by_name[element.name] = element
        self._check_governed()

    def _check_governed(self) -> None:
        """Two constraints that determine the same are an error."""
        found: dict[str, Constraint] = {}
        for constraint in self.constraints:
            what = constraint.governs()
            first = found.setdefault(what, constraint) if what else constraint
            if first is not constraint:
                raise ModelError(
                    f"{constraint.kind} '{constraint.name}' determines {what}, which {first.kind} '{first.name}' "
                    "determines already. Remove one of them.",
                    constraint.name,
                )

    @property
    def companions(self) -> frozenset[str]:
        """Names of the elements that came with constraints."""
        return frozenset(e.name for c in self.constraints for e in c.companions())

    def own(self, section: str) -> tuple[Declaration, ...]:
        """What was declared in a list ("bodies", ...): without unit-norm equations, companions and composed parts."""
        hidden = {*self.composed, *self.companions}
        return tuple(e for e in getattr(self, section) if not isinstance(e, EulerNorm) and e.name not in hidden)

    @staticmethod
    def _checked(what: str, items: Any, kind: type) -> tuple:
        for item in items:
            if not isinstance(item, kind):
                raise ModelError(f"{what}: {item!r} is not a {kind.__name__}.")
        return tuple(items)

    def everything(self) -> Iterator[Declaration]:
        """All declarations, in the order compositions, bodies, constraints, forces, sensors, inputs."""
        yield from (*self.compositions, *self.bodies, *self.constraints, *self.forces, *self.sensors, *self.inputs)

    def element(self, name: str, kind: type | tuple[type, ...] | None = None) -> Any:
        """The declaration of that name; an unknown name or a wrong kind is an error that lists the right ones."""
        found = self._by_name.get(name)
        wanted = kind or Declaration
        if not isinstance(found, wanted):
            label = _label(wanted)
            names = [e.name for e in self.everything() if isinstance(e, wanted)]
            problem = "does not exist" if found is None else f"is a {found.kind}"
            raise ModelError(f"'{name}' {problem}. Expected the name of a {label}. Declared: {choices(names)}.")
        return found

    def body(self, name: str) -> Body | None:
        """The body of that name, None for 'ground'; an unknown name is an error that lists the bodies."""
        if name == GROUND:
            return None
        if not isinstance(self._by_name.get(name), Body):
            names = [GROUND, *(b.name for b in self.bodies)]
            raise ModelError(f"body '{name}' does not exist. Declared: {choices(names)}.")
        return self._by_name[name]  # type: ignore[return-value]

    def mass_moments(self) -> dict[str, np.ndarray]:
        """First moments of mass about r of the bodies that have any [kg m], see DynamicElement.mass_moments."""
        total: dict[str, np.ndarray] = {}
        for element in (*self.bodies, *self.forces):
            for body, moment in element.mass_moments(self).items():
                before = total.get(body, np.zeros((0, 3)))
                total[body] = np.zeros((max(len(before), len(moment)), 3))
                for part in (before, moment):
                    total[body][: len(part)] += part
        return {body: moment for body, moment in total.items() if np.any(moment)}

    def arm(self, body: str, point) -> np.ndarray:
        """A point of a body's reference frame, seen from its centre of mass [m], shape (3,)."""
        found = self.body(body)
        centre = getattr(found, "centre_of_mass", (0.0, 0.0, 0.0))
        return np.asarray(point, float) - np.asarray(centre, float)

    def start_pose(self, body: str) -> tuple[np.ndarray, np.ndarray]:
        """Declared origin [m] and rotation matrix of a body's reference frame at the start."""
        found = self.body(body)
        if found is None:
            return np.zeros(3), np.eye(3)
        rotation = rotation_matrix(found.orientation) if found.rigid else np.eye(3)  # type: ignore[attr-defined]
        return np.asarray(found.position, float), rotation  # type: ignore[attr-defined]

    def start_point(self, body_i: str, point, body_j: str) -> np.ndarray:
        """A point of body_i in the frame of body_j, both at their declared start poses [m]."""
        (r_i, A_i), (r_j, A_j) = self.start_pose(body_i), self.start_pose(body_j)
        return A_j.T @ (r_i + A_i @ np.asarray(point, float) - r_j)

    def start_direction(self, body_i: str, direction, body_j: str) -> np.ndarray:
        """A direction of body_i in the frame of body_j, both at their declared start poses."""
        (_, A_i), (_, A_j) = self.start_pose(body_i), self.start_pose(body_j)
        return A_j.T @ (A_i @ np.asarray(direction, float))


def _label(wanted: type | tuple[type, ...]) -> str:
    """Names of classes as a message lists them; those of all kinds of it for one that is itself no kind."""
    classes: set[Any] = set()
    for cls in wanted if isinstance(wanted, tuple) else (wanted,):
        kinds: list[Any] = [cls] if getattr(cls, "kind", "") or cls in _BRANCHES else list(cls.__subclasses__())
        classes.update(k for k in kinds if getattr(k, "kind", "") or k in _BRANCHES)
    names = sorted(cls.__name__ for cls in classes)
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} or {names[-1]}"
