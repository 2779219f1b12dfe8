"""A moment about the device's hinge and a co-tension are commanded: the device's moment arms make tensions of them.

    M = a_0 max_moment                      wanted moment [Nm], positive where it flexes; an action of 0 is none
    c = (a_1 + 1) / 2 max_co_tension        co-tension [N]; an action of -1 is none

With the moment arms r_f of the rope that lifts and r_e of the rope that lowers, both counted positive [m],

    tau_f = P(M) / r_f + 2 c r_e / (r_f + r_e)          P(x) = max(x, 0)
    tau_e = P(-M) / r_e + 2 c r_f / (r_f + r_e)

so that the moment of both is M, and the co-tension, the mean of what it adds to both, gives no moment of its own. No
command leaves 0 to its rope's `max_tension`. The moment comes first: where it needs more than that the rope pulls with
its largest tension, and the co-tension is as large as both ropes have room for, so that it never costs a moment.

The moment arms are those at the hinge angle which the device measures at the control time. They are the device's own,
known from where its ropes are tied, so nothing of the patient is needed. The encoder's step of 1.5e-3 rad would change
them by less than 2e-3 of themselves and is left out. Over the period that follows the arm moves on, and the commands
go to their new values with the largest rate and the lag of the motors (rope_motors.py): the moment is what was asked
for once arm and commands rest.

A device without a rope that lowers gives neither a moment below 0 nor a co-tension: gravity alone extends the elbow.
Of several ropes that pull the same way the first one is used (`Exoskeleton.lifting_rope`, `lowering_rope`); the others
stay slack.
"""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
from pydantic import Field

from dms_core.compiled.jit import compiled
from dms_core.kernels import floats, inner, matrix
from exo_env.drives.drive import measured_hinge
from exo_env.drives.rope_motors import CommandedTensions
from exo_env.ecosystem.exoskeleton import LEAST_LEVERAGE, Exoskeleton, rope_lever
from exo_env.places import places
from exo_env.tables import DRIVE, WORLD

LARGEST = places(("moment", "co_tension"))
"""Places in the first row of the drive's numbers: the largest moment [Nm] and co-tension [N]."""
PULLS = places(("command", "sign", "tension", "upper"))
"""Places in the rows of both ropes: number of the command, or -1 where there is no such rope; +1 for a rope that
flexes, -1 for one that extends; largest tension [N]; three coordinates of each end [m], from `upper` on."""


@compiled
def leverage(rope, angle):
    """Moment arm of a rope, counted positive the way it pulls, at a hinge angle [rad] [m].

    Beyond the exercise a rope may lose its leverage; what a tension is divided by then stays LEAST_LEVERAGE.
    """
    if rope[PULLS.command] < 0.0:
        return LEAST_LEVERAGE
    lower = PULLS.upper + 3
    return max(rope[PULLS.sign] * rope_lever(rope[PULLS.upper : lower], rope[lower:], angle), LEAST_LEVERAGE)


@compiled
def shared_tensions(moment, co_tension, flexing, extending, most_flexing, most_extending):
    """Tensions of the ropes that flex and that extend [N].

    Args:
        moment: wanted moment, positive where it flexes [Nm].
        co_tension: mean tension beside that [N].
        flexing: moment arm of the rope that flexes, above 0 [m].
        extending: that of the rope that extends, above 0 [m].
        most_flexing: largest tension of the rope that flexes [N].
        most_extending: that of the rope that extends [N]; 0 where there is none.
    """
    flexor = min(max(moment, 0.0) / flexing, most_flexing)
    extensor = min(max(-moment, 0.0) / extending, most_extending)
    both = 2.0 * co_tension / (flexing + extending)
    # Times the other rope's moment arm it is what each rope gets more: as much as both have room for.
    both = min(both, (most_flexing - flexor) / extending, (most_extending - extensor) / flexing)
    return min(flexor + both * extending, most_flexing), min(extensor + both * flexing, most_extending)


@compiled
def moment_tensions(w):
    """Tension of each rope from the wanted moment and co-tension, at the measured hinge angle."""
    drive = inner(w, WORLD.drive)
    action, wanted, x = floats(drive, DRIVE.action), floats(drive, DRIVE.wanted), matrix(drive, DRIVE.numbers)
    largest, flexor, extensor, angle = x[0], x[1], x[2], measured_hinge(w)
    tensions = shared_tensions(
        largest[LARGEST.moment] * action[0], 0.5 * largest[LARGEST.co_tension] * (1.0 + action[1]),
        leverage(flexor, angle), leverage(extensor, angle), flexor[PULLS.tension], extensor[PULLS.tension],
    )  # fmt: skip
    wanted[int(flexor[PULLS.command])] = tensions[0]
    if extensor[PULLS.command] >= 0.0:
        wanted[int(extensor[PULLS.command])] = tensions[1]


class AssistMoment(CommandedTensions):
    """Drive of action mode 'assist_moment': the moment that the device is to give, and a co-tension."""

    kernel: ClassVar[Any] = moment_tensions
    rtol: ClassVar[float] = 0.01
    """Over an episode of rough actions the elbow of 40 patients stayed within 0.3e-3 rad of the run at 1e-6 in half of
    them, within 2.8e-3 in nine of ten, as with rope tensions (0.3e-3, 3.3e-3); twice that with 0.02."""
    max_moment: float = Field(
        default=15.0, gt=0.0, le=200.0,
        description="largest moment [Nm]; assumed: the default device's agonist gives it with 200 N from 68 deg of "
        "flexion on, and what it can below: 8.6 Nm at 20 deg, 11.9 at 40; its antagonist gives 5.2 to 8.0 with 100 N",
    )  # fmt: skip
    max_co_tension: float = Field(
        default=40.0, gt=0.0, le=1500.0,
        description="largest mean tension of both ropes beside the moment [N]; assumed: it leaves the agonist three "
        "quarters of its 200 N",
    )  # fmt: skip

    def actions(self, device: Exoskeleton) -> tuple[str, ...]:
        """Moment and co-tension."""
        return "moment", "co-tension"

    def numbers(self, device: Exoskeleton) -> np.ndarray:
        """Largest moment and co-tension, then the ropes that lift and lower, shape (3, 9); see LARGEST and PULLS."""
        largest, found = self.largest(device), np.zeros((3, 9))
        found[0, LARGEST.moment], found[0, LARGEST.co_tension] = self.max_moment, self.max_co_tension
        for row, name in enumerate((device.lifting_rope, device.lowering_rope), 1):
            found[row, PULLS.command] = -1.0
            if name is not None:
                rope = device.ropes[name]
                found[row] = [list(largest).index(name), rope.sign, largest[name], *rope.upper, *rope.lower]
        return found

    def action_of(self, moment: Any, co_tension: Any = 0.0) -> np.ndarray:
        """The action that asks for a moment and a co-tension; what is out of reach becomes the nearest in reach.

        Args:
            moment: wanted moment, positive where it flexes [Nm], a number or an array.
            co_tension: mean tension of both ropes beside that [N], of a shape that fits.

        Returns:
            Actions, shape (*shape of both, 2). A moment that is not finite stays so, and `step` refuses it.

        Example:
            >>> AssistMoment().action_of([0.0, 7.5])
            array([[ 0. , -1. ],
                   [ 0.5, -1. ]])
        """
        parts = np.divide(moment, self.max_moment), 2.0 * np.divide(co_tension, self.max_co_tension) - 1.0
        return np.clip(np.stack(np.broadcast_arrays(*parts), axis=-1), -1.0, 1.0)
