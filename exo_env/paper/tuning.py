"""Ziegler-Nichols tuning of the rope controllers on our model (paper sect. 3.5, Figs. 6 and 7).

The device is worn by a passive arm (all activations at their minimum) with an empty hand, at 60 degrees, held at rest
by its agonist rope. The reference jumps by 9 degrees at the start. With a weight in the hand the critical gain would
throw the forearm faster than the weight can fall, and the gym rope, which holds both ways in the equations, would
push; and the motors' limit is left out, as an oscillation against a limit measures the limit.

What limits the gain is the motors' lag T: for a forearm with device of inertia J about the elbow and damping c, a rope
with the moment arm r oscillates without decay at

    Kc r = c / T + c^2 / J,   Tc = 2 pi sqrt(J T / c)

so that without the lag any gain would be stable. c is the hinge's friction and the passive muscles' damping.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import radians

import numpy as np

from dms_core import SolverOptions, simulate
from dms_core.model import Constant
from dms_core.model.control.ziegler_nichols import (
    STEP,
    SUSTAINED,
    CriticalGain,
    Gains,
    find_critical_gain,
    oscillation,
    ziegler_nichols,
)
from exo_env.ecosystem.ecosystem import Ecosystem
from exo_env.ecosystem.exoskeleton import Exoskeleton
from exo_env.ecosystem.subject import DEFAULT, Subject

START = radians(60.0)
"""Elbow angle at which the step begins [rad]: the middle of the exercise."""
DURATION = 1.5
"""Length of a response [s]."""
SAMPLE = 0.001
"""Interval of its samples [s]."""
FIRST = 2000.0
"""Gain at which the search begins [N/rad]; it is doubled until an oscillation lasts."""
DOUBLINGS = 20
"""Doublings of the gain after which a device counts as stable at any; the search then says so."""
TOLERANCE = 0.002
"""Relative width of the bracket of Kc."""
PROBE = 100.0
"""Tension that shows how much one newton accelerates the elbow [N]."""


@dataclass(frozen=True)
class Tuning:
    """Result of the Ziegler-Nichols procedure."""

    critical: CriticalGain
    gains: Gains
    limit: str
    """What keeps the gain from being raised further."""


class StepExperiment:
    """Step responses of a device on a passive arm with an empty hand.

    Args:
        device: the exoskeleton; its own gains and the motors' limit do not count.
        subject: anatomy, a shipped one by name or a YAML file.
    """

    def __init__(self, device: Exoskeleton, subject: Subject | str = DEFAULT) -> None:
        self.subject = subject
        # A limit no response reaches.
        self.device = device.changed(actuator=device.actuator.changed(max_tension=1e6))
        slow, fast = (self._acceleration(tension) for tension in (0.0, PROBE))
        self.holding = PROBE * slow / (slow - fast)

    def _ecosystem(self, gains: Gains) -> Ecosystem:
        pid = {"kp": gains.kp, "ki": gains.ki, "kd": gains.kd}
        return Ecosystem(device=self.device.changed(gains=pid), subject=self.subject, machine=None)

    def _acceleration(self, tension: float) -> float:
        """Elbow acceleration at the start under a tension of the agonist [rad/s^2]; linear in it."""
        ecosystem = self._ecosystem(Gains(0.0, 0.0, 0.0))
        system = ecosystem.system(START, Constant(value=START), assistance=0.0, start_tension=tension)
        return float(simulate(system, 1e-4).check().sensors()["elbow_angle.acceleration"][0])

    def response(self, gains: Gains, duration: float = DURATION) -> tuple[np.ndarray, np.ndarray]:
        """(times [s], hinge angle [rad]) after the step; the error before the step is the one that holds the arm."""
        target = START + STEP + self.holding / gains.kp
        system = self._ecosystem(gains).system(START, Constant(value=target), start_tension=self.holding)
        trajectory = simulate(system, duration, SolverOptions(rtol=1e-5)).check()
        times = np.arange(round(duration / SAMPLE) + 1) * SAMPLE
        return times, trajectory.sensors(times)["exo_angle.angle"]


def proportional(kp: float) -> Gains:
    """Gains of the experiment, of a proportional controller."""
    return Gains(kp, 0.0, 0.0)


def tune(device: Exoskeleton, progress: Callable[[float, float], None] | None = None) -> Tuning:
    """Find the critical gain and the gains that follow from it.

    Args:
        device: the exoskeleton.
        progress: is called with each gain [N/rad] and the growth of its oscillation [-].

    Raises:
        InputError: no gain makes the device oscillate.
    """
    experiment = StepExperiment(device)
    known: dict[float, tuple[np.ndarray, np.ndarray]] = {}

    def response(kp: float) -> tuple[np.ndarray, np.ndarray]:
        if kp not in known:
            known[kp] = experiment.response(proportional(kp))
            if progress is not None:
                progress(kp, oscillation(*known[kp]).growth)
        return known[kp]

    high = FIRST
    for _ in range(DOUBLINGS):
        if oscillation(*response(high)).growth >= SUSTAINED:
            break
        high *= 2.0
    critical = find_critical_gain(response, high / 2.0, high, tolerance=TOLERANCE)
    return Tuning(critical, ziegler_nichols(critical.Kc, critical.Tc), what_limits(device, critical.Kc))


def what_limits(device: Exoskeleton, Kc: float) -> str:
    """A sentence on what keeps the gain from being raised above the critical gain Kc [N/rad]."""
    lag, moment_arm = device.actuator.time_constant, device.moment_arm(device.lifting_rope, START)
    return (
        f"the motors' first-order lag of {1e3 * lag:g} ms: Kc times the rope's moment arm of {1e3 * moment_arm:.1f} mm "
        f"is {Kc * moment_arm:.0f} Nm/rad, the hinge's damping over the lag {device.hinge_damping / lag:.0f} Nm/rad, "
        "and the passive muscles add the rest; without lag there would be no critical gain"
    )
