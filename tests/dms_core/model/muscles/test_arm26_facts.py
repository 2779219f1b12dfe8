"""configs/subject/arm26.yaml says the same as the facts in tests/reference/arm26.json, number by number."""

import json

import pytest

from tests.arm26 import MUSCLES, REFERENCE, ROOT, muscle, subject

FACTS = json.loads((REFERENCE / "arm26.json").read_text())


def test_licence_and_attribution_stand_at_the_top():
    head = (ROOT / "configs" / "subject" / "arm26.yaml").read_text()[:1200]
    for words in ("CC BY 3.0", "OpenSim Development Team", "Kate Holzbaur", FACTS["source"]["repository_commit"]):
        assert words in head


def test_bodies():
    assert subject()["bodies"].keys() == FACTS["bodies"].keys()
    for name, body in subject()["bodies"].items():
        fact = FACTS["bodies"][name]
        inertia = fact["inertia_about_com_in_body_frame_kg_m2"]
        assert body == {
            "mass": fact["mass_kg"],
            "centre_of_mass": fact["centre_of_mass_m"],
            "inertia": [inertia["Ixx"], inertia["Iyy"], inertia["Izz"]],
        }
        assert [inertia[k] for k in ("Ixy", "Ixz", "Iyz")] == [0.0, 0.0, 0.0]


def test_joints_gravity_and_markers():
    assert subject()["joints"].keys() == FACTS["joints"].keys()
    for name, joint in subject()["joints"].items():
        fact = FACTS["joints"][name]
        assert (joint["body_i"], joint["body_j"]) == (fact["parent_frame"]["on_body"], fact["child_frame"]["on_body"])
        assert joint["point_i"] == fact["parent_frame"]["translation_m"]
        assert joint["point_j"] == fact["child_frame"]["translation_m"]
        if joint["kind"] == "revolute":
            assert joint["axis_i"] == fact["rotation_axis_in_parent_frame"]
            assert joint["range"] == fact["coordinate"]["range_rad"]
    assert subject()["gravity"] == FACTS["gravity_m_per_s2"]
    assert subject()["markers"] == {
        name: {"body": m["body"], "point": m["location_m"]} for name, m in FACTS["markers"].items()
    }


@pytest.mark.parametrize("name", MUSCLES)
def test_muscles(name):
    m, fact, thelen = muscle(name), FACTS["muscles"][name], FACTS["muscles"][name]["thelen"]
    assert m.max_isometric_force == fact["max_isometric_force_N"]
    assert m.optimal_fibre_length == fact["optimal_fibre_length_m"]
    assert m.tendon_slack_length == fact["tendon_slack_length_m"]
    assert m.pennation_angle == fact["pennation_angle_at_optimal_rad"]
    assert m.max_contraction_velocity == fact["max_contraction_velocity_optimal_lengths_per_s"]
    assert m.activation_time_constant == fact["activation_time_constant_s"]
    assert m.deactivation_time_constant == fact["deactivation_time_constant_s"]
    assert (m.curves.tendon_strain, m.curves.passive_strain) == (thelen["FmaxTendonStrain"], thelen["FmaxMuscleStrain"])
    assert (m.curves.active_shape, m.curves.passive_shape) == (thelen["KshapeActive"], thelen["KshapePassive"])
    assert (m.curves.velocity_shape, m.curves.lengthening_force) == (thelen["Af"], thelen["Flen"])
    assert [(p.body, list(p.point)) for p in m.path] == [(p["body"], p["location_m"]) for p in fact["path_points"]]


def test_all_muscles_are_there():
    assert tuple(subject()["muscles"]) == MUSCLES == tuple(FACTS["muscles"])
