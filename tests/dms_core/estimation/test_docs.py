"""The commands of docs/estimation.md run as they stand there, and give what the page says."""

from __future__ import annotations

import json
import shlex

import numpy as np
import pytest

from dms_core.__main__ import main
from dms_core.files.config_files import configs
from tests.dms_core.cli.tables import read

ROOT = configs().parent


def commands() -> list[list[str]]:
    """Arguments of each command of the page."""
    page = (ROOT / "docs" / "estimation.md").read_text(encoding="utf-8")
    blocks = page.split("```sh\n")[1:]
    text = "\n".join(block.partition("```")[0].replace("\\\n", " ") for block in blocks)
    return [shlex.split(line)[3:] for line in text.splitlines() if line.strip()]


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    """The folder with what all commands have written."""
    folder = tmp_path_factory.mktemp("docs")
    for arguments in commands():
        there = [str(ROOT / a) if a.startswith("configs/") else str(folder / a) if a.startswith("out/") else a
                 for a in arguments]  # fmt: skip
        assert main(there) == 0
    return folder / "out"


def test_there_are_commands_for_both():
    assert [c[0] for c in commands()] == ["observability", "observability", "estimate"]


def test_the_angle_alone_does_not_tell_both_muscles(written):
    table = read(written / "angle_alone.csv")
    assert table["singular_value"][-1] == pytest.approx(0.007, abs=0.001)
    weakest = {name: x[-1] for name, x in table.items() if name != "singular_value"}
    largest = sorted(weakest, key=lambda name: -abs(weakest[name]))[:2]
    assert set(largest) == {"q.extensor.activation", "q.flexor.activation"}
    both = json.loads((written / "angle_and_emg.json").read_text())
    assert both["rank"] == len(both["states"]) == 8
    assert both["directions"][-1]["singular_value"] > 9.0 * table["singular_value"][-1]


def test_the_forces_come_out_as_the_page_says(written):
    found, truth = read(written / "forearm.csv"), np.genfromtxt(FORCES, delimiter=",", names=True)
    for muscle, error in (("flexor", 12.0), ("extensor", 10.0)):
        name = f"{muscle} force.tendon_force_N"
        e = np.interp(truth["time_s"], found["time_s"], found[name]) - truth[f"{muscle}_N"]
        # Rounding of the recorded truth, and of the page.
        assert np.sqrt(np.mean(e**2)) == pytest.approx(error, abs=0.6)
        deviation = np.interp(truth["time_s"], found["time_s"], found[f"deviation.{name}"])
        assert np.mean(np.abs(e) < 2.0 * deviation) > 0.93
    stats = json.loads((written / "forearm.json").read_text())
    assert stats["divergences"] == 0
    assert stats["mean NIS per reading"] == pytest.approx(0.83, abs=0.01)


FORCES = ROOT / "tests" / "dms_core" / "estimation" / "forearm_forces.csv"
"""True forces behind configs/estimation/recording.csv."""
