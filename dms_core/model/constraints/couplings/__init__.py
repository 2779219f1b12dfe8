"""Couplings: relations between joint coordinates, and between a drum and its rope."""

from dms_core.model.constraints.couplings.belt import Belt
from dms_core.model.constraints.couplings.drum_rope import DrumRope
from dms_core.model.constraints.couplings.gear import Gear
from dms_core.model.constraints.couplings.linear_coupling import JointTerm, LinearCoupling
from dms_core.model.constraints.couplings.rack import Rack

__all__ = ["Belt", "DrumRope", "Gear", "JointTerm", "LinearCoupling", "Rack"]
