"""Flexible bodies (paper Fig. 3): beams of any rotation, bodies of given modes, and loads spread over them."""

from dms_core.model.flexible.beam import Beam
from dms_core.model.flexible.beam_element import BeamElement
from dms_core.model.flexible.beam_load import BeamLoad
from dms_core.model.flexible.craig_bampton import craig_bampton, orthogonal
from dms_core.model.flexible.distributed_load import DistributedLoad
from dms_core.model.flexible.floating_frame import FloatingFrame
from dms_core.model.flexible.interface_frame import InterfaceFrame
from dms_core.model.flexible.modal_body import Interface, ModalBody
from dms_core.model.flexible.modal_data import ModalData
from dms_core.model.flexible.modal_node import ModalNode
from dms_core.model.flexible.section import BeamSection

__all__ = [
    "Beam",
    "BeamElement",
    "BeamLoad",
    "BeamSection",
    "DistributedLoad",
    "FloatingFrame",
    "Interface",
    "InterfaceFrame",
    "ModalBody",
    "ModalData",
    "ModalNode",
    "craig_bampton",
    "orthogonal",
]
