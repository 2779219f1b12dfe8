"""Flexible bodies (paper Fig. 3): beams of any rotation, bodies of given modes, and loads spread over them."""

from dms_core.model.flexible.beam import Beam
from dms_core.model.flexible.beam_element import BeamElement
from dms_core.model.flexible.beam_load import BeamLoad
from dms_core.model.flexible.distributed_load import DistributedLoad
from dms_core.model.flexible.section import BeamSection

__all__ = ["Beam", "BeamElement", "BeamLoad", "BeamSection", "DistributedLoad"]
