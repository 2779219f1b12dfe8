"""Outputs of `python -m dms_core run` and `schema`: checked before the run, kept after it."""

import csv
import errno
import json
import os
import shutil
import subprocess
import sys
from importlib.util import find_spec

import numpy as np
import pytest

from dms_core import Model, simulate
from dms_core.__main__ import main
from dms_core.files import output_place
from dms_core.files.config_files import config_file
from dms_core.model_files.model_file import load
from dms_core.results import Result
from dms_core.simulation.dynamics import Simulation

PENDULUM = config_file("models/pendulum.yaml")
RUN = ["run", str(PENDULUM), "--t-end", "0.1", "--sample", "0.05"]


@pytest.fixture
def never(monkeypatch):
    """Fails where a run begins."""
    monkeypatch.setattr("dms_core.__main__.new_simulation", lambda *given: pytest.fail("the run began"))


def test_the_same_command_twice_needs_the_flag(tmp_path, capsys):
    for command in (
        [*RUN, "--out", str(tmp_path / "run.csv"), "--stats", str(tmp_path / "run.json")],
        ["schema", "--out", str(tmp_path / "reference.md")],
    ):
        assert [main(command), main(command), main([*command, "--overwrite"])] == [0, 2, 0]
        assert "exists; choose another name, or give --overwrite to replace it." in capsys.readouterr().err


@pytest.mark.parametrize(
    ("option", "content"),
    [("--stats", '{\n  "result": "mine",\n  "work": 1}\n'), ("--out", "time_s, my own data q.x\n1,2\n")],
)
def test_what_looks_like_a_result_is_not_replaced(never, tmp_path, capsys, option, content):
    mine = tmp_path / "mine"
    mine.write_text(content)
    others = [] if option == "--out" else ["--out", str(tmp_path / "x.csv")]
    assert main([*RUN, *others, option, str(mine)]) == 2 and mine.read_text() == content
    assert f"{option} '{mine}' exists" in capsys.readouterr().err


def test_the_model_is_not_overwritten(never, tmp_path, capsys):
    model = tmp_path / "m.yaml"
    shutil.copy(PENDULUM, model)
    before = model.read_bytes()
    for option in ("--out", "--stats"):
        others = [] if option == "--out" else ["--out", str(tmp_path / "x.csv")]
        assert main(["run", str(model), "--t-end", "1", option, str(model), "--overwrite", *others]) == 2
        assert f"{option} '{model}' is the input" in capsys.readouterr().err and model.read_bytes() == before


def test_a_table_of_others_is_not_overwritten(never, tmp_path, capsys):
    table = tmp_path / "excitations.csv"
    table.write_text("time_s,BIClong\n0,0.5\n")
    assert main([*RUN, "--out", str(table)]) == 2
    assert "exists; choose another name" in capsys.readouterr().err and table.read_text().endswith("0.5\n")


def test_one_file_does_not_take_both(never, tmp_path, capsys):
    assert main([*RUN, "--out", str(tmp_path / "x"), "--stats", str(tmp_path / "x")]) == 2
    assert "--out and --stats are the same file" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("out", "said"),
    [
        ("", "Expected the name of a file, got ''"), ("results/", "Expected the name of a file, got that of a folder"),
        ("a\0b", "Expected the name of a file"), ("x" * 256, "choose a shorter name"),
        ("new/" + "x" * 256, "at most 255"),
    ],
)  # fmt: skip
def test_names_that_are_none(never, tmp_path, capsys, monkeypatch, out, said):
    monkeypatch.chdir(tmp_path)
    try:
        status = main([*RUN, "--out", out])
    except SystemExit as end:
        status = end.code
    error = " ".join(capsys.readouterr().err.replace("│", "").split())
    assert status == 2 and said in error and list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("option", ["--sample", "--step"])
def test_a_table_that_is_too_large_is_refused_before_the_run(never, tmp_path, capsys, option):
    command = ["run", str(PENDULUM), "--t-end", "10", option, "1e-9", "--out", str(tmp_path / "x.csv")]
    assert main(command) == 2
    assert f"{option} 1e-09: 1e+10 rows of" in (said := capsys.readouterr().err) and "Expected at least" in said


