"""Contacts between bodies, with restitution and friction (law.py), and where they touch (shapes.py)."""

from dms_core.model.contact.cylinder import CylinderContact
from dms_core.model.contact.cylinder_pair import CylinderPairContact
from dms_core.model.contact.sphere import SphereContact
from dms_core.model.contact.sphere_cylinder import SphereCylinderContact
from dms_core.model.contact.sphere_pair import SpherePairContact

__all__ = ["CylinderContact", "CylinderPairContact", "SphereContact", "SphereCylinderContact", "SpherePairContact"]
