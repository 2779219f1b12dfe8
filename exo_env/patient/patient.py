"""A patient: what distinguishes one user of the device from another, as data.

The defaults are the paper's subject: arm26, full activation, nothing delayed, nothing impaired. `effort.py` tells
how each number acts; configs/patients says how it is distributed. The source of each range stands in the field's
description as a label such as [Canning 1999], which sources.py explains, or as the word "assumed"; a range is a limit
of what is accepted, not a distribution.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any, Self

import numpy as np

from exo_env.ecosystem.arm import Arm
from exo_env.ecosystem.person import SEXES, Person
from exo_env.places import places
from exo_env.traits import row_of, trait, traits_of

MIDDLE = math.radians(60.0)
"""Elbow angle in the middle of the exercise [rad], for which some of a patient's numbers hold."""
LONGEST_DELAY = 0.5
"""Longest delay of a patient [s]; the memory of a patient is as long."""


class Patient(Person):
    """One patient: a person's body, and what is impaired. All numbers are SI; a share is between 0 and 1."""

    maximum_activation_flexors: float = trait(
        1.0, ge=0.0, le=1.0, acts="effort",
        description="share of the flexors that effort can activate [-], a ceiling; stroke: torque of the more affected "
        "side 44 % below healthy [Bowden 2014], half of healthy six weeks after [Canning 1999]",
    )  # fmt: skip
    maximum_activation_extensors: float = trait(
        1.0, ge=0.0, le=1.0, acts="effort",
        description="the same of the extensors [-]; chronic stroke 0.73 +- 0.23 of the other side [Mercier 2004]",
    )  # fmt: skip
    activation_time_scale: float = trait(
        1.0, ge=0.5, le=5.0, acts="muscle",
        description="factor on the muscles' activation time constant [-]; torque takes two to three times longer after "
        "stroke [Canning 1999], of which the share of the muscle is assumed",
    )  # fmt: skip
    deactivation_time_scale: float = trait(
        1.0, ge=0.5, le=5.0, acts="muscle",
        description="factor on the deactivation time constant [-]; assumed, as activation",
    )  # fmt: skip
    neural_delay: float = trait(
        0.0, ge=0.0, le=LONGEST_DELAY, unit="s", acts="effort",
        description="by which the intended command comes late [s]; 0 for a subject who anticipates the exercise; "
        "assumed",
    )  # fmt: skip
    electromechanical_delay: float = trait(
        0.0, ge=0.0, le=LONGEST_DELAY, unit="s", acts="effort",
        description="between motor nerve and activation [s]; assumed: of the 50 to 56 ms measured [Cavanagh 1979] most "
        "is stretching of the tendon and activation, which the muscle model has",
    )  # fmt: skip
    co_contraction: float = trait(
        0.0, ge=0.0, le=1.0, acts="effort",
        description="drive of the antagonists per mean drive of the agonists [-]; healthy maximum efforts: biceps 0.06 "
        "to 0.19, triceps 0.26 to 0.38 [Bazzucchi 2006]; after stroke assumed",
    )  # fmt: skip
    spasticity_flexors: float = trait(
        0.0, ge=0.0, le=2.0, unit="s/rad", acts="effort",
        description="excitation of the flexors per rate of stretch above the threshold [s/rad]; velocity-dependent by "
        "definition [Lance 1980]; value assumed",
    )  # fmt: skip
    spasticity_extensors: float = trait(
        0.0, ge=0.0, le=2.0, unit="s/rad", acts="effort",
        description="the same of the extensors [s/rad]; assumed",
    )  # fmt: skip
    stretch_threshold: float = trait(
        0.5, ge=0.0, le=10.0, unit="rad/s", acts="effort",
        description="rate of stretch, as rate of the elbow, below which there is no reflex at 60 deg [rad/s]; assumed, "
        "within the 0.26 to 2.6 rad/s at which the paretic elbow's reflex is tested [McPherson 2018]",
    )  # fmt: skip
    stretch_threshold_slope: float = trait(
        0.0, ge=0.0, le=10.0, unit="1/s", acts="effort", neutral=True,
        description="by which that threshold falls for each radian by which the elbow stretches the muscle beyond 60 "
        "deg [1/s]; that it falls, and 1 / slope relates threshold angle to rate: [Powers 1989], [Calota 2008]; value "
        "assumed",
    )  # fmt: skip
    stretch_delay: float = trait(
        0.03, ge=0.0, le=LONGEST_DELAY, unit="s", acts="effort",
        description="latency of the stretch reflex [s]; from short latency to the 50 to 60 ms of [Hammond 1955]",
    )  # fmt: skip
    tremor_amplitude: float = trait(
        0.0, ge=0.0, le=0.5, acts="effort",
        description="amplitude of the alternating excitation [-]; assumed",
    )  # fmt: skip
    tremor_frequency: float = trait(
        8.0, ge=2.0, le=12.0, unit="Hz", acts="effort",
        description="[Hz]; Holmes 2.5 to 5, essential 4 to 12 [Deuschl 2022], 5.8 +- 1.3 [Elble 2000], physiological 8 "
        "to 12",
    )  # fmt: skip
    tremor_width: float = trait(
        0.0, ge=0.0, le=5.0, unit="Hz", acts="effort",
        description="width of its spectral peak at half height [Hz]; assumed",
    )  # fmt: skip
    fatigue_rate: float = trait(
        0.0, ge=0.0, le=0.2, unit="1/s", acts="effort",
        description="F [1/s]; elbow 0.00912 [Frey-Law 2012]; flexors 0.0170, extensors 0.0156 [Rakshit 2021]",
    )  # fmt: skip
    recovery_rate: float = trait(
        0.00094, ge=0.0, le=0.2, unit="1/s", acts="effort",
        description="R [1/s]; elbow 0.00094 [Frey-Law 2012]; flexors 0.0049, extensors 0.0013 [Rakshit 2021]",
    )  # fmt: skip
    rest_recovery: float = trait(
        15.0, ge=1.0, le=60.0, acts="effort",
        description="factor on R at rest [-]; elbow 15 [Looft 2018]",
    )  # fmt: skip
    fatigued_at_start: float = trait(
        0.0, ge=0.0, le=0.9, acts="effort",
        description="share fatigued by repetitions before this one [-]; assumed",
    )  # fmt: skip
    slacking_rate: float = trait(
        0.0, ge=0.0, le=10.0, unit="1/s", acts="effort",
        description="rate at which effort is forgotten [1/s]; that it is, all the time and in proportion: from "
        "movement to movement [Emken 2007], within one [Smith 2018]; value assumed",
    )  # fmt: skip
    effort_recovery: float = trait(
        0.0, ge=0.0, le=100.0, unit="1/(s rad)", acts="effort",
        description="rate at which effort is recruited per tracking error [1/(s rad)]; that errors of any size do it: "
        "[Emken 2007]; value assumed",
    )  # fmt: skip
    least_effort: float = trait(
        0.0, ge=0.0, le=1.0, acts="effort",
        description="share of the command at which forgetting ends [-]; assumed",
    )  # fmt: skip
    feedback_gain: float = trait(
        0.0, ge=0.0, le=5.0, unit="1/rad", acts="effort",
        description="proprioceptive feedback: excitation of the flexors, before weakness, per tracking error [1/rad]; "
        "extensors minus it; healthy from the stiffness of elbows that hold [Gomi 1998] and move "
        "[Bennett 1993], after stroke assumed",
    )  # fmt: skip
    feedback_scaling: float = trait(
        0.0, ge=0.0, le=50.0, unit="1/rad", acts="effort", neutral=True,
        description="further gain per activity [1/rad]: that of the reflex rises with the motor discharge there is "
        "[Matthews 1986], and the stiffness of an elbow that holds with its torque [Gomi 1998]; after stroke assumed",
    )  # fmt: skip
    feedback_delay: float = trait(
        0.06, ge=0.0, le=LONGEST_DELAY, unit="s", acts="effort",
        description="its latency [s]; 50 to 60 ms [Hammond 1955]",
    )  # fmt: skip
    feedback_lead: float = trait(
        0.0, ge=0.0, le=0.5, unit="s", acts="effort", neutral=True,
        description="rate feedback: the error's rate counts as much as the error, times this lead [s]; that muscle "
        "spindles report rates as well as lengths: [Matthews 1981]; value assumed",
    )  # fmt: skip
    prediction: float = trait(
        0.0, ge=0.0, le=1.0, acts="effort", neutral=True,
        description="share of its own corrections, not felt yet, that a forward model of the limb takes into account "
        "[-]; that there is such a model: [Miall 1993]; value assumed",
    )  # fmt: skip
    effort_at_start: float = trait(
        1.0, ge=0.0, le=2.0, acts="effort",
        description="effort that the repetitions before this one have left, as a multiple of the plan [-]; it goes on "
        "from one movement to the next [Emken 2007]; value assumed",
    )  # fmt: skip
    expected_load: float = trait(
        1.0, ge=0.0, le=5.0, acts="plan",
        description="weight that the patient expects over the real one [-]; assumed",
    )  # fmt: skip

    @property
    def person(self) -> Person:
        """The body of the patient, without what is impaired."""
        return Person(**{name: getattr(self, name) for name in Person.model_fields})

    def time_constants(self, arm: Arm) -> dict[str, float]:
        """The muscles' time constants [s], as fields of ThelenMuscle."""
        facts = arm.facts["muscle_defaults"]
        names = {"activation_time_constant": self.activation_time_scale}
        names["deactivation_time_constant"] = self.deactivation_time_scale
        return {name: scale * facts[name] for name, scale in names.items()}

    @classmethod
    def of_row(cls, row: Iterable[float]) -> Self:
        """The patient of a row of numbers in the order of FIELDS, the sex by its place in SEXES."""
        return cls(**fields_of(row))

    def row(self) -> np.ndarray:
        """All fields as numbers, at the places of PATIENT, shape (len(FIELDS),); `of_row` takes them back."""
        return np.array(row_of(dict(self).values(), SEXES))


FIELDS = tuple(Patient.model_fields)
"""Order of a patient's row of numbers."""
PATIENT = places(FIELDS)
"""Place of each field in it, for compiled code."""
SHOWN = traits_of(Patient, "effort") + traits_of(Patient, "size") + traits_of(Patient, "plan", "joint")
"""Traits that a privileged observer is shown, in this order."""


def fields_of(row: Iterable[float]) -> dict[str, Any]:
    """Fields of a patient from its row of numbers."""
    fields: dict[str, Any] = dict(zip(FIELDS, map(float, row), strict=True))
    return fields | {"sex": SEXES[int(fields["sex"])]}
