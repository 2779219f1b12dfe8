"""Trained variations in one table."""

import csv

import pytest
import yaml

pytest.importorskip("sb3_contrib")

from agents.__main__ import main
from agents.evaluation.episodes.episode import world_of
from agents.policies.learned import find_policy
from dms_core.errors import InputError
from tests.agents.tiny import SECTIONS, TRAINING

HIDDEN = "exo/HiddenIntent-v0"


@pytest.fixture(scope="module")
def trained(tmp_path_factory):
    """A list with two variations, and their trainings with two seeds."""
    folder = tmp_path_factory.mktemp("ablations")
    settings = {"patient": "stroke_mild", "episode_duration": 0.4, "action_mode": "assist_moment"}
    section = {**SECTIONS["ppo"], "n_timesteps": 64, "env_kwargs": {**settings, "observation": ["device"]}}
    content = {HIDDEN: section, "training": {"algorithm": "ppo", **TRAINING, "eval_every": 64}}
    (folder / "ppo.yml").write_text(yaml.safe_dump(content, sort_keys=False))
    listed = {"student": {"config": "ppo.yml"}}
    listed["clock"] = {"config": "ppo.yml", "set": ["env_kwargs.observation=[device, clock]"]}
    (folder / "list.yml").write_text(yaml.safe_dump(listed, sort_keys=False))
    for name, one in listed.items():
        for seed in "01":
            more = [x for change in one.get("set", ()) for x in ("--set", change)]
            command = ["train", "--config", str(folder / "ppo.yml"), "--seed", seed, *more]
            assert main([*command, "--out", str(folder / "runs" / f"{name}_{seed}")]) == 0
    return folder


def arguments(trained, out):
    return ["ablations", "--variations", str(trained / "list.yml"), "--runs", str(trained / "runs"), "--patients", "2",
            "--out", str(out)]  # fmt: skip


def test_a_row_a_variation_over_its_seeds(trained, tmp_path):
    out = tmp_path / "table"
    assert main(arguments(trained, out)) == 0
    head, *lines = (out / "ablations.csv").read_text().splitlines()
    rows = {row["variation"]: row for row in csv.DictReader(lines)}
    assert head.startswith("# python -m agents ablations --variations") and list(rows)[:2] == ["student", "clock"]
    assert [rows[name]["trainings"] for name in rows] == ["2", "2", *["1"] * (len(rows) - 2)] and "oracle" in rows
    assert rows["student"]["opponent"] in rows and rows["student"]["return"]
    assert "| student | 2 |" in (out / "ablations.md").read_text()


def test_a_policy_trained_with_the_clock_says_so(trained):
    told, blind = (find_policy(str(trained / "runs" / name)) for name in ("clock_0", "student_0"))
    assert told.informed and not blind.informed
    world_of(told, "mixed", HIDDEN).close()
    told.__dict__["informed"] = False
    with pytest.raises(InputError, match="sees the group 'clock', which reveals the plan"):
        world_of(told, "mixed", HIDDEN)


@pytest.mark.parametrize(
    ("more", "said"),
    [
        (["--seeds", "0", "2"], "student_2': there is no such folder"),
        (["--seeds", "1", "1"], "--seeds 1 1: expected one or more different seeds"),
        (["--env", "exo/ElbowLift-v2"], "hides the patient's plan"),
    ],
)
def test_bad_commands(trained, tmp_path, capsys, more, said):
    assert main([*arguments(trained, tmp_path / "table"), *more]) == 2
    assert said in capsys.readouterr().err and not (tmp_path / "table").exists()
