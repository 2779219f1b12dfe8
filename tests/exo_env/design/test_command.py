"""The command `design` from end to end, its files in other commands and environments, and its errors."""

import csv

import gymnasium
import pytest
import yaml

import exo_env.commands.design as command
from exo_env.__main__ import main
from exo_env.design.comparison import HEAD, QUANTITIES
from exo_env.ecosystem.exoskeleton import Exoskeleton
from tests.exo_env.design.cases import EXERCISE


@pytest.fixture
def tiny(tmp_path):
    """Arguments of a search that takes a second: one patient, one iteration, a fifth of a second."""
    (tmp_path / "exercise.yaml").write_text(yaml.safe_dump(EXERCISE))
    (tmp_path / "bounds.yaml").write_text("ropes.agonist.lower.1: [-0.09, -0.06]\nguide_distance: [0.13, 0.19]\n")
    return [
        "design", "--out", str(tmp_path / "out"), "--exercise", str(tmp_path / "exercise.yaml"), "--bounds",
        str(tmp_path / "bounds.yaml"), "--patients", "1", "--held-out", "1", "--iterations", "1",
    ]  # fmt: skip


def test_from_end_to_end(tiny, tmp_path, capsys):
    assert main([*tiny, "--cuff", "compliant"]) == 0
    printed, out = capsys.readouterr().out, tmp_path / "out"
    assert "\nThe iterations are spent" in printed
    assert "iteration 1: " in printed and "ropes.agonist.lower.1" in printed and "held out, 1 patients" in printed
    assert {"device.yaml", "cuff.yaml", "design.csv", "devices.png"} < {path.name for path in out.iterdir()}
    with (out / "design.csv").open(newline="") as file:
        head, *rows = csv.reader(file)
    assert tuple(head) == HEAD and [row[1] for row in rows] == 2 * list(QUANTITIES)
    today, found = (float(x) for x in rows[0][3:5])
    assert found < today and f"{100.0 * (found / today - 1.0):.1f}" == f"{float(rows[0][5]):.1f}"
    device, cuff = str(out / "device.yaml"), yaml.safe_load((out / "cuff.yaml").read_text())
    for name in ("device.yaml", "cuff.yaml"):
        assert (out / name).read_text().startswith("# Found by 'python -m exo_env design' for the least ")
    read = Exoskeleton.named(device)
    assert read.ropes["agonist"].lower[1] < -0.0725 and read.gains.kp < Exoskeleton.named("elbow").gains.kp
    env = gymnasium.make("exo_env:exo/ElbowLift-v2", exoskeleton=device, cuff=cuff)
    env.reset(seed=0)
    env.step(env.action_space.sample())
    assert main(["soak", "--steps", "2", "--exoskeleton", device]) == 0


def test_stopped_keeps_the_best_so_far(tiny, tmp_path, capsys, monkeypatch):
    known, calls = command.search.__globals__["mean_gradient"], []

    def mean_gradient(*given):
        calls.append(1)
        if len(calls) == 3:
            raise KeyboardInterrupt
        return known(*given)

    monkeypatch.setattr("exo_env.design.search.mean_gradient", mean_gradient)
    assert main([*tiny[:-1], "9"]) == 130
    assert "the best design of 3 evaluations is kept in" in capsys.readouterr().err
    out = tmp_path / "out"
    assert Exoskeleton.named(str(out / "device.yaml")).ropes["agonist"].lower[1] < -0.0725
    assert not (out / "design.csv").exists()


def test_a_run_that_fails_today_is_a_sentence(tiny, capsys, monkeypatch):
    def fails(*given):
        raise command.SimulationError("patient 1: no.")

    monkeypatch.setattr("exo_env.design.search.mean_gradient", fails)
    assert main(tiny) == 1
    assert "The analysis failed: patient 1: no." in capsys.readouterr().err


def test_a_found_cuff_can_be_designed_further(tiny, tmp_path, monkeypatch):
    begun = []

    def search(space, *given):
        begun.append(space.today.cuff)
        raise command.SimulationError("seen.")

    (tmp_path / "cuff.yaml").write_text("stiffness: [2000, 2250, 3150, 10.6, 2, 12]\n")
    monkeypatch.setattr(command, "search", search)
    assert main([*tiny, "--cuff", str(tmp_path / "cuff.yaml")]) == 1
    assert begun[0].stiffness[0] == 2000.0


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--objective", "comfort"], "objective = 'comfort': expected one of"),
        (["--population", "giants"], "unknown population 'giants'"),
        (["--cuff", "soft"], "cuff = 'soft': expected one of compliant, rigid, or a YAML file"),
        (["--cuff", "missing.yaml"], "missing.yaml"),
        (["--exoskeleton", "knee"], "exoskeleton = 'knee': expected one of"),
        (["--exoskeleton", "missing.yaml"], "missing.yaml"),
        (["--patients", "0"], "--patients 0: expected a whole number from 1"),
        (["--held-out", "-1"], "--held-out -1: expected a whole number from 0"),
        (["--iterations", "0"], "--iterations 0: expected a whole number from 1"),
        (["--seed", "-1"], "--seed -1: expected a whole number from 0"),
        (["--weight", "0"], "weight = 0"),
        (["--shift", "0.5", "0", "0"], "shift"),
        (["--subject", "arm27"], "subject = 'arm27'"),
    ],
)
def test_bad_input_is_refused_before_the_work(options, message, tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(command, "search", lambda *given: pytest.fail("the work began"))
    assert main(["design", "--out", str(tmp_path / "out"), *options]) == 2
    assert message in capsys.readouterr().err


@pytest.mark.slow
def test_the_shipped_exercise_for_each_objective(tmp_path):
    for name in ("peak_tension", "elbow_reaction", "motor_power"):
        out = tmp_path / name
        options = ["--objective", name, "--patients", "2", "--held-out", "2", "--iterations", "4"]
        assert main(["design", "--out", str(out), *options]) == 0
        with (out / "design.csv").open(newline="") as file:
            rows = list(csv.DictReader(file))
        quantity = {"peak_tension": "peak rope tension", "elbow_reaction": "peak elbow reaction"}.get(
            name, "RMS motor power"
        )
        for row in rows:
            if row["quantity"] == quantity:
                assert float(row["found"]) < float(row["today"]), (name, row)
