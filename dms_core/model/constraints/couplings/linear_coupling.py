"""Any linear relation between joint coordinates, such as that of a differential, sum_k c_k (x_k - x_k(0)) = 0."""

from __future__ import annotations

from typing import ClassVar, Literal

from pydantic import Field, field_validator

from dms_core.errors import DmsError, ModelError
from dms_core.model.constraints.couplings.relation import Relation, Term
from dms_core.validation import Checked


class JointTerm(Checked):
    """One joint coordinate times a factor."""

    wrong: ClassVar[type[DmsError]] = ModelError
    joint: str = Field(description="joint whose coordinate it is")
    coordinate: Literal["angle", "slide"] = Field(
        default="angle", description="turn about the joint's axis [rad], or way along it [m]"
    )
    factor: float = Field(description="c, not 0 [unit of the sum per rad or m]")

    @field_validator("factor")
    @classmethod
    def _counts(cls, factor: float) -> float:
        if factor == 0.0:
            raise ValueError("Expected a factor other than 0; leave out a coordinate that does not count")
        return factor


class LinearCoupling(Relation):
    """The sum of joint coordinates times factors keeps the value that it has at the declared start."""

    kind: ClassVar[str] = "linear_coupling"
    coordinates: tuple[JointTerm, ...] = Field(min_length=2, description="the coupled coordinates")

    @field_validator("coordinates")
    @classmethod
    def _once(cls, given: tuple[JointTerm, ...]) -> tuple[JointTerm, ...]:
        names = [(t.joint, t.coordinate) for t in given]
        twice = [name for name in names if names.count(name) > 1]
        if twice:
            joint, coordinate = twice[0]
            raise ValueError(f"the {coordinate} of '{joint}' is named twice; name each coordinate once")
        return given

    def terms(self) -> tuple[Term, ...]:
        """As given."""
        return tuple(Term(t.joint, t.coordinate, t.factor) for t in self.coordinates)
