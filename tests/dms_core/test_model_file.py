"""Model files: what is read, what is written, and how mistakes are shown."""

from __future__ import annotations

import time

import pytest
import yaml

import dms_core.model
from dms_core.errors import DmsError, InputError, ModelError
from dms_core.files.config_files import config_file, configs
from dms_core.files.yaml_text import read_yaml
from dms_core.model import (
    Constant,
    EulerNorm,
    Function,
    Gravity,
    Harmonic,
    Input,
    JointAngle,
    PathPoint,
    Revolute,
    RigidBody,
    RopeForce,
    Steps,
    System,
    ThelenCurves,
    ThelenMuscle,
)
from dms_core.model_files.model_file import BRANCHES, dump, kinds, load
from tests.example_elements import examples

ROD = "bodies:\n  - {kind: rigid_body, name: rod, mass: 1.0, inertia: [0.1, 0.1, 0.1]}\n"


@pytest.fixture
def model_file(tmp_path):
    """Function that writes a text as a model file and gives its path."""

    def write(text: str):
        path = tmp_path / "model.yaml"
        path.write_text(text)
        return path

    return write


def declared(system: System) -> list:
    return [e for e in system.everything() if not isinstance(e, EulerNorm)]


def test_a_file_declares_what_python_declares(model_file):
    path = model_file(
        "name: swing\n"
        + ROD
        + "constraints: [{kind: revolute, name: hinge, body_j: rod, axis_i: [0, 0, 2e0]}]\n"
        + "forces: [{kind: gravity, name: weight, acceleration: [0, -1e1, 0]}]\n"
        + "sensors: [{kind: joint_angle, name: angle, joint: hinge}]\n"
        + "inputs: [{name: u, signal: {kind: steps, times: [0, 1], values: [2, 3]}}]\n"
    )
    expected = System(
        "swing",
        bodies=[RigidBody(name="rod", mass=1.0, inertia=(0.1, 0.1, 0.1))],
        constraints=[Revolute(name="hinge", body_j="rod", axis_i=(0.0, 0.0, 2.0))],
        forces=[Gravity(name="weight", acceleration=(0.0, -10.0, 0.0))],
        sensors=[JointAngle(name="angle", joint="hinge")],
        inputs=[Input(name="u", signal=Steps(times=(0.0, 1.0), values=(2.0, 3.0)))],
    )
    system = load(path)
    assert system.name == "swing"
    assert list(system.everything()) == list(expected.everything())


def test_the_name_defaults_to_that_of_the_file(model_file):
    assert load(model_file(ROD)).name == "model"


@pytest.mark.parametrize("kind", sorted(examples()))
def test_every_kind_survives_writing_and_reading(kind, model_file):
    for example in examples()[kind]:
        system = example().system
        again = load(model_file(dump(system)))
        assert declared(again) == declared(system)


def test_signals_and_parts_survive_and_defaults_are_left_out(model_file):
    path = (PathPoint(point=(0.0, 0.3, 0.0)), PathPoint(body="rod", point=(0.0, 0.0, 0.1)))
    muscle = ThelenMuscle(
        name="m",
        path=path,
        excitation="u",
        max_isometric_force=100.0,
        optimal_fibre_length=0.1,
        tendon_slack_length=0.1,
        curves=ThelenCurves(tendon_strain=0.033),
    )
    system = System(
        "parts",
        bodies=[RigidBody(name="rod", mass=0.1 + 0.2, inertia=(0.1, 0.1, 0.1))],
        forces=[muscle, RopeForce(name="rope", path=path, tension=1e-7)],
        inputs=[
            Input(name="u", signal=Harmonic(amplitude=0.5, frequency=2.0)),
            Input(name="w", signal=Constant(value=0.0)),
        ],
    )
    text = dump(system)
    assert declared(load(model_file(text))) == declared(system)  # 0.1 + 0.2 too: numbers are written in full
    plain = yaml.safe_load(text)["forces"][0]
    assert plain["curves"] == {"tendon_strain": 0.033}
    assert "pennation_angle" not in plain


def test_a_python_function_has_no_place_in_a_file(model_file):
    system = System("f", inputs=[Input(name="u", signal=Function(function=lambda t: (t, 1.0, 0.0)))])
    with pytest.raises(InputError, match="a model file cannot hold it"):
        dump(system)
    with pytest.raises(ModelError, match=r"line 4: 'u' in inputs: a signal of kind 'function' is Python code"):
        load(model_file(ROD + "inputs:\n  - {name: u, signal: {kind: function, function: f}}\n"))


