"""Forces (paper sect. 3.1): loads, springs, dampers, and differential equations of their own."""

from dms_core.model.forces.first_order import FirstOrder
from dms_core.model.forces.gravity import Gravity
from dms_core.model.forces.joint_spring_damper import JointSpringDamper
from dms_core.model.forces.joint_stop import JointStop
from dms_core.model.forces.lumped_load import LumpedLoad
from dms_core.model.forces.second_order import SecondOrder
from dms_core.model.forces.spring_damper import SpringDamper

__all__ = ["FirstOrder", "Gravity", "JointSpringDamper", "JointStop", "LumpedLoad", "SecondOrder", "SpringDamper"]
