"""Lists of variations: what they hold, every mistake by file and variation, and the shipped list."""

from pathlib import Path

import pytest

pytest.importorskip("sb3_contrib")

from agents.distributed.sweep import in_order, planned
from agents.distributed.variations import Variation, folder_of, read_variations
from dms_core.errors import InputError
from dms_core.files.config_files import configs
from tests.agents.tiny import config_file

SHIPPED = configs() / "ablations" / "hidden_intent.yml"


def listed(folder, text):
    path = folder / "list.yml"
    path.write_text(text)
    return path


def test_a_variation_is_a_file_with_changes(tmp_path):
    path = listed(tmp_path, "plain: {config: a.yml}\nquick: {config: sub/b.yml, set: [n_timesteps=64, gamma=0.9]}\n")
    assert read_variations(path) == [
        Variation("plain", tmp_path / "a.yml"),
        Variation("quick", tmp_path / "sub" / "b.yml", ("n_timesteps=64", "gamma=0.9")),
    ]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("{}", "expected one or more variations, got none"),
        ("quick: a.yml", "variation 'quick' = .*a.yml.*: expected {config: FILE, set:"),
        ("quick: {set: [a=1]}", "variation 'quick' = .*: expected {config"),
        ("quick: {config: a.yml, seeds: [1]}", "variation 'quick' = .*: expected {config"),
        ("quick: {config: a.yml, set: gamma=0.9}", "variation 'quick' = .*: expected {config"),
        ("quick: {config: a.yml, set: [3]}", "variation 'quick' = .*: expected {config"),
        ("quick: {config: 3}", "variation 'quick' = .*: expected {config"),
        ("../up: {config: a.yml}", "variation '../up': expected a name of small letters"),
        ("3: {config: a.yml}", "list.yml.*"),
    ],
)
def test_mistakes_name_file_and_variation(tmp_path, text, said):
    with pytest.raises(InputError, match=said) as error:
        read_variations(listed(tmp_path, text))
    assert "list.yml" in str(error.value)


def test_changes_are_made_and_folders_bear_the_name(tmp_path):
    config_file(tmp_path)
    path = listed(tmp_path, "plain: {config: ppo.yml}\nlong: {config: ppo.yml, set: [n_timesteps=256]}\n")
    shares = planned((), (0, 1), ("gamma=0.5",), tmp_path / "out", None, read_variations(path))
    assert [Path(folder).name for _, _, folder in shares] == ["plain_0", "plain_1", "long_0", "long_1"]
    sections = [next(iter(content.values())) for content, _, _ in shares]
    assert [(s["n_timesteps"], s["gamma"]) for s in sections] == [(128, 0.5)] * 2 + [(256, 0.5)] * 2
    with pytest.raises(InputError, match="variation 'wrong': .*wings"):
        planned((), (0,), (), tmp_path, None, [Variation("wrong", tmp_path / "ppo.yml", ("env_kwargs.wings=2",))])
    with pytest.raises(InputError, match="two trainings would share a folder"):
        planned((tmp_path / "ppo.yml",), (0,), (), tmp_path, None, [Variation("ppo", tmp_path / "ppo.yml")])


def test_what_learns_from_another_variation_waits_for_it(tmp_path):
    agents = configs() / "agents" / "hidden_intent"
    text = (
        f"student: {{config: {agents / 'student.yml'}, set: ['training.imitation.teacher=../teacher_{{seed}}']}}\n"
        f"teacher: {{config: {agents / 'teacher.yml'}}}\n"
    )
    groups = in_order(planned((), (0, 1), (), tmp_path, None, read_variations(listed(tmp_path, text))))
    order = {Path(folder).name: k for k, group in enumerate(groups) for _, _, folder in group}
    assert order == {"teacher_0": 0, "teacher_1": 0, "student_0": 1, "student_1": 1}
    (content,) = (c for group in groups for c, _, folder in group if Path(folder).name == "student_1")
    assert content["training"]["imitation"]["teacher"] == str(folder_of(tmp_path, "teacher", 1))


def test_the_shipped_list_can_be_trained(tmp_path):
    variations = read_variations(SHIPPED)
    shares = planned((), (0, 1), (), tmp_path, None, variations)
    contents = {Path(folder).name: content for content, _, folder in shares}
    assert len(contents) == 2 * len(variations)
    sections = {n: next(v for k, v in c.items() if k != "training") for n, c in contents.items()}
    settings = {name: section["env_kwargs"] for name, section in sections.items()}
    assert settings["clock_0"]["observation"] == ["device", "clock"] and settings["mixed_1"]["patient"] == "mixed"
    assert settings["one_patient_0"]["patient"]["strength"] == 0.81
    assert settings["impedance_1"]["action_mode"] == "impedance" and settings["emg_0"]["observation"][1] == "emg"
    assert not contents["no_memory_0"]["training"]["traces"] and not contents["blind_critic_0"]["training"]["critic"]
    assert {s["n_timesteps"] for n, s in sections.items() if not n.startswith("imitation")} == {1500000}