def test_every_public_declaration_has_one_import_path():
    public = set(dms_core.model.__all__)
    for section in BRANCHES:
        for cls in kinds(section).values():
            if cls.__module__.startswith("dms_core."):
                assert cls.__name__ in public, f"dms_core.model does not export {cls.__name__}"


MISTAKES = {
    "unknown section": (
        ROD + "joints: []\n",
        r"unknown key 'joints' at the top\. Allowed: bodies, compositions",
    ),
    "unknown key": (
        ROD.replace("mass: 1.0", "mass: 1.0, weight: 3"),
        r"model.yaml, line 2: rigid_body 'rod': unknown key 'weight'\. Allowed: angular_velocity, centre_of_mass",
    ),
    "unknown kind": (
        ROD + "forces:\n  - {kind: gravitation, name: g}\n",
        r"line 4: 'g' in forces: unknown kind 'gravitation'\. Kinds of forces: .*first_order, gravity",
    ),
    "kind of another section": (
        ROD + "constraints:\n  - {kind: gravity, name: g}\n",
        r"unknown kind 'gravity'\. It belongs under 'forces'\.",
    ),
    "no kind": (ROD + "forces:\n  - {name: g}\n", r"line 4: 'g' in forces: 'kind' is missing"),
    "missing key": (ROD.replace("mass: 1.0, ", ""), r"line 2: rigid_body 'rod': 'mass' is missing"),
    "wrong type": (
        ROD.replace("mass: 1.0", "mass: heavy"),
        r"rigid_body 'rod': mass = 'heavy': Expected a number",
    ),
    "wrong part": (
        ROD + "forces:\n  - {kind: rope_force, name: r, tension: 1, path: [{point: [0, 0, 0]}, {bdy: rod}]}\n",
        r"rope_force 'r': path.1: PathPoint: unknown key 'bdy'\. Allowed: .* PathPoint: 'point' is missing\.$",
    ),
    "wrong signal": (
        ROD + "inputs:\n  - {name: u, signal: {kind: steps, times: [0, 1], values: [1]}}\n",
        r"line 4: input 'u': signal.steps: Steps: 2 times but 1 values; give one value for each time",
    ),
    "duplicate name": (
        ROD + "forces:\n  - {kind: gravity, name: rod}\n",
        r"model.yaml: the name 'rod' is used by a rigid_body and .*gravity; names must be unique",
    ),
    "misspelt body": (
        ROD + "constraints:\n  - {kind: revolute, name: hinge, body_j: rood}\n",
        r"model.yaml, line 4: revolute 'hinge': body 'rood' does not exist\. Declared: ground, rod",
    ),
    "misspelt input": (
        ROD + "forces:\n  - {kind: lumped_load, name: push, body: rod, input: pul}\n",
        r"model.yaml, line 4: lumped_load 'push': input 'pul' does not exist",
    ),
    "mapping for list": (ROD + "forces: {kind: gravity}\n", r"forces: Expected a list .*got \{'kind': 'gravity'\}"),
    "text for mapping": (ROD + "forces: [gravity]\n", r"'gravity' is not a mapping with the keys 'kind' and 'name'"),
    "number for name": ("name: 3\n" + ROD, r"name: Expected a text, got 3"),
    "key twice": (ROD + "bodies: []\n", r"line 3, column 1: the key 'bodies' stands twice"),
    "broken YAML": ("bodies: [\n", r"line 2, column 1 is not valid YAML: while parsing a flow node"),
    "tab": ("bodies:\n\t- a\n", r"line 2, column 1 is not valid YAML: .*'\\t'"),
    "python object": (
        "bodies: !!python/object/apply:os.getcwd []\n",
        r"line 1, column 9: the tag '!!python/object/apply:os.getcwd' is not read",
    ),
    "empty": ("", r"holds nothing\. Expected a mapping"),
    "list": ("- a\n", r"holds a list\. Expected a mapping"),
}


@pytest.mark.parametrize("mistake", MISTAKES)
def test_a_mistake_is_shown_with_its_place(mistake, model_file):
    text, message = MISTAKES[mistake]
    with pytest.raises(DmsError, match=message) as caught:
        load(model_file(text))
    assert "model.yaml" in str(caught.value)


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(InputError, match=r"nowhere.yaml' cannot be read: No such file"):
        load(tmp_path / "nowhere.yaml")


