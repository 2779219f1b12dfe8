"""A belt that runs over two pulleys without slip: r_i theta_i = r_j theta_j, with the other sign for a crossed belt."""

from __future__ import annotations

from typing import ClassVar, Self

from pydantic import Field, model_validator

from dms_core.model.constraints.couplings.relation import Relation, Term


class Belt(Relation):
    """Massless, inextensible belt over two pulleys whose axes are parallel and point the same way.

    Its multiplier is the difference of the tensions in both strands [N].
    """

    kind: ClassVar[str] = "belt"
    joint_i: str = Field(description="joint in which the first pulley turns")
    joint_j: str = Field(description="joint in which the second pulley turns")
    radius_i: float = Field(gt=0.0, description="radius of the first pulley [m]")
    radius_j: float = Field(gt=0.0, description="radius of the second pulley [m]")
    crossed: bool = Field(default=False, description="whether the strands cross, so that the pulleys turn oppositely")

    @model_validator(mode="after")
    def _two_joints(self) -> Self:
        if self.joint_i == self.joint_j:
            raise ValueError(f"joint_i and joint_j are both '{self.joint_i}': expected two different joints")
        return self

    def terms(self) -> tuple[Term, ...]:
        """r_i theta_i -+ r_j theta_j."""
        way = self.radius_j if self.crossed else -self.radius_j
        return Term(self.joint_i, "angle", self.radius_i), Term(self.joint_j, "angle", way)
