"""A pair of gear wheels: theta_j = ratio theta_i, both counted from the declared start."""

from __future__ import annotations

from typing import ClassVar, Self

from pydantic import Field, field_validator, model_validator

from dms_core.model.constraints.couplings.relation import Relation, Term


class Gear(Relation):
    """Gear wheels that turn in joint_i and joint_j; on a planet carrier both joints are against the carrier.

    Wheels with outer teeth and parallel axes turn against each other: their ratio is -z_i / z_j of the numbers of
    teeth. A wheel in a ring with inner teeth turns the same way: z_i / z_j.
    """

    kind: ClassVar[str] = "gear"
    joint_i: str = Field(description="joint in which the first wheel turns")
    joint_j: str = Field(description="joint in which the second wheel turns")
    ratio: float = Field(description="turns in joint_j with one turn in joint_i [-]; negative where senses differ")

    @field_validator("ratio")
    @classmethod
    def _drives(cls, ratio: float) -> float:
        if ratio == 0.0:
            raise ValueError("Expected a ratio other than 0: with 0 the second wheel would never turn")
        return ratio

    @model_validator(mode="after")
    def _two_joints(self) -> Self:
        if self.joint_i == self.joint_j:
            raise ValueError(f"joint_i and joint_j are both '{self.joint_i}': expected two different joints")
        return self

    def terms(self) -> tuple[Term, ...]:
        """ratio theta_i - theta_j."""
        return Term(self.joint_i, "angle", self.ratio), Term(self.joint_j, "angle", -1.0)
