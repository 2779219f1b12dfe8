"""Ropes (paper sect. 3.3): paths through points of bodies, and the tension along them."""

from dms_core.model.geometry.path import PathPoint
from dms_core.model.ropes.elastic_rope import ElasticRope
from dms_core.model.ropes.rope_force import RopeForce
from dms_core.model.ropes.winch import Winch

__all__ = ["ElasticRope", "PathPoint", "RopeForce", "Winch"]
