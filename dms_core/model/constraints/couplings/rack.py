"""Rack and pinion: x = radius theta, both counted from the declared start."""

from __future__ import annotations

from typing import ClassVar, Self

from pydantic import Field, field_validator, model_validator

from dms_core.model.constraints.couplings.relation import Relation, Term


class Rack(Relation):
    """Pinion that turns in one joint and moves a rack along the axis of another by its radius times its angle."""

    kind: ClassVar[str] = "rack"
    pinion: str = Field(description="joint in which the pinion turns")
    rail: str = Field(description="slider or cylindrical joint along whose axis the rack moves")
    radius: float = Field(
        description="way of the rack with an angle of one radian [m]; negative where that is against the rail's axis_i"
    )

    @field_validator("radius")
    @classmethod
    def _moves(cls, radius: float) -> float:
        if radius == 0.0:
            raise ValueError("Expected a radius other than 0: with 0 the rack would never move")
        return radius

    @model_validator(mode="after")
    def _two_joints(self) -> Self:
        if self.pinion == self.rail:
            raise ValueError(f"pinion and rail are both '{self.rail}': expected two joints; use a screw for one")
        return self

    def terms(self) -> tuple[Term, ...]:
        """radius theta - x."""
        return Term(self.pinion, "angle", self.radius), Term(self.rail, "slide", -1.0)
