"""Every script in examples/ runs, and its answer is right where it can be told."""

from __future__ import annotations

import os
import re
import runpy
import subprocess
import sys

import pytest

from dms_core.files.config_files import configs

ROOT = configs().parent
EXAMPLES = ROOT / "examples"
ARGUMENTS = {"assist_by_gradient": ["1"]}
"""Of scripts that have a shorter way; the slow test runs them as they are."""


def answer(name: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> str:
    """What a script prints when it is run as the main module of this process, whose imports are done."""
    monkeypatch.setattr(sys, "argv", [f"{name}.py", *ARGUMENTS.get(name, [])])
    runpy.run_path(str(EXAMPLES / f"{name}.py"), run_name="__main__")
    return capsys.readouterr().out


def numbers(text: str, pattern: str) -> list[float]:
    return [float(x) for x in re.findall(pattern, text, re.MULTILINE)]


def falling(values: list[float]) -> bool:
    return all(a > b for a, b in zip(values[:-1], values[1:], strict=True))


CHECKS = {
    "own_patient": lambda said: max(numbers(said, r"'(0\.\d+)'")) < 1.0,
    "own_device": lambda said: falling(numbers(said, r"rms error (\S+) deg")[::-1]),
    "own_reward": lambda said: "'quiet': -" in said and "'reaction': 2.0" in said,
    "own_task": lambda said: "HoldAtSixty" in said and "device.tension" in said and "rewards" in said,
    # Water slows the fall of a limp arm.
    "own_element": lambda said: falling([abs(x) for x in numbers(said, r"(\S+) deg/s")]),
    "own_policy": lambda said: len(numbers(said, r"return (\S+)")) == 2,
    "curriculum": lambda said: falling([sum(numbers(line, r"\d\.\d\d?")[1:]) for line in said.splitlines()][::-1]),
    "batch": lambda said: "seed 7: True" in said,
    "readings": lambda said: "drawn: " in said,
    # The multiplier of the driver at rest is the moment of gravity.
    "inverse_dynamics": lambda said: len(set(numbers(said, r"(?:1\.4 s: +|gives )(\S+) Nm"))) == 1,
    # The device holds every weight at 60 deg; what muscles hold sinks as it grows.
    "arm_at_rest": lambda said: (
        said.count(" 60.00 deg (stable)") == 5
        and falling([float(x) for x in re.findall(r"kg   rests at +(\S+) deg", said)])
    ),
    "arm_modes": lambda said: "stable" in said and "gain 1.0000" in said,
    "muscles_from_motion": lambda said: max(numbers(said, r"rms error (\S+)$")) < 0.003,
    "pid_tuning": lambda said: falling(numbers(said, r"rms error (\S+) deg")),
    # A tenth of the first loss, by far.
    "swing_by_gradient": lambda said: numbers(said, r"(\d\S+\d)")[1] < 0.1 * numbers(said, r"(\d\S+\d)")[0],
    # Both ways learn something within seconds, on the patients that they train with.
    "assist_by_gradient": lambda said: all(
        x < 0.8 * numbers(said, r"assistance: cost (\S+)")[0] for x in numbers(said, r"^ +\d+\.\d s +\d+ +(\S+)")[-1:]
    ),
    "sb3_training": lambda said: len(numbers(said, r"20 episodes: (\S+)")) == 1,
}


def test_every_script_is_listed_and_run():
    scripts = {path.stem for path in EXAMPLES.glob("*.py")}
    assert scripts == set(CHECKS)
    listed = (EXAMPLES / "README.md").read_text()
    assert all(f"({name}.py)" in listed for name in scripts)


@pytest.mark.parametrize("name", list(CHECKS))
def test_the_answer_is_right(name, capsys, monkeypatch):
    if name in ("sb3_training", "assist_by_gradient"):
        pytest.importorskip("stable_baselines3")
    if name == "swing_by_gradient":
        pytest.importorskip("torch")
    said = answer(name, capsys, monkeypatch)
    assert CHECKS[name](said), said


@pytest.mark.slow
@pytest.mark.parametrize("name", list(CHECKS))
def test_it_needs_nothing_but_itself(name):
    """As it is called by hand, in a process that has imported nothing before."""
    if name in ("sb3_training", "assist_by_gradient", "swing_by_gradient"):
        pytest.importorskip("stable_baselines3")
    command, env = [sys.executable, str(EXAMPLES / f"{name}.py")], os.environ | {"PYTHONPATH": str(ROOT)}
    done = subprocess.run(command, cwd=ROOT, env=env, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert CHECKS[name](done.stdout), done.stdout