def test_bytes_that_are_no_text_are_named(tmp_path):
    path = tmp_path / "binary.yaml"
    path.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(InputError, match=r"binary.yaml' cannot be read: it is UTF-16 text"):
        load(path)


def test_scalars_are_read_as_written(model_file):
    found = read_yaml(model_file("a: 1e-5\nb: -2.5E3\nc: no\ne: true\nf: 3\ng: .5\nh: 1.\n"))
    numbers = {k: found[k] for k in "abegh"}
    assert numbers == {"a": 1e-5, "b": -2500.0, "e": True, "g": 0.5, "h": 1.0}
    assert found["c"] == "no" and found["f"] == 3 and isinstance(found["f"], int)


@pytest.mark.parametrize(
    ("text", "right"),
    [("010", 10.0), ("0o10", 8.0), ("1e1", 10.0), ("'1.8'", "mass = '1.8': Expected a number"),
     ("true", "mass = True: Expected a number"), ("1:30", "mass = '1:30': Expected a number"),
     ("1_000", "mass = '1_000'"), ("1" * 10_000, "has 10000 digits"), (".inf", "mass = inf: Expected a finite number"),
     ("1" + "0" * 29, 1e29), ("[1]", r"mass = \[1\]: Expected a number"), ("{a: 1}", "mass = {'a': 1}: Expected")],
)  # fmt: skip
def test_a_mass_is_a_number_of_yaml_1_2(text, right, model_file):
    path = model_file(ROD.replace("mass: 1.0", f"mass: {text}"))
    if isinstance(right, float):
        assert load(path).bodies[0].mass == right
    else:
        with pytest.raises(DmsError, match=f"model.yaml.* line 2.*{right}") as caught:
            load(path)
        assert len(str(caught.value)) < 400


def test_a_declaration_is_merged_from_another(model_file):
    system = load(model_file(ROD.replace("- {", "- &rod {") + "  - {<<: *rod, name: rod2, mass: 2}\n"))
    assert [(body.name, body.mass, body.inertia[:3]) for body in system.bodies] == [
        ("rod", 1.0, (0.1, 0.1, 0.1)),
        ("rod2", 2.0, (0.1, 0.1, 0.1)),
    ]


@pytest.mark.parametrize("name", ["1e5", "0o17", "010", "on", "~", "<<", "=", "2020-01-01", "1:30", "a: b", "#x", "é"])
def test_names_that_look_like_numbers_survive(name, model_file):
    system = System(name, bodies=[RigidBody(name=name, mass=1e16, inertia=(1e-7, 1e-7, 1e-7))])
    again = load(model_file(dump(system)))
    assert again.name == name and declared(again) == declared(system)


MANY = {
    "bodies": ("bodies:\n" + "  - {kind: point_mass, name: b, mass: 1.0}\n" * 14_000, "the name 'b' is used by"),
    "points": (
        ROD
        + "constraints:\n  - kind: rope_length\n    name: r\n    path:\n"
        + "      - {body: rod, poin: [0, 0, 0]}\n" * 12_000,
        "further mistakes",
    ),
    "times": (
        ROD + f"inputs: [{{name: u, signal: {{kind: steps, times: [{'x, ' * 45_000}], values: [{'1, ' * 45_000}]}}}}]",
        "further mistakes",
    ),
    "keys": (ROD + "forces: [{kind: gravity, " + "".join(f"k{k}: 1, " for k in range(40_000)) + "}]", "unknown key"),
    "sections": (ROD + "".join(f"k{k}: 1\n" for k in range(40_000)), "unknown key 'k0', 'k1', 'k10'"),
}


@pytest.mark.parametrize("many", MANY)
def test_many_mistakes_are_refused_at_once_and_briefly(many, model_file):
    text, words = MANY[many]
    path = model_file(text)
    begun = time.process_time()
    with pytest.raises(DmsError, match=words) as caught:
        load(path)
    assert time.process_time() - begun < 3.0  # 1 s on an idle core
    assert len(str(caught.value)) < 4100


def test_the_configuration_is_found_from_any_folder(monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    assert config_file("models/pendulum.yaml").is_file()
    assert configs().is_absolute()
    with pytest.raises(InputError, match=r"'models/nothing.yaml' does not exist.*andrews.yaml, atwood.yaml"):
        config_file("models/nothing.yaml")
