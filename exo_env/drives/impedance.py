"""The device is compliant: an action sets stiffness, damping and the share of gravity of a law inside the equations.

    M = K (theta_0 - theta) - D thetadot + s M_g(theta),    T_0 thetadot_0 + theta_0 - theta = 0

    K = (a_0 + 1) / 2 max_stiffness      D = (a_1 + 1) / 2 max_damping      s = (a_2 + 1) / 2 max_gravity_share

theta is the angle of the device's hinge. The agonist pulls M / r where M flexes, the antagonist where it extends, by
the moment arms at the present angle (dms_core/model/control/impedance.py), and the motors follow with their lag. The
law acts at all times within a control period; an action only changes its three numbers, linearly over the period and
with a largest rate, so that nothing jumps.

The spring has no angle to hold, for the device knows no reference. If its zero were set to the measured angle at each
control time, every 0.02 s, it would hardly ever be apart from the arm: such a spring is a damper of 0.01 s times K
whose moment jumps 50 times a second. Here the zero follows the angle with the time constant T_0 (`relaxation_time`), as
in a spring and a damper in series (Maxwell). What is quicker than T_0 meets the spring: tremor of 4 Hz and more, a
push, a load that drops. What is slower meets a damper of K T_0, and patients move where they like. The default of 0.1
s, a corner at 1.6 Hz, lies between tremor and voluntary movement: 60 deg in 1.5 s meet 2 Nm at their quickest where K
is half of the default's largest. T_0 of half a control period is that reset without its jumps, and T_0 of an hour a
spring about the angle of the start.

M_g is the moment that holds the arm of an average person (the default `Person`) and the lower link of the device, since
the device does not know the patient. A share above 1 carries load too.

At the start stiffness and damping are none, and the share is what lets the agonist hold what the muscles do not, as
far as `max_gravity_share` goes. Of several ropes that pull the same way the first one is used, the others are slack;
without a rope that lowers the law only flexes.
"""

from __future__ import annotations

import math
from functools import cache
from typing import Any, ClassVar

import numpy as np
from pydantic import Field

from dms_core.model import ImpedanceController, RopeActuator
from dms_core.model.element import Force
from exo_env.drives.drive import Command, affine
from exo_env.drives.rope_motors import RopeMotors
from exo_env.ecosystem.arm import Arm
from exo_env.ecosystem.ecosystem import ASSISTANCE, REFERENCE
from exo_env.ecosystem.exoskeleton import LEAST_LEVERAGE, Exoskeleton
from exo_env.ecosystem.worn_exoskeleton import HINGE, WornExoskeleton, motor_name

LAW = "impedance"
STIFFNESS, DAMPING, SHARE = "stiffness", "damping", "gravity_share"


class Impedance(RopeMotors):
    """Drive of action mode 'impedance': stiffness, damping and gravity share of a compliant law."""

    kernel: ClassVar[Any] = affine
    rtol: ClassVar[float] = 0.01
    """Over an episode of rough actions the elbow of 40 patients stayed within 0.3e-3 rad of the run at 1e-6 in half of
    them, within 1.0e-3 in nine of ten; 0.02 gives 0.4e-3 and 1.0e-3, 0.7e-3 and 1.5e-3 on another population, and is
    only a fifteenth faster."""
    max_stiffness: float = Field(
        default=30.0, gt=0.0, le=1000.0,
        description="largest K [Nm/rad]; assumed: 0.5 rad away it asks for all that the ropes can give, and times the "
        "motors' lag it is below the friction of the default hinge, 1 N m s/rad, so that it needs no damping beside",
    )  # fmt: skip
    max_damping: float = Field(
        default=3.0, gt=0.0, le=100.0, description="largest D [N m s/rad]; assumed: three times the hinge's friction"
    )
    max_gravity_share: float = Field(
        default=4.0, gt=0.0, le=100.0, description="largest s [-]; assumed: 3.7 hold 2 kg in a limp arm"
    )
    relaxation_time: float = Field(
        default=0.1, ge=0.001, le=1e4, description="T_0 with which the spring's zero follows the angle [s]; assumed"
    )
    change_rate: float = Field(
        default=10.0, gt=0.0, description="largest change of each number, in parts of its largest value [1/s]; assumed"
    )

    def actions(self, device: Exoskeleton) -> tuple[str, ...]:
        """Stiffness, damping and gravity share.

        Raises:
            InputError: there are not as many largest tensions as the device has ropes.
        """
        self.largest(device)
        return "stiffness", "damping", "gravity share"

    def commands(self, device: Exoskeleton) -> tuple[Command, ...]:
        """Stiffness, damping and share; the first two begin with none, and the share holds the arm."""
        # With all at 0 in the template model too, no order of elimination relies on numbers that an action may take.
        return (
            Command(STIFFNESS, self.change_rate * self.max_stiffness),
            Command(DAMPING, self.change_rate * self.max_damping),
            Command(
                SHARE, self.change_rate * self.max_gravity_share, holds=self.max_gravity_share,
                carries=carried(device), motor=motor_name(device.lifting_rope),
            ),
        )  # fmt: skip

    def numbers(self, device: Exoskeleton) -> np.ndarray:
        """Offset and gain to stiffness, damping and share, shape (3, 2)."""
        largest = (self.max_stiffness, self.max_damping, self.max_gravity_share)
        return np.array([[0.5 * most, 0.5 * most] for most in largest])

    def forces(self, worn: WornExoskeleton, start: np.ndarray) -> list[Force]:
        """The device with the law in place of its PID, and motors that follow it."""
        device = worn.device
        by_cos, by_sin = carried(device)
        pulling = tuple(name for name in (device.lifting_rope, device.lowering_rope) if name is not None)
        law = ImpedanceController(
            name=LAW, joint=HINGE, ropes=pulling, stiffness=STIFFNESS, damping=DAMPING, share=SHARE,
            relaxation_time=self.relaxation_time, carried_cos=by_cos, carried_sin=by_sin,
            least_leverage=LEAST_LEVERAGE,
        )  # fmt: skip
        own: dict[str, Force] = {motor_name(rope): self._motor(rope, device) for rope in pulling}
        slack = [rope for rope in device.ropes if rope not in pulling]
        forces = [f for f in worn.forces(REFERENCE, ASSISTANCE) if f.name not in map(motor_name, slack)]
        own |= {f.name: f.model_copy(update={"coordinate": None, "tension": 0.0}) for f in forces if f.name in slack}
        return [law, *(own.get(f.name, f) for f in forces)]

    def _motor(self, rope: str, device: Exoskeleton) -> RopeActuator:
        """A motor that follows the law."""
        return RopeActuator(
            name=motor_name(rope), rate_of=f"{LAW}.{rope}_impulse", time_constant=self.time_constant,
            max_tension=self.largest(device)[rope], start_tension=0.0,
        )  # fmt: skip


def carried(device: Exoskeleton) -> tuple[float, float]:
    """m_c and m_s [Nm] of M_g = m_c cos(theta) + m_s sin(theta), of an average person's arm and the device's link."""
    by_cos, by_sin, g = _average_arm()
    return by_cos + device.own_moment(0.0, g), by_sin + device.own_moment(0.5 * math.pi, g)


@cache
def _average_arm() -> tuple[float, float, float]:
    """m_c and m_s of an average person's arm [Nm], and gravity [m/s^2]."""
    arm = Arm()
    return -arm.gravity_moment(0.0), -arm.gravity_moment(0.5 * math.pi), float(np.linalg.norm(arm.gravity))
