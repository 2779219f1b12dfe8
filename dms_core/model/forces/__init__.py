"""Forces (paper sect. 3.1): loads, springs, dampers, and differential equations of their own."""

from dms_core.model.forces.bushing import Bushing, BushingCurves
from dms_core.model.forces.bushing_load import BushingLoad
from dms_core.model.forces.first_order import FirstOrder
from dms_core.model.forces.gravity import Gravity
from dms_core.model.forces.joint.joint_motor import JointMotor
from dms_core.model.forces.joint.joint_spring_damper import JointSpringDamper
from dms_core.model.forces.joint.joint_stop import JointStop
from dms_core.model.forces.joint.torsion_spring import TorsionSpring
from dms_core.model.forces.joint.turn_counter import TurnCounter
from dms_core.model.forces.load_curve import LoadCurve
from dms_core.model.forces.lumped_load import LumpedLoad
from dms_core.model.forces.second_order import SecondOrder
from dms_core.model.forces.spring_damper import SpringDamper

__all__ = [
    "Bushing",
    "BushingCurves",
    "BushingLoad",
    "FirstOrder",
    "Gravity",
    "JointMotor",
    "JointSpringDamper",
    "JointStop",
    "LoadCurve",
    "LumpedLoad",
    "SecondOrder",
    "SpringDamper",
    "TorsionSpring",
    "TurnCounter",
]
