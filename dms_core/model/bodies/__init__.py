"""Bodies (paper sect. 3.1): what owns coordinates and inertia."""

from dms_core.model.bodies.point_mass import PointMass
from dms_core.model.bodies.rigid_body import RigidBody

__all__ = ["PointMass", "RigidBody"]
