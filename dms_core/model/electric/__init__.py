"""Electromechanics (paper sect. 3.1): drives with states of their own."""

from dms_core.model.electric.dc_motor import DcMotor

__all__ = ["DcMotor"]
