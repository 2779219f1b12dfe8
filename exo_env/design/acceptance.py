"""Whether a device does the exercise on the patients who wear it; what does not is no design, however low its load.

An objective alone does not ask for the exercise: motors that do nothing have the least power. So today's device has to
follow the movement within MOST_OFF with ropes below their motors' limit, and another one besides within LAG times the
tracking error of today's, patient by patient.
"""

from __future__ import annotations

from dms_core.errors import SimulationError
from exo_env.ecosystem.exoskeleton import Exoskeleton

MOST_OFF = 5.0
"""Largest rms tracking error [deg]; assumed: the shipped device has 0.3, on a compliant cuff 2, and an arm that is not
lifted through the shipped exercise 47."""
LAG = 2.0
"""Largest tracking error, as a multiple of that of today's device on the same patient; assumed."""


class Acceptance:
    """Judges the devices of one search, first of all today's on every wearer."""

    def __init__(self) -> None:
        self._today: dict[str, float] = {}

    def check(self, wearer: str, device: Exoskeleton, off: float, tension: float) -> None:
        """Refuse a device that does not do the exercise on a wearer.

        Args:
            wearer: name; the first device that he is seen in is today's.
            device: what he wears.
            off: rms tracking error [deg].
            tension: largest of any rope [N].

        Raises:
            SimulationError: it does not; names the wearer, the value, and what would be right.
        """
        motor = device.actuator
        # Commands are limited smoothly, over the motors' width, so that a tension never quite reaches the limit.
        if tension >= motor.max_tension - motor.width:
            raise SimulationError(
                f"{wearer}: a rope reaches {tension:.5g} N, which is all that its motor can pull. Expected less than "
                f"{motor.max_tension - motor.width:g} N (actuator.max_tension less its width): a lighter weight, a "
                "slower movement or stronger motors."
            )
        if not off <= MOST_OFF:
            raise SimulationError(
                f"{wearer}: the elbow is {off:.3g} deg rms off the movement, so that the device does not do the "
                f"exercise. Expected at most {MOST_OFF:g} deg: a lighter weight, a slower movement or larger gains."
            )
        most = LAG * self._today.setdefault(wearer, off)
        if off > most:
            raise SimulationError(
                f"{wearer}: the elbow is {off:.3g} deg rms off the movement. Expected at most {most:.3g} deg, "
                f"{LAG:g} times as much as in today's device."
            )
