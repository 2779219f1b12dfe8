"""A patient is data: it survives JSON and YAML, refuses what cannot be, and says where each range comes from."""

import json
import re

import numpy as np
import pytest

from dms_core.errors import InputError
from dms_core.files.config_files import configs
from dms_core.files.yaml_text import read_yaml
from exo_env.ecosystem.arm import Arm
from exo_env.ecosystem.person import Person
from exo_env.patient.patient import LONGEST_DELAY, PATIENT, SHOWN, Patient
from exo_env.patient.sources import SOURCES
from exo_env.traits import traits_of

UNITS = ("[kg]", "[m]", "[-]", "[s]", "[s/rad]", "[rad/s]", "[Hz]", "[1/s]", "[rad]", "[1/(s rad)]", "[1/rad]")
IMPAIRED = {
    "sex": "female",
    "height": 1.6,
    "maximum_activation_flexors": 0.31,
    "tremor_width": 0.7,
    "stretch_delay": 0.04,
}


def test_default_is_the_papers_subject():
    patient = Patient()
    assert patient.person == Person()
    facts = Arm().facts["muscle_defaults"]
    found = patient.time_constants(Arm())
    assert found == {name: facts[name] for name in ("activation_time_constant", "deactivation_time_constant")}


def test_body_and_muscles_are_those_of_the_patient():
    patient = Patient(body_mass=55.0, height=1.6, sex="female", strength=0.7, activation_time_scale=2.0)
    assert patient.person == Person(body_mass=55.0, height=1.6, sex="female", strength=0.7)
    healthy, slow = Patient().time_constants(Arm()), patient.time_constants(Arm())
    assert slow["activation_time_constant"] == 2.0 * healthy["activation_time_constant"]
    assert slow["deactivation_time_constant"] == healthy["deactivation_time_constant"]
    Arm(patient.person).muscle("BRA", **slow)


def test_json_and_yaml_and_back(tmp_path):
    patient = Patient(**IMPAIRED)
    text = json.dumps(patient.model_dump())
    assert Patient(**json.loads(text)) == patient
    (tmp_path / "patient.yaml").write_text(text)  # JSON is YAML
    assert Patient(**read_yaml(tmp_path / "patient.yaml")) == patient


def test_every_field_has_a_place_in_the_row_and_says_where_it_acts():
    assert PATIENT._fields == tuple(Patient.model_fields)
    patient = Patient(**IMPAIRED).changed(sex="female")
    for name, place in PATIENT._asdict().items():
        assert patient.row()[place] == (1.0 if name == "sex" else getattr(patient, name))
    acting = traits_of(Patient, "size", "muscle", "effort", "plan", "joint")
    assert set(acting) == Patient.model_fields.keys() - {"sex"}
    assert set(SHOWN) == set(acting) - set(traits_of(Patient, "muscle"))


@pytest.mark.parametrize("name", [n for n in Patient.model_fields if n != "sex"])
def test_every_number_has_unit_source_and_limits(name):
    field = Patient.model_fields[name]
    assert any(unit in field.description for unit in UNITS)
    limits = {key: getattr(m, key) for m in field.metadata for key in ("ge", "gt", "le") if hasattr(m, key)}
    low, high = limits.get("ge", limits.get("gt")), limits["le"]
    sourced = "assumed" in field.description or LABEL.search(field.description)
    # "The same of the extensors" carries the label too; nothing rests on silence.
    assert sourced, field.description
    for bad in (low - 1.0, high + 1.0, float("nan"), float("inf"), "much", None):
        with pytest.raises(InputError, match=name):
            Patient(**{name: bad})
    assert getattr(Patient(**{name: high}), name) == high


LABEL = re.compile(r"\[([A-Z][A-Za-z-]+ \d{4})\]")


def test_labels_of_sources_stand_in_the_table_and_each_is_used():
    descriptions = [field.description for field in Patient.model_fields.values()]
    files = [path.read_text() for path in (configs() / "patients").glob("*.yaml")]
    used = set(LABEL.findall("\n".join([*descriptions, *files])))
    assert used <= set(SOURCES) and list(SOURCES) == sorted(SOURCES)
    assert set(SOURCES) == used, set(SOURCES) - used
    assert all(source.publication and source.about for source in SOURCES.values())


def test_delays_fit_into_the_memory():
    for name in ("neural_delay", "electromechanical_delay", "stretch_delay", "feedback_delay"):
        with pytest.raises(InputError, match=name):
            Patient(**{name: LONGEST_DELAY + 0.001})


def test_unknown_key_and_sex_are_named():
    with pytest.raises(InputError, match=r"unknown key 'weakness'.*maximum_activation_flexors"):
        Patient(weakness=0.5)
    with pytest.raises(InputError, match="sex = 'other'"):
        Patient(sex="other")


def test_patient_is_frozen():
    with pytest.raises(Exception, match="frozen"):
        Patient().height = 1.8
    assert Patient().changed(height=1.8).height == 1.8
    assert not np.isnan(Patient().row()).any()