def test_a_name_that_breaks_the_line_of_names_is_refused_before_the_run(never, tmp_path, capsys):
    model = tmp_path / "m.yaml"
    model.write_text(PENDULUM.read_text().replace("name: swing", 'name: "swing\\nangle"'))
    assert main(["run", str(model), "--t-end", "0.1", "--out", str(tmp_path / "x.csv")]) == 2
    assert "swing\\nangle" in capsys.readouterr().err


def test_a_name_with_a_comma_is_one_column(tmp_path):
    model, out = tmp_path / "m.yaml", tmp_path / "x.csv"
    model.write_text(PENDULUM.read_text().replace("name: swing", 'name: "swing, left"'))
    assert main(["run", str(model), "--t-end", "0.1", "--sample", "0.05", "--out", str(out)]) == 0
    with out.open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert float(rows[0]["swing, left.angle_rad"]) == pytest.approx(np.pi / 2)
    assert np.loadtxt(out, delimiter=",", skiprows=1).shape == (3, len(rows[0]))
    if find_spec("pandas"):
        import pandas

        assert pandas.read_csv(out).columns.tolist() == list(rows[0])


def test_a_full_disk_loses_no_run(tmp_path, capsys, monkeypatch):
    (tmp_path / "temporary").mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "temporary"))
    known = output_place._replace

    def full(target, content):
        if target.parent == tmp_path:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        known(target, content)

    monkeypatch.setattr(output_place, "_replace", full)
    assert main([*RUN, "--out", str(tmp_path / "run.csv"), "--stats", str(tmp_path / "run.json")]) == 1
    done = capsys.readouterr()
    (kept,) = (tmp_path / "temporary").iterdir()
    assert {p.name for p in kept.iterdir()} == {"run.csv", "run.json"} and f"written: {kept}" in done.out
    assert done.err.count("\n") == 1 and "No space left on device" in done.err and str(kept) in done.err


def test_ctrl_c_keeps_the_part_under_a_name_that_says_so(tmp_path, capsys, monkeypatch):
    known, calls = Simulation._advance, []

    def advance(self, t_end, progress, once):
        calls.append(1)
        known(self, 0.05, progress, once)
        raise KeyboardInterrupt

    monkeypatch.setattr(Simulation, "_advance", advance)
    out = tmp_path / "run.csv"
    out.write_text("time_s,q.x,v.x\n0,0,0\n")
    assert main([*RUN, "--out", str(out), "--overwrite"]) == 130
    part = tmp_path / "run.partial.csv"
    assert calls and capsys.readouterr().err.endswith(f"of 0.1 s are in '{part}'.\n")
    assert out.read_text() == "time_s,q.x,v.x\n0,0,0\n"
    assert np.loadtxt(part, delimiter=",", skiprows=1)[-1, 0] >= 0.05


def test_ctrl_c_before_anything_is_computed_says_so(tmp_path, capsys, monkeypatch):
    def advance(self, t_end, progress, once):
        raise KeyboardInterrupt

    monkeypatch.setattr(Simulation, "_advance", advance)
    assert main([*RUN, "--out", str(tmp_path / "run.csv")]) == 130
    assert capsys.readouterr().err == "stopped: nothing was written.\n" and list(tmp_path.iterdir()) == []


def test_a_stopped_run_that_had_to_succeed_stops_its_caller(monkeypatch):
    trajectory = simulate(Model(load(PENDULUM)), 0.01)
    trajectory.result = Result.INTERRUPTED
    with pytest.raises(KeyboardInterrupt):
        trajectory.check()


@pytest.mark.skipif(not os.path.exists("/dev/stdout"), reason="this system has no /dev/stdout")
def test_a_table_on_standard_output_is_nothing_but_a_table():
    done = subprocess.run(
        [sys.executable, "-m", "dms_core", *RUN, "--out", "/dev/stdout", "--stats", "/dev/null"],
        capture_output=True, text=True, check=True,
    )  # fmt: skip
    assert len(done.stdout.splitlines()) == 4 and "result: SUCCESS" in done.stderr
    with pytest.raises(ValueError):
        json.loads(done.stdout)
