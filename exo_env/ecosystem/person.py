"""Who is in the device, as far as the body is concerned: the sizes that arm26 is scaled to (arm.py)."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from exo_env.settings import Settings
from exo_env.traits import trait, traits_of

MASS_0, HEIGHT_0 = 68.8034, 1.741
"""Body mass [kg] and height [m] of arm26. Inference: its segment masses are de Leva's male fractions of 68.8034 kg, and
its forearm's centre of mass is that of de Leva's mean male forearm and hand, whose stature is 1.741 m."""
Sex = Literal["male", "female"]
SEXES: tuple[Sex, ...] = ("male", "female")
"""A sex as a number is its place here."""


class Person(Settings):
    """The body of a person. The defaults are arm26 unchanged."""

    body_mass: float = trait(MASS_0, ge=20.0, le=250.0, unit="kg", acts="size", description="body mass M [kg]; assumed")
    height: float = trait(HEIGHT_0, ge=1.0, le=2.3, unit="m", acts="size", description="height H [m]; assumed")
    sex: Sex = Field(default="male", description="whose segment fractions are used")
    strength: float = trait(1.0, gt=0.0, le=5.0, acts="size", description="factor on every muscle's F0 [-]; assumed")


JOINT_TRAITS = traits_of(Person, "joint")
"""Traits that are numbers of a joint's own element; the numbers of a world are linear in each of them."""
