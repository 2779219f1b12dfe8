"""Flexible bodies (paper Fig. 3): beams of any rotation, bodies of given modes, and loads spread over them."""

from dms_core.model.flexible.beams.beam import Beam
from dms_core.model.flexible.beams.beam_element import BeamElement
from dms_core.model.flexible.beams.beam_load import BeamLoad
from dms_core.model.flexible.beams.section import BeamSection
from dms_core.model.flexible.distributed_load import DistributedLoad
from dms_core.model.flexible.modal.craig_bampton import craig_bampton, orthogonal
from dms_core.model.flexible.modal.floating_frame import FloatingFrame
from dms_core.model.flexible.modal.interface_frame import InterfaceFrame
from dms_core.model.flexible.modal.load_distribution import LoadDistribution
from dms_core.model.flexible.modal.modal_body import Interface, ModalBody
from dms_core.model.flexible.modal.modal_data import ModalData
from dms_core.model.flexible.modal.modal_node import ModalNode

__all__ = [
    "Beam",
    "BeamElement",
    "BeamLoad",
    "BeamSection",
    "DistributedLoad",
    "FloatingFrame",
    "Interface",
    "InterfaceFrame",
    "LoadDistribution",
    "ModalBody",
    "ModalData",
    "ModalNode",
    "craig_bampton",
    "orthogonal",
]
