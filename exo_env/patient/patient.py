"""A patient: what distinguishes one user of the device from another, as data.

The defaults are the paper's subject: arm26, full activation, nothing delayed, nothing impaired. `effort.py` tells
how each number acts; configs/patients says how it is distributed. The source of each range stands in the field's
description as one of these labels, or as the word "assumed"; a range is a limit of what is accepted, not a
distribution.

    [Bazzucchi 2006]  Muscle Nerve, doi:10.1002/mus.20462: antagonist activity of biceps and triceps in elbow movements
    [Bowden 2014]     Front. Neurol. 5:239: elbow flexor torque and voluntary activation after stroke
    [Canning 1999]    Arch. Phys. Med. Rehabil. 80:66-70: elbow torque after stroke, its size and its rate
    [Cavanagh 1979]   Eur. J. Appl. Physiol. 42:159-163: electromechanical delay of the elbow flexors
    [Deuschl 2022]    Clin. Neurophysiol., doi:10.1016/j.clinph.2022.01.004: investigation of tremor
    [Elble 2000]      Neurology 55:1547-1551: frequency of essential tremor
    [Emken 2007]      J. Neurophysiol. 97:3997-4006: motor adaptation as greedy optimisation of error and effort
    [Frey-Law 2012]   J. Biomech. 45:1803-1808: fatigue and recovery rates of six joints
    [Hammond 1955]    J. Physiol. 127:23P: latency of the biceps' response to a pull
    [Lance 1980]      in Feldman, Young, Koella (eds), Spasticity: disordered motor control, 485-494: its definition
    [Looft 2018]      J. Biomech. 77:16-25: recovery multiplier at rest
    [McPherson 2018]  Exp. Brain Res. 237:121-135: elbow stretch reflex in hemiparesis, stretches of 15 to 150 deg/s
    [Mercier 2004]    Clin. Rehabil. 18:215-221: relative strength of five muscle groups of the paretic arm
    [Rakshit 2021]    doi:10.1016/j.jbiomech.2021.110695: fatigue and recovery rates by muscle group and sex
    [Smith 2018]      J. Neurophysiol., doi:10.1152/jn.00700.2017: force decays while the shown error is held at zero
    [Wolbrecht 2008]  IEEE Trans. Neural Syst. Rehabil. Eng. 16:286-297: people after stroke let the robot do the work

Most of these numbers stand in the abstracts. Not checked against the papers themselves: the elbow's rates of
[Frey-Law 2012], which lie between those of ankle and shoulder in its abstract, the latency of [Hammond 1955], the
forgetting factors of [Emken 2007] and the time constants of [Smith 2018], of which the abstracts give the laws without
numbers; the rates of [Rakshit 2021] are those that MyoSuite quotes from it.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, Literal, NamedTuple, Self

import numpy as np
from pydantic import Field

from exo_env.ecosystem.arm import HEIGHT_0, MASS_0, Arm, Person
from exo_env.settings import Settings

Sex = Literal["male", "female"]
SEXES: tuple[Sex, ...] = ("male", "female")
LONGEST_DELAY = 0.5
"""Longest delay of a patient [s]; the memory of a patient is as long."""


class Patient(Settings):
    """One patient. All numbers are SI; a share is between 0 and 1."""

    body_mass: float = Field(default=MASS_0, ge=20.0, le=250.0, description="body mass [kg]; assumed")
    height: float = Field(default=HEIGHT_0, ge=1.0, le=2.3, description="height [m]; assumed")
    sex: Literal["male", "female"] = Field(default="male", description="whose segment fractions are used")
    strength: float = Field(default=1.0, gt=0.0, le=5.0, description="factor on every muscle's F0 [-]; assumed")
    maximum_activation_flexors: float = Field(
        default=1.0, ge=0.0, le=1.0,
        description="share of the flexors that effort can activate [-], a ceiling; stroke: torque of the more affected "
        "side 44 % below healthy [Bowden 2014], half of healthy six weeks after [Canning 1999]",
    )  # fmt: skip
    maximum_activation_extensors: float = Field(
        default=1.0, ge=0.0, le=1.0,
        description="the same of the extensors [-]; chronic stroke 0.73 +- 0.23 of the other side [Mercier 2004]",
    )  # fmt: skip
    activation_time_scale: float = Field(
        default=1.0, ge=0.5, le=5.0,
        description="factor on the muscles' activation time constant [-]; torque takes two to three times longer after "
        "stroke [Canning 1999], of which the share of the muscle is assumed",
    )  # fmt: skip
    deactivation_time_scale: float = Field(
        default=1.0, ge=0.5, le=5.0, description="factor on the deactivation time constant [-]; assumed, as activation"
    )
    neural_delay: float = Field(
        default=0.0, ge=0.0, le=LONGEST_DELAY,
        description="by which the intended command comes late [s]; 0 for a subject who anticipates the exercise; "
        "assumed",
    )  # fmt: skip
    electromechanical_delay: float = Field(
        default=0.0, ge=0.0, le=LONGEST_DELAY,
        description="between motor nerve and activation [s]; assumed: of the 50 to 56 ms measured [Cavanagh 1979] most "
        "is stretching of the tendon and activation, which the muscle model has",
    )  # fmt: skip
    co_contraction: float = Field(
        default=0.0, ge=0.0, le=1.0,
        description="drive of the antagonists per mean drive of the agonists [-]; healthy maximum efforts: biceps 0.06 "
        "to 0.19, triceps 0.26 to 0.38 [Bazzucchi 2006]; after stroke assumed",
    )  # fmt: skip
    spasticity_flexors: float = Field(
        default=0.0, ge=0.0, le=2.0,
        description="excitation of the flexors per rate of stretch above the threshold [s/rad]; velocity-dependent by "
        "definition [Lance 1980]; value assumed",
    )  # fmt: skip
    spasticity_extensors: float = Field(
        default=0.0, ge=0.0, le=2.0, description="the same of the extensors [s/rad]; assumed"
    )
    stretch_threshold: float = Field(
        default=0.5, ge=0.0, le=10.0,
        description="rate of stretch, as rate of the elbow, below which there is no reflex [rad/s]; assumed, within "
        "the 0.26 to 2.6 rad/s at which the paretic elbow's reflex is tested [McPherson 2018]",
    )  # fmt: skip
    stretch_delay: float = Field(
        default=0.03, ge=0.0, le=LONGEST_DELAY,
        description="latency of the stretch reflex [s]; from short latency to the 50 to 60 ms of [Hammond 1955]",
    )  # fmt: skip
    tremor_amplitude: float = Field(
        default=0.0, ge=0.0, le=0.5, description="amplitude of the alternating excitation [-]; assumed"
    )
    tremor_frequency: float = Field(
        default=8.0, ge=2.0, le=12.0,
        description="[Hz]; Holmes 2.5 to 5, essential 4 to 12 [Deuschl 2022], 5.8 +- 1.3 [Elble 2000], physiological 8 "
        "to 12",
    )  # fmt: skip
    tremor_width: float = Field(
        default=0.0, ge=0.0, le=5.0, description="width of its spectral peak at half height [Hz]; assumed"
    )
    fatigue_rate: float = Field(
        default=0.0, ge=0.0, le=0.2,
        description="F [1/s]; elbow 0.00912 [Frey-Law 2012]; flexors 0.0170, extensors 0.0156 [Rakshit 2021]",
    )  # fmt: skip
    recovery_rate: float = Field(
        default=0.00094, ge=0.0, le=0.2,
        description="R [1/s]; elbow 0.00094 [Frey-Law 2012]; flexors 0.0049, extensors 0.0013 [Rakshit 2021]",
    )  # fmt: skip
    rest_recovery: float = Field(
        default=15.0, ge=1.0, le=60.0, description="factor on R at rest [-]; elbow 15 [Looft 2018]"
    )
    fatigued_at_start: float = Field(
        default=0.0, ge=0.0, le=0.9, description="share fatigued by repetitions before this one [-]; assumed"
    )
    slacking_rate: float = Field(
        default=0.0, ge=0.0, le=10.0,
        description="rate at which effort is forgotten [1/s]; that it is, all the time and in proportion: from "
        "movement to movement [Emken 2007], within one [Smith 2018]; value assumed",
    )  # fmt: skip
    effort_recovery: float = Field(
        default=0.0, ge=0.0, le=100.0,
        description="rate at which effort is recruited per tracking error [1/(s rad)]; that errors of any size do it: "
        "[Emken 2007]; value assumed",
    )  # fmt: skip
    least_effort: float = Field(
        default=0.0, ge=0.0, le=1.0, description="share of the command at which forgetting ends [-]; assumed"
    )
    effort_at_start: float = Field(
        default=1.0, ge=0.0, le=2.0,
        description="effort that the repetitions before this one have left, as a multiple of the plan [-]; it goes on "
        "from one movement to the next [Emken 2007]; value assumed",
    )  # fmt: skip
    feedback_gain: float = Field(
        default=0.0, ge=0.0, le=5.0,
        description="proprioceptive feedback: excitation of the flexors, before weakness, per tracking error [1/rad]; "
        "extensors minus it; assumed",
    )  # fmt: skip
    feedback_delay: float = Field(
        default=0.06, ge=0.0, le=LONGEST_DELAY, description="its latency [s]; 50 to 60 ms [Hammond 1955]"
    )
    expected_load: float = Field(
        default=1.0, ge=0.0, le=5.0, description="weight that the patient expects over the real one [-]; assumed"
    )

    @property
    def person(self) -> Person:
        """Body of the patient."""
        return Person(body_mass=self.body_mass, height=self.height, sex=self.sex, strength=self.strength)

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
        """All fields as numbers, shape (len(FIELDS),); `of_row` takes them back."""
        values = {**dict(self), "sex": SEXES.index(self.sex)}
        return np.array([values[name] for name in FIELDS], dtype=float)

    def numbers(self) -> np.ndarray:
        """What the compiled dynamics reads, laid out as `PATIENT`, shape (len(PATIENT),)."""
        return np.array([getattr(self, name) for name in PATIENT._fields], dtype=float)


FIELDS = tuple(Patient.model_fields)
"""Order of a patient's row of numbers."""


def fields_of(row: Iterable[float]) -> dict[str, Any]:
    """Fields of a patient from its row of numbers."""
    found: dict[str, Any] = dict(zip(FIELDS, map(float, row), strict=True))
    return found | {"sex": SEXES[int(found["sex"])]}


class PatientIndex(NamedTuple):
    """Where each field of a patient stands in its row of numbers; the rest of the patient is in the muscles."""

    maximum_activation_flexors: int = 0
    maximum_activation_extensors: int = 1
    neural_delay: int = 2
    electromechanical_delay: int = 3
    co_contraction: int = 4
    spasticity_flexors: int = 5
    spasticity_extensors: int = 6
    stretch_threshold: int = 7
    stretch_delay: int = 8
    tremor_amplitude: int = 9
    tremor_frequency: int = 10
    tremor_width: int = 11
    fatigue_rate: int = 12
    recovery_rate: int = 13
    rest_recovery: int = 14
    fatigued_at_start: int = 15
    slacking_rate: int = 16
    effort_recovery: int = 17
    least_effort: int = 18
    feedback_gain: int = 19
    feedback_delay: int = 20
    effort_at_start: int = 21


PATIENT = PatientIndex()
