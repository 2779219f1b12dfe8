"""Populations of patients: a distribution for each field of `Patient`, or a mixture of other populations.

    title: after stroke, mildly affected
    fields:
      maximum_activation_flexors: {uniform: [0.5, 0.9]}
      ...

    title: as the mildly affected, but older
    base: stroke_mild
    fields:
      strength: {uniform: [0.4, 0.7]}

    title: everybody
    mixture: {healthy: 1, stroke_mild: 3}

    strength: 0.7                      one patient: a file of values alone, without `fields`; the rest is healthy

A population with `fields` gives every field of a patient, so that nothing is left to a default unseen, unless it names
a `base`: another shipped population, from which it takes the fields that it does not give. Traits whose default changes
nothing may be left out (traits.py). `body_mass_index` [kg/m^2] may stand in place of body_mass: heavy and tall go
together. Otherwise fields are independent (assumed); what goes together is put into populations of its own, and mixed.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import cached_property
from pathlib import Path
from typing import Any, Self

import numpy as np
from pydantic import Field, model_validator

from dms_core.errors import InputError, choices
from dms_core.files.config_files import configs
from dms_core.files.yaml_text import read_yaml, said_of
from dms_core.validation import cut, shown
from exo_env.ecosystem.person import SEXES
from exo_env.patient.distributions import Choice, Constant, Distribution, Draws, distribution, weighted
from exo_env.patient.patient import FIELDS, PATIENT, Patient
from exo_env.settings import Settings
from exo_env.streams import stream, uniform
from exo_env.traits import neutral_traits

FOLDER = "patients"
BODY_MASS_INDEX = "body_mass_index"


class Population(Settings):
    """Patients to draw from. JSON-able; checked in full when it is made."""

    title: str = Field(default="", description="shown in tables and figures")
    base: str | None = Field(default=None, description="shipped population that gives the fields not given here")
    fields: dict[str, Any] = Field(default={}, description="distribution of each field, see distributions.py")
    mixture: dict[str, float] = Field(default={}, description="weight of each of several shipped populations")

    @model_validator(mode="after")
    def _possible(self):
        if bool(self.mixture) == bool(self.fields or self.base):
            raise ValueError("expected either fields, with or without a base, or a mixture")
        if self.mixture:
            if min(self.mixture.values()) < 0.0 or not 0.0 < sum(self.mixture.values()) < math.inf:
                raise ValueError(f"mixture = {shown(self.mixture)}: expected weights from 0, not all 0")
            _ = self.parts
        else:
            self._check_fields()
        return self

    @classmethod
    def shipped(cls, name: str) -> Self:
        """A population of configs/patients.

        Raises:
            InputError: there is none of this name; lists those there are.
        """
        if name not in shipped_populations():
            raise InputError(
                f"unknown population {shown(name)}. Shipped are: {choices(shipped_populations())}; or give a YAML file."
            )
        return cls.read(configs() / FOLDER / f"{name}.yaml")

    @classmethod
    def read(cls, path: str | Path) -> Self:
        """A population from a YAML file; a file of a patient's fields alone is a population of that patient.

        Raises:
            InputError: the file is missing or wrong; names file, key and value.
        """
        with said_of(path):
            found = read_yaml(path)
            if found and not found.keys() & cls.model_fields.keys():
                return cls(title=Path(path).stem, fields=Patient(**found).model_dump())
            return cls(**found)

    @cached_property
    def parts(self) -> tuple[Population, ...]:
        """Populations of a mixture, in the order of their weights."""
        return tuple(Population.shipped(name) for name in self.mixture)

    @cached_property
    def distributions(self) -> dict[str, Distribution]:
        """Distribution of each field, in the order in which `Patient` declares them, whatever the order in the file."""
        given, order = self.fields_in_full, list(Patient.model_fields)
        # A body mass index needs the height, which is declared after the body mass.
        names = sorted(given, key=lambda k: (_patient_field(k) == "body_mass", order.index(_patient_field(k))))
        return {name: _distribution(name, given[name]) for name in names}

    @property
    def fields_in_full(self) -> dict[str, Any]:
        """Distributions as they stand in the files, those of the base included."""
        if self.base is None:
            return self.fields
        if self.base not in shipped_populations():
            raise InputError(
                f"base = {shown(self.base)}: expected one of the shipped populations, which are "
                f"{choices(shipped_populations())}; a base is no file."
            )
        under, here = Population.shipped(self.base), {_patient_field(name) for name in self.fields}
        if under.mixture:
            raise InputError(f"base = '{self.base}' is a mixture; expected a population with fields.")
        return {k: v for k, v in under.fields_in_full.items() if _patient_field(k) not in here} | self.fields

    def sample(self, source: np.random.Generator | int) -> Patient:
        """A patient.

        Args:
            source: a generator, from which one number is taken, or that number: the key of the random streams from
                which the fields come (streams.py).
        """
        key = source.integers(2**63) if isinstance(source, np.random.Generator) else source
        return Patient.of_row(self.draw(np.uint64(key)))

    def draw(self, key: np.uint64, level: int = 0) -> np.ndarray:
        """Row of a patient, as `Patient.row` gives it; see `sample`.

        Args:
            key: key of the random streams.
            level: how many mixtures this population is a part of.
        """
        if self.mixture:
            chosen = weighted(self._weights, uniform(key, stream(f"patient.mixture.{level}"), 0))
            return self.parts[chosen].draw(key, level + 1)
        draws, places = self._draws
        row = self._defaults.copy()
        row[places] = draws.sample(key)
        if BODY_MASS_INDEX in self.distributions:
            row[PATIENT.body_mass] *= row[PATIENT.height] ** 2
        return row

    @cached_property
    def _defaults(self) -> np.ndarray:
        """Row of a healthy patient, which gives the traits that are not named."""
        return Patient().row()

    @cached_property
    def _weights(self) -> tuple[float, ...]:
        return tuple(self.mixture.values())

    @cached_property
    def _draws(self) -> tuple[Draws, np.ndarray]:
        """Distributions as numbers, and the place of each in a patient's row."""
        fields = {_patient_field(name): _numeric(d) for name, d in self.distributions.items()}
        return Draws({f"patient.{name}": d for name, d in fields.items()}), np.array([FIELDS.index(x) for x in fields])

    def _check_fields(self) -> None:
        """Refuse a field that is missing, or that no patient can have at an end of its distribution.

        Raises:
            InputError: names key and value.
        """
        known = [*Patient.model_fields, BODY_MASS_INDEX]
        for name in self.fields:
            if name not in known:
                raise InputError(f"fields: unknown key '{cut(name)}'. Allowed: {choices(known)}.")
        if {BODY_MASS_INDEX, "body_mass"} <= self.fields.keys():
            raise InputError(f"fields: body_mass and {BODY_MASS_INDEX} are both given; expected one of them.")
        found = self.distributions
        given = {*map(_patient_field, found), *neutral_traits(Patient)}
        missing = [name for name in Patient.model_fields if name not in given]
        if missing:
            with_fields = [name for name in shipped_populations() if "mixture" not in read_shipped(name)]
            raise InputError(
                f"fields: {', '.join(missing)} {'is' if len(missing) == 1 else 'are'} missing. Give a distribution of "
                "each, or name the shipped population that gives what is missing, with a line such as 'base: healthy' "
                f"(there are {choices(with_fields)}). A file of one patient has values alone, without 'fields'."
            )
        for name, d in found.items():
            for value in d.limits():
                if name != BODY_MASS_INDEX:
                    _checked(name, value, {name: value})
        if BODY_MASS_INDEX in found:
            for end in (0, -1):
                value = found[BODY_MASS_INDEX].limits()[end]
                ends = {BODY_MASS_INDEX: value, "height": found["height"].limits()[end]}
                _checked(BODY_MASS_INDEX, value, ends)


