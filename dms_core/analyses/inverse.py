"""Inverse dynamics: the loads of the drivers that make a system follow a recorded motion (paper Fig. 1).

    phi_q^T lam = f - M vdot,     load of a driver = -lam

along the positions, velocities and accelerations that the drivers prescribe (kinematic.py). What muscles, motors and
controllers do is unknown: elements with states of their own, and what pulls by such a state or by an input that such an
element drives, are left out, and so are those that are named. The load of the driver of a joint is then the net moment
that all of them together must give.

A recorded motion is filtered before it is differentiated twice: `cutoff` of its signal (kind: table or samples) is a
Butterworth low-pass of order 2, run forwards and backwards (`model/smoothing.py`), and interpolation 'quintic' gives
accelerations that are smooth.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from dms_core.analyses.kinematic import KinematicResult, driver_loads, kinematic
from dms_core.analyses.rest_equations import without
from dms_core.assembly.layout import GROUND_COORDINATES
from dms_core.assembly.model import Model
from dms_core.errors import InputError, ModelWarning, choices
from dms_core.model.constraints import AngleDriver, PositionDriver, Revolute, Slider
from dms_core.model.element import Constraint
from dms_core.model.geometry.angle import joint_angle
from dms_core.model.geometry.sensed_angle import sensed_angle
from dms_core.model.sensors import JointAngle
from dms_core.model.signals import AnySignal, Input, Samples
from dms_core.model.system import System
from dms_core.results import Trajectory

DRIVER, COURSE = "driver of ", "course of "
"""Begin the names of drivers that a recorded motion gets, and of their inputs."""


@dataclass(frozen=True)
class InverseResult:
    """A motion and what makes it."""

    model: Model
    """The driven model, without what was left out."""
    motion: KinematicResult
    loads: dict[str, np.ndarray]
    """Load of each driver [Nm or N], in the sense of its growing angle or position, by name of joint, sensor or driver,
    shape (n,) each."""
    left_out: tuple[str, ...]
    """Elements that these loads stand for."""

    @property
    def t(self) -> np.ndarray:
        """Times [s], shape (n,)."""
        return self.motion.t


def inverse_dynamics(
    system: System,
    times: np.ndarray,
    motion: Mapping[str, AnySignal] | None = None,
    *,
    leave_out: Sequence[str] = (),
    progress: Callable[[float], None] | None = None,
) -> InverseResult:
    """Loads of the drivers along a motion.

    Args:
        system: the declarations; drivers in it count as well.
        times: rising, from 0 on [s], shape (n,).
        motion: course of the angle of each joint_angle sensor or revolute joint [rad], or of each slider [m], by name.
        leave_out: force elements whose part the drivers take over, beside those with states of their own.
        progress: called with the time reached.

    Raises:
        InputError: a name of the motion is that of no joint or joint angle.
        ModelError: see `kinematic`.
        SimulationError: the mechanism cannot follow the motion.

    Example:
        >>> recorded = motion_of(trajectory, ["elbow_angle", "grip"], 0.005)
        >>> inverse_dynamics(system, recorded["elbow_angle"].rows()[0], recorded).loads["elbow_angle"]
    """
    names = tuple(dict.fromkeys([*_with_states(system), *leave_out]))
    bare = without(system, names)
    given = dict(motion or {})
    drivers = [_driver(bare, name) for name in given]
    inputs = [Input(name=f"{COURSE}{name}", signal=signal) for name, signal in given.items()]
    driven = System(
        bare.name, bodies=bare.bodies, constraints=[*bare.constraints, *drivers], forces=bare.forces,
        sensors=bare.sensors, inputs=[*bare.inputs, *inputs],
    )  # fmt: skip
    with warnings.catch_warnings():
        # Inputs of what was left out are read by nobody, and a recorded start may be far from the declared one.
        warnings.simplefilter("ignore", ModelWarning)
        model = Model(driven)
    result = kinematic(model, times, progress).check()
    loads = {name.removeprefix(DRIVER): load for name, load in driver_loads(model, result.states).items()}
    return InverseResult(model, result, loads, names)


def _with_states(system: System) -> list[str]:
    """Forces that own coordinates, and those that read such a coordinate or an input that one of these drives."""
    own = {f.name for f in system.forces if f.coordinates()}
    driven = {u for f in system.forces for u, _ in f.driven_inputs()}
    found = []
    for force in system.forces:
        places = force.placements(system)
        read = {c.rpartition(".")[0] for place in places for c in place.coordinates}
        if force.name in own or read & own or any(driven.intersection(place.inputs) for place in places):
            found.append(force.name)
    return found


def _driver(system: System, name: str) -> Constraint:
    """The driver of a joint, of a joint angle sensor, or of a slider.

    Raises:
        InputError: there is nothing of that name to be driven.
    """
    own, course = f"{DRIVER}{name}", f"{COURSE}{name}"
    element = next((e for e in (*system.constraints, *system.sensors) if e.name == name), None)
    if isinstance(element, JointAngle):
        pointers = {"pointer_i": element.pointer_i, "pointer_j": element.pointer_j}
        return AngleDriver(name=own, joint=element.joint, input=course, **pointers)
    if isinstance(element, Revolute):
        return AngleDriver(name=own, joint=name, input=course)
    if isinstance(element, Slider):
        point_j = element.point_j or tuple(system.start_point(element.body_i, element.point_i, element.body_j))
        return PositionDriver(
            name=own, body_i=element.body_i, body_j=element.body_j, axis_i=element.axis_i, point_i=element.point_i,
            point_j=point_j, input=course,
        )  # fmt: skip
    there = [e.name for e in (*system.constraints, *system.sensors) if isinstance(e, JointAngle | Revolute | Slider)]
    raise InputError(
        f"motion: '{name}' is no revolute joint, slider or joint_angle sensor. There are: {choices(there)}."
    )


def motion_of(
    trajectory: Trajectory, names: Sequence[str], sample: float, cutoff: float | None = None
) -> dict[str, Samples]:
    """Angles of a run as they would be recorded, by name of revolute joints or joint_angle sensors.

    Args:
        trajectory: a run.
        names: joints or sensors whose angle is taken.
        sample: time between samples [s].
        cutoff: of the filter [Hz]; default: none.

    Raises:
        InputError: there is no such joint or sensor.
    """
    states, found = trajectory.at(trajectory.grid(sample)), {}
    for name in names:
        angle = np.unwrap(_angle(trajectory.model, name, states.q))
        found[name] = Samples(times=tuple(states.t), values=tuple(angle), interpolation="quintic", cutoff=cutoff)
    return found


def _angle(model: Model, name: str, q: np.ndarray) -> np.ndarray:
    """Angle of a revolute joint, or of the joint of a sensor, at positions of shape (n, n_q)."""
    system, layout = model.system, model.layout
    element = next((e for e in (*system.constraints, *system.sensors) if e.name == name), None)
    if isinstance(element, JointAngle):
        bodies, frame = sensed_angle(system, f"sensor '{name}'", element.joint, element.pointer_i, element.pointer_j)
    elif isinstance(element, Revolute):
        bodies, frame = sensed_angle(system, f"joint '{name}'", name, None, None)
    else:
        there = [e.name for e in (*system.constraints, *system.sensors) if isinstance(e, JointAngle | Revolute)]
        raise InputError(f"'{name}' is no revolute joint or joint_angle sensor. There are: {choices(there)}.")
    f, g, h = (tuple(frame[k : k + 3]) for k in (0, 3, 6))
    at = np.concatenate([layout.body_indices(body) for body in bodies])
    whole = np.concatenate([q, np.tile(GROUND_COORDINATES, (len(q), 1))], axis=1)[:, at]
    return np.array([joint_angle(0, 7, f, g, h, row) for row in np.ascontiguousarray(whole)])
