"""The file of a subject: every mistake by file, key and value."""

import copy

import pytest
import yaml

from dms_core.errors import InputError
from dms_core.files.config_files import config_file
from exo_env.ecosystem.arm import Arm
from exo_env.ecosystem.ecosystem import Ecosystem
from exo_env.ecosystem.subject import read_subject

ARM26 = yaml.safe_load(config_file("subject/arm26.yaml").read_text())


def test_the_shipped_file_is_read_as_it_is():
    assert read_subject("arm26").facts == ARM26


@pytest.mark.parametrize(
    ("keys", "value", "complaint"),
    [
        (("roles",), None, "'roles' is missing"),
        (("roles", "elbow"), None, "roles: RoleFacts: 'elbow' is missing"),
        (("roles",), ["elbow"], "roles = "),
        (("roles", "flexors"), "BIClong", "roles: RoleFacts: flexors = 'BIClong'"),
        (("roles", "flexors"), ["biceps"], "roles: flexors = 'biceps'; expected one of the muscles BIClong"),
        (("roles", "forearm"), "ulna", "roles: forearm = 'ulna'; expected one of the bodies base"),
        (("gravity",), [0.0, -9.8], "gravity = [0.0, -9.8]: Expected 3 items, got 2"),
        (("bodies", "r_humerus", "mass"), None, "bodies.r_humerus: BodyFacts: 'mass' is missing"),
        (("bodies", "r_humerus", "mass"), -1.0, "bodies.r_humerus: BodyFacts: mass = -1.0"),
        (("joints", "r_elbow", "axis_i"), None, "joints.r_elbow: 'axis_i' is missing"),
        (
            ("joints", "r_elbow", "axis_i"),
            [0.1, -1.0, 0.0],
            "joints.r_elbow: axis_i = (0.1, -1.0, 0.0) is 5.71 deg from the humerus (y); expected an axis across",
        ),
        (("joints", "r_elbow", "axis_i"), [0.0, 0.0, 0.0], "joints.r_elbow: axis_i = (0.0, 0.0, 0.0) has no direction"),
        (("joints", "r_elbow", "point_i"), "here", "joints.r_elbow: JointFacts: point_i = 'here'"),
        (
            ("joints", "r_elbow", "stop", "stiffness"),
            0.0,
            "joints.r_elbow: JointFacts: stop: StopFacts: stiffness = 0.0",
        ),
        (("joints", "r_elbow", "stop", "highest"), -0.1, "StopFacts: lowest = 0 must be below highest = -0.1"),
        (
            ("joints", "r_elbow", "stop", "highest"),
            142.0,
            "joints.r_elbow: JointFacts: stop: StopFacts: highest = 142.0",
        ),
        (
            ("joints", "r_elbow", "stop", "dissipation"),
            None,
            "joints.r_elbow: JointFacts: stop: StopFacts: 'dissipation' is missing",
        ),
        (
            ("joints", "r_elbow", "stop", "stifness"),
            1.0,
            "joints.r_elbow: JointFacts: stop: StopFacts: unknown key 'stifness'",
        ),
        (("joints", "r_elbow", "stop"), [0.0, 2.4], "joints.r_elbow"),
        (
            ("joints", "r_shoulder", "stop"),
            ARM26["joints"]["r_elbow"]["stop"],
            "joints.r_shoulder: stop: only the elbow",
        ),
        (("muscles",), {}, "muscles = {}"),
        (("muscles", "BRA", "optimal_fibre_length"), None, "muscles.BRA: 'optimal_fibre_length' is missing"),
        (("muscles", "BRA", "path"), [], "muscles.BRA: MuscleFacts: path = []"),
        (
            ("muscles", "BRA", "path"),
            [{"body": "moon", "point": [0.0, 0.0, 0.0]}] * 2,
            "muscles.BRA.path: body = 'moon': expected one of base",
        ),
        (("muscle_defaults", "activation_time_constant"), None, "'activation_time_constant' is missing"),
        (("bodies", "base", "mass"), "1.8", "bodies.base: BodyFacts: mass = '1.8': Expected a number"),
        (("gravity",), [True, 0, 0], "gravity.0 = True: Expected a number"),
        (("muscles", "BRA", "max_isometric_force"), "987.3", "'BRA': max_isometric_force = '987.3': Expected a number"),
        (("muscles", "BRA", "colour"), "red", "'BRA': unknown key 'colour'"),
        (("muscles", "BRA", "name"), "BIClong", "muscles.BRA: unknown key 'name'"),
        (("muscle_defaults", "activation_time_constant"), True, "activation_time_constant = True: Expected a number"),
        (("muscle_defaults", "curves", "tendon_strain"), "0.033", "tendon_strain = '0.033': Expected a number"),
        (("roles", "flexors"), "BRA", "flexors = 'BRA': Expected a list"),
        (("roles", "elbow"), ["x" * 500] * 100, "roles: RoleFacts: elbow = ['xxxxx"),
    ],
)
def test_mistakes_are_named(tmp_path, keys, value, complaint):
    facts = copy.deepcopy(ARM26)
    place = facts
    for key in keys[:-1]:
        place = place[key]
    if value is None:
        del place[keys[-1]]
    else:
        place[keys[-1]] = value
    path = tmp_path / "mine.yaml"
    path.write_text(yaml.safe_dump(facts))
    with pytest.raises(InputError) as caught:
        read_subject(str(path))
    assert str(path) in str(caught.value) and complaint in str(caught.value)


def written(path, mass):
    """A file with another mass of the humerus."""
    facts = copy.deepcopy(ARM26)
    facts["bodies"]["r_humerus"]["mass"] = mass
    path.write_text(yaml.safe_dump(facts))


def test_a_file_is_read_again_when_it_changes_and_kept_by_who_has_it(tmp_path):
    path = tmp_path / "mine.yaml"
    written(path, 2.0)
    before = Ecosystem(subject=str(path))
    written(path, 3.0)
    after = Ecosystem(subject=str(path))
    assert before != after and hash(before) != hash(after)
    masses = [e.changed(weight=2.0).arm().facts["bodies"]["r_humerus"]["mass"] for e in (before, after)]
    assert masses == [2.0, 3.0]


def test_a_relative_path_is_that_of_the_present_folder(tmp_path, monkeypatch):
    masses = []
    for name, mass in (("one", 2.0), ("two", 3.0)):
        (tmp_path / name).mkdir()
        monkeypatch.chdir(tmp_path / name)
        written(tmp_path / name / "mine.yaml", mass)
        masses.append(Arm(subject="mine.yaml").facts["bodies"]["r_humerus"]["mass"])
    assert masses == [2.0, 3.0]