Source = str | Mapping[str, Any] | Patient | Population


def population(source: Source) -> Population:
    """The population that a source stands for: a name, a YAML file, a population or patient, or either as a dict.

    A single patient is a population of which every draw is that patient.

    Raises:
        InputError: it is none of these; names the culprit and lists the shipped populations.
    """
    if isinstance(source, Population):
        return source
    if isinstance(source, Patient):
        return Population(title="one patient", fields=source.model_dump())
    if isinstance(source, str):
        return Population.read(source) if source.endswith((".yaml", ".yml")) else Population.shipped(source)
    if isinstance(source, Mapping):
        if source.keys() & Population.model_fields.keys():
            return Population(**source)
        return population(Patient(**source))
    raise InputError(
        f"patient = {shown(source)}: expected a population ({choices(shipped_populations())}), a YAML file, or a "
        "mapping of the fields of a patient."
    )


def read_shipped(name: str) -> Mapping[str, Any]:
    """Contents of the file of a shipped population."""
    return read_yaml(configs() / FOLDER / f"{name}.yaml")


def shipped_populations() -> tuple[str, ...]:
    """Names of the populations in configs/patients."""
    return tuple(sorted(p.stem for p in (configs() / FOLDER).glob("*.yaml")))


def _patient_field(name: str) -> str:
    """Field of a patient that a key of a file decides."""
    return "body_mass" if name == BODY_MASS_INDEX else name


def _distribution(name: str, spec: Any) -> Distribution:
    """A field's distribution, with the field's name in every complaint."""
    try:
        return distribution(spec)
    except InputError as error:
        raise InputError(f"fields: {name}: {error}") from None


def _numeric(d: Distribution) -> Distribution:
    """The same with places in SEXES instead of words."""
    if isinstance(d, Constant) and isinstance(d.constant, str):
        return Constant(constant=SEXES.index(d.constant))
    if isinstance(d, Choice):
        return d.changed(choice=tuple(SEXES.index(x) if isinstance(x, str) else x for x in d.choice))
    return d


def _patient(values: dict[str, Any]) -> Patient:
    """A patient; a body mass index becomes the body mass."""
    values = dict(values)
    if BODY_MASS_INDEX in values:
        values["body_mass"] = values.pop(BODY_MASS_INDEX) * values["height"] ** 2
    return Patient(**values)


def _checked(name: str, value: Any, fields: dict[str, Any]) -> None:
    """Refuse a value that no patient can have."""
    try:
        _patient(fields)
    except (InputError, TypeError) as error:
        raise InputError(f"fields: {name} reaches {shown(value)}: {error}") from None
