"""How far policies hold out away from where they were trained: shifts of one kind each, in several sizes.

The first size of each shift is none: patients, loads, sensors and fit of the device are those of the plan. All sizes
are assumed; the largest are beyond what a device that is put on with care has, so that a curve shows where a policy
gives in. A fault of a sensor reaches the policies that read this sensor; to the others it is the same episode again.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from exo_env.ecosystem.cuff import DAMPING, STIFFNESS
from exo_env.patient.between import between
from exo_env.patient.population import Population
from exo_env.tasks.elbow import action_channel
from exo_env.tasks.observation.channels import Imperfection
from exo_env.tasks.observation.electrodes import Electrodes

from ...environment import make
from ...policies.policy import Policy
from ..comparison.evaluate import Plan
from ..comparison.opponents import sensors

EVALUATION, SHIFTED = 0.25, 1.0
"""How far the means of the populations `evaluation` and `shifted` are from those of `mixed` [standard deviations]."""


@dataclass(frozen=True)
class Shift:
    """A kind of shift."""

    label: str
    """Its size in words, with the unit."""
    sizes: tuple[float, ...]
    """From none on."""
    changed: Callable[[Plan, Policy, float], Plan]
    """The plan of a policy under the shift of a size."""

    def plan(self, plan: Plan, policy: Policy, size: float) -> Plan:
        """The plan of a policy; the same where the shift is none."""
        return plan if size == self.sizes[0] else self.changed(plan, policy, size)


def _with(plan: Plan, **settings: Any) -> Plan:
    """A plan with further settings of the environment."""
    return dataclasses.replace(plan, settings={**plan.settings, **settings})


def _offset(plan: Plan, policy: Policy, millimetres: float) -> Plan:
    """The hinge lies in front of the elbow and as far below it."""
    part = 1e-3 * millimetres / math.sqrt(2.0)
    return _with(plan, misalignment={"shift": [part, -part, 0.0]})


def _tilt(plan: Plan, policy: Policy, degrees: float) -> Plan:
    """The hinge's axis is turned about the link's x axis."""
    return _with(plan, misalignment={"tilt_deg": [degrees, 0.0]})


def _cuff(plan: Plan, policy: Policy, times: float) -> Plan:
    """A compliant cuff in place of the rigid guide, some times as compliant as a measured one."""
    stiffness, damping = [x / times for x in STIFFNESS], [x / math.sqrt(times) for x in DAMPING]
    return _with(plan, cuff={"stiffness": stiffness, "damping": damping})


def _noise(plan: Plan, policy: Policy, factor: float) -> Plan:
    """White noise and quanta are larger."""
    return _faulty(plan, policy, lambda i, scale: i.changed(deviation=factor * i.deviation, quantum=factor * i.quantum))


def _delay(plan: Plan, policy: Policy, milliseconds: float) -> Plan:
    """Sensors are later."""
    return _faulty(plan, policy, lambda i, scale: i.changed(delay=i.delay + 1e-3 * milliseconds))


def _bias(plan: Plan, policy: Policy, part: float) -> Plan:
    """Sensors show too much, by a part of the scale of their channel."""
    return _faulty(plan, policy, lambda i, scale: i.changed(bias=i.bias + part * scale))


def _faulty(plan: Plan, policy: Policy, change: Callable[[Imperfection, float], Imperfection]) -> Plan:
    """Changed imperfections of what sensors show the policy, or the filter whose estimates it is shown.

    Neither its own action nor what no sensor measures is changed.

    Args:
        plan: of the policy.
        policy: whose observation counts.
        change: new imperfection of a channel, from its own and its scale [unit of the channel].
    """
    world: Any = make(plan.environment, action_mode=policy.action_mode, observation=list(policy.observation)).unwrapped
    shown = {
        name: (channel.imperfection, channel.scale)
        for name, channel in world.observer.measured.items()
        if name.partition(".")[0] not in world.task.revealing and channel.name != action_channel().name
    }
    changed = {name: (change(one, scale), one) for name, (one, scale) in shown.items()}
    noise = {name: new.model_dump() for name, (new, one) in changed.items() if new != one}
    return _with(plan, noise=noise) if noise else plan


def _electrodes(plan: Plan, policy: Policy, factor: float) -> Plan:
    """Gains spread more, more crosstalk, more channels that drop out."""
    if "emg" not in sensors(policy.observation):
        return plan
    return _with(plan, electrodes={name: factor * value for name, value in Electrodes().model_dump().items()})


def _patients(plan: Plan, policy: Policy, deviations: float) -> Plan:
    """Patients of `evaluation`, of `shifted`, and of populations between the two."""
    near, far = (Population.shipped(name) for name in ("evaluation", "shifted"))
    part = (deviations - EVALUATION) / (SHIFTED - EVALUATION)
    return dataclasses.replace(plan, population=between(near, far, part))


def _load(plan: Plan, policy: Policy, kilograms: float) -> Plan:
    """Everybody begins with the same load."""
    return dataclasses.replace(plan, loads=(kilograms,))


SHIFTS: Mapping[str, Shift] = {
    "hinge_offset": Shift("distance of the hinge from the elbow [mm]", (0.0, 10.0, 20.0, 30.0, 40.0), _offset),
    "hinge_tilt": Shift("tilt of the hinge's axis [deg]", (0.0, 5.0, 10.0, 15.0, 20.0), _tilt),
    "cuff": Shift("compliance of the cuff, over a measured one; 0: rigid [-]", (0.0, 0.5, 1.0, 2.0, 4.0), _cuff),
    "sensor_noise": Shift("noise of the sensors, over that of training [-]", (1.0, 2.0, 4.0, 8.0, 16.0), _noise),
    "sensor_delay": Shift("delay of the sensors beyond training [ms]", (0.0, 20.0, 40.0, 80.0, 160.0), _delay),
    "sensor_bias": Shift("bias of the sensors, over their scales [-]", (0.0, 0.025, 0.05, 0.1, 0.2), _bias),
    "electrode_faults": Shift(
        "faults of the electrodes, over those of training [-]", (1.0, 1.5, 2.0, 3.0), _electrodes
    ),
    "patients": Shift("patients' traits beyond training [standard deviations]", (0.0, 0.25, 0.5, 0.75, 1.0), _patients),
    "load": Shift("load [kg], first as in training (1.25 kg in the mean)", (1.25, 2.0, 3.0, 4.0, 5.0), _load),
}
"""All shifts, by name. Loads of training are drawn from 0.5 to 2 kg."""
