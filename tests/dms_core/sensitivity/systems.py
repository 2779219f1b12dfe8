"""Mechanisms whose steps and runs are differentiated, each away from its kinks."""

from __future__ import annotations

import math

from dms_core import Model
from dms_core.model import (
    Constant,
    Gravity,
    Input,
    JointAngle,
    JointMotor,
    LumpedLoad,
    MinimumJerk,
    System,
)
from exo_env.ecosystem.arm import Arm
from exo_env.ecosystem.ecosystem import Ecosystem
from tests.dms_core.analyses.mechanisms import double_pendulum, four_bar, slider_crank
from tests.dms_core.model.control.test_pid_loop import _tracking_system
from tests.dms_core.model.flexible.test_modal_body import clamped


def pendulum() -> Model:
    """Two rods, a motor between them and a load at the tip."""
    motor = JointMotor(name="motor", joint="elbow", input="moment")
    push = LumpedLoad(name="push", body="lower", point=(1.0, 0.0, 0.0), force=(1.0, 2.0, 0.0), input="size")
    inputs = (Input(name="moment", signal=Constant(value=0.4)), Input(name="size", signal=Constant(value=1.5)))
    return Model(double_pendulum(1.0, (0.4, -0.9), forces=(motor, push), inputs=inputs))


def crank_and_rocker() -> Model:
    """A four-bar linkage under its weight, driven by a moment."""
    push = LumpedLoad(name="push", body="coupler", point=(0.2, 0.1, 0.0), force=(1.0, 2.0, 0.0), input="size")
    inputs = (Input(name="size", signal=Constant(value=3.0)),)
    return Model(four_bar((1.0, 3.0, 2.5, 3.2), None, forces=(push,), inputs=inputs))


def free_slider_crank() -> Model:
    """A slider-crank without its driver, which falls."""
    driven = slider_crank(0.5, 1.2, Constant(value=0.0))
    push = LumpedLoad(name="push", body="piston", force=(1.0, 0.0, 0.0), input="size")
    return Model(System(
        "slider-crank", bodies=driven.bodies, constraints=[c for c in driven.constraints if c.name != "motor"],
        forces=[Gravity(name="weight", acceleration=(0.3, -9.81, 0.0)), push],
        sensors=[JointAngle(name="swing", joint="pin")],
        inputs=[Input(name="size", signal=Constant(value=2.0))],
    ))  # fmt: skip


def driven_crank() -> Model:
    """A four-bar linkage whose crank angle is an input."""
    return Model(four_bar((1.0, 3.0, 2.5, 3.2), Constant(value=1.0)))


def arm() -> Model:
    """The arm with six muscles, whose activations rise, in the exoskeleton with its ropes and its PID."""
    start, end = math.radians(40.0), math.radians(60.0)
    return Model(Ecosystem().system(
        start, MinimumJerk(times=(0.0, 0.4), values=(start, end)), {m: Constant(value=0.4) for m in Arm().muscles},
        device_inputs=[Input(name="assistance", signal=Constant(value=0.9))],
    ))  # fmt: skip


def controlled() -> Model:
    """A pendulum on two ropes whose PID follows a course."""
    return Model(_tracking_system(0.5))


def flexible() -> Model:
    """A clamped bar of four modes under its weight."""
    return clamped(Gravity(name="weight", acceleration=(0.0, -9.81, 0.0)))


SYSTEMS = {f.__name__: f for f in (pendulum, crank_and_rocker, free_slider_crank, arm, controlled, flexible)}
