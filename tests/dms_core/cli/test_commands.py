"""check, run and schema: what they print, what they write, and how they end."""

from __future__ import annotations

import io
import json
import math
import os
import stat
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from tqdm import tqdm

from dms_core import SolverOptions, simulate
from dms_core.command_line import BAR, FAILED_RUN, USER_MISTAKE, moves
from dms_core.files.config_files import config_file, configs
from dms_core.files.output_file import with_unit, write_csv, write_file
from dms_core.model_files.model_file import load
from dms_core.model_files.schema import reference
from tests.dms_core.cli.tables import read

ROOT = configs().parent
PENDULUM = config_file("models/pendulum.yaml")
FOUR_BAR = config_file("models/four_bar.yaml")


class TestCheck:
    def test_counts_and_names(self, command):
        done = command("check", FOUR_BAR)
        assert done.status == 0
        lines = done.out.splitlines()
        # 3 bodies of 7 coordinates; 3 norms, 4 hinges of 5 rows, 1 driver; a plane loop repeats 3 rows; 0 freedoms.
        for line in ("coordinates: 21", "constraint rows: 24", "rank: 21", "degrees of freedom: 0", "bodies: 3"):
            assert line in lines
        assert "  rocker (rigid_body)" in lines
        redundant = next(x for x in lines if x.startswith("redundant rows: ")).removeprefix("redundant rows: ")
        assert len(redundant.split(", ")) == 3 and "none" not in redundant
        assert all(name.rpartition(".")[2] in ("z", "tilt_f", "tilt_g") for name in redundant.split(", "))

    def test_no_redundant_rows(self, command):
        out = command("check", PENDULUM).out
        assert "redundant rows: none" in out and "degrees of freedom: 1" in out

    def test_assembly_says_how_far_it_moved_the_start(self, command, tmp_path):
        moved = tmp_path / "moved.yaml"
        text = PENDULUM.read_text().replace("body_j: rod,", "body_j: rod, point_j: [0.0, 0.01, 0.0],")
        moved.write_text(text)
        line = command("check", moved).out.splitlines()[-1]
        # The hinge is declared 10 mm off the body's origin, in line with the rod: the rod shifts by that along x.
        assert line == "assembly moved the declared start by at most 0.01 (m or -)"

    def test_a_wrong_model_is_named_with_its_file(self, command, tmp_path):
        wrong = tmp_path / "wrong.yaml"
        wrong.write_text(PENDULUM.read_text().replace("body_j: rod", "body_j: rood"))
        done = command("check", wrong)
        assert done.status == USER_MISTAKE and done.out == ""
        assert (
            f"error: {wrong}, line 11: revolute 'hinge': body 'rood' does not exist. Declared: ground, rod." in done.err
        )


class TestRun:
    def test_table_and_statistics(self, command, tmp_path):
        out, stats = tmp_path / "new" / "run.csv", tmp_path / "stats.json"
        done = command(
            "run", PENDULUM, "--t-end", 0.35, "--rtol", 1e-6, "--sample", 0.1, "--out", out, "--stats", stats
        )
        assert done.status == 0
        columns = read(out)
        np.testing.assert_allclose(columns["time_s"], [0.0, 0.1, 0.2, 0.3, 0.35], rtol=1e-12)  # as printed, 12 digits
        assert {"swing.angle_rad", "swing.rate_rad_per_s", "swing.acceleration_rad_per_s2"} <= columns.keys()
        assert {"bearing.Fx_N", "bearing.Mz_Nm", "q.rod.x", "q.rod.p3", "v.rod.x", "v.rod.p3"} <= columns.keys()
        # The columns belong together: x = sin(angle) / 2; dense output leaves the constraint by about the tolerance.
        np.testing.assert_allclose(columns["q.rod.x"], 0.5 * np.sin(columns["swing.angle_rad"]), atol=1e-5)
        written = json.loads(stats.read_text())
        assert written["result"] == "SUCCESS" and written["steps"] > 10 and written["largest_phi"] < 1e-9
        assert f"steps: {written['steps']}" in done.out and f"written: {out}" in done.out

    def test_without_sample_the_rows_are_the_solvers_steps(self, command, tmp_path):
        out, stats = tmp_path / "run.csv", tmp_path / "stats.json"
        command("run", PENDULUM, "--t-end", 0.2, "--out", out, "--stats", stats)
        t = read(out)["time_s"]
        assert len(t) == json.loads(stats.read_text())["steps"] + 1
        assert t[0] == 0.0 and t[-1] == 0.2 and np.all(np.diff(t) > 0.0)

    def test_a_multiple_of_the_sample_at_the_end_counts(self, command, tmp_path):
        out = tmp_path / "run.csv"
        command("run", PENDULUM, "--t-end", 0.3, "--sample", 0.1, "--out", out)
        assert read(out)["time_s"].tolist() == [0.0, 0.1, 0.2, 0.3]  # 3 x 0.1 is just above 0.3 in binary

    @pytest.mark.parametrize("method", ["bdf2", "sdirk2", "radau5"])
    def test_each_method_swings_the_pendulum_alike(self, command, tmp_path, method):
        out, stats = tmp_path / "run.csv", tmp_path / "stats.json"
        done = command("run", PENDULUM, "--t-end", 0.5, "--method", method, "--rtol", 1e-7, "--out", out,
                       "--stats", stats)  # fmt: skip
        assert done.status == 0
        columns, exact = read(out), simulate(load(PENDULUM), 0.5, SolverOptions(rtol=1e-11, method="radau5")).check()
        # The methods of order 2 err by 1e-6.
        for k, name in enumerate(exact.model.layout.names):
            assert abs(columns[f"q.{name}"][-1] - exact.q[-1, k]) < 1e-5, name
        assert (json.loads(stats.read_text())["steps"] < 100) == (method == "radau5")

    def test_a_failed_run_writes_what_it_has(self, command, tmp_path):
        out, stats = tmp_path / "run.csv", tmp_path / "stats.json"
        # Steps of 0.5 s turn the crank by more than Newton's method can follow.
        done = command("run", FOUR_BAR, "--t-end", 2, "--step", 0.5, "--out", out, "--stats", stats)
        assert done.status == FAILED_RUN
        assert "The run failed: Newton's method did not converge" in done.err and f"'{out}' holds the part" in done.err
        columns = read(out)
        assert 1 < len(columns["time_s"]) and columns["time_s"][-1] < 2.0
        assert all(np.all(np.isfinite(x)) for x in columns.values())
        assert json.loads(stats.read_text())["result"] == "NEWTON_FAILED"

    @pytest.mark.parametrize("sample", [(), ("--sample", 0.1)])
    def test_a_failed_run_can_be_sampled_too(self, command, tmp_path, sample):
        out = tmp_path / "run.csv"
        done = command("run", FOUR_BAR, "--t-end", 2, "--step", 0.5, "--out", out, *sample)
        assert done.status == FAILED_RUN and len(read(out)["time_s"]) > 1

    @pytest.mark.parametrize(
        ("option", "value", "message"),
        [
            ("--rtol", 0, "--rtol: Expected a positive number, got 0.0"),
            ("--rtol", -1e-5, "--rtol: Expected a positive number, got -1e-05"),
            ("--rtol", "nan", "--rtol: Expected a positive number, got nan"),
            ("--t-end", 0, "--t-end: Expected a positive time [s], got 0.0"),
            ("--t-end", "inf", "--t-end: Expected a positive time [s], got inf"),
            ("--sample", -0.1, "--sample: Expected a positive time [s], got -0.1"),
            ("--step", 0, "--step: Expected a positive number, got 0.0"),
            ("--step", -1, "--step: Expected a positive number, got -1.0"),
            ("--step", "nan", "--step: Expected a positive number, got nan"),
            ("--step", 5, "--step: Expected at most --t-end = 0.1 s, got 5.0 s"),
            ("--sample", 5, "--sample: Expected at most --t-end = 0.1 s, got 5.0 s"),
            ("--sample", "nan", "--sample: Expected a positive time [s], got nan"),
            ("--t-end", -1, "--t-end: Expected a positive time [s], got -1.0"),
        ],
    )
    def test_numbers_out_of_range(self, command, tmp_path, option, value, message):
        out = tmp_path / "folder" / "run.csv"
        arguments = {"--t-end": 0.1, "--out": out} | {option: value}
        done = command("run", PENDULUM, *(x for pair in arguments.items() for x in pair))
        assert done.status == USER_MISTAKE and message in done.err
        assert list(tmp_path.iterdir()) == []

    def test_text_for_a_number_is_refused(self, command, tmp_path):
        done = command("run", PENDULUM, "--t-end", "long", "--out", tmp_path / "x.csv")
        assert done.status == 2 and "--t-end" in done.err and list(tmp_path.iterdir()) == []


class TestOutputPlace:
    def test_a_file_in_the_way_of_the_folder(self, command, tmp_path):
        (tmp_path / "file").write_text("here first")
        done = command("run", "no_such_model.yaml", "--t-end", 1, "--out", tmp_path / "file" / "run.csv")
        # Said before the model is even read: nobody waits for a run whose result has no place.
        assert done.status == USER_MISTAKE and f"'{tmp_path / 'file'}' is a file, not a folder" in done.err
        assert (tmp_path / "file").read_text() == "here first"

    def test_a_folder_in_place_of_the_file(self, command, tmp_path):
        done = command("run", PENDULUM, "--t-end", 1, "--out", tmp_path)
        assert done.status == USER_MISTAKE and "is a folder; give the name of a file in it" in done.err

    @pytest.mark.parametrize("option", ["--out", "--stats"])
    def test_a_folder_that_cannot_be_written(self, command, tmp_path, option):
        closed = Path("/proc/none") if os.geteuid() == 0 else tmp_path / "closed"  # root may write anywhere but there
        if os.geteuid() != 0:
            closed.mkdir()
            closed.chmod(stat.S_IRUSR | stat.S_IXUSR)
        arguments = {"--t-end": 0.1, "--out": tmp_path / "run.csv"} | {option: closed / "x"}
        done = command("run", PENDULUM, *(x for pair in arguments.items() for x in pair))
        assert done.status == USER_MISTAKE and f"the folder '{closed}' cannot be written" in done.err
        assert "choose another place" in done.err and not (tmp_path / "run.csv").exists()

    def test_nothing_half_written_is_left(self, tmp_path):
        path = tmp_path / "table.csv"
        path.write_text("old\n")

        def content(file):
            file.write(b"half of the new")
            raise RuntimeError

        with pytest.raises(RuntimeError):
            write_file(path, content)
        assert path.read_text() == "old\n" and list(tmp_path.iterdir()) == [path]

    def test_a_whole_file_replaces_the_old_one(self, tmp_path):
        path = tmp_path / "table.csv"
        path.write_text("old\n")
        write_csv(path, {"time_s": np.array([0.0, 1.0 / 3.0]), "x_m": np.array([1e-20, -2.0])})
        assert path.read_text() == "time_s,x_m\n0,1e-20\n0.333333333333,-2\n"
        assert list(tmp_path.iterdir()) == [path]


def test_unit_suffixes():
    assert with_unit("a", "rad/s^2") == "a_rad_per_s2"
    assert with_unit("a", "N m") == "a_Nm"
    assert with_unit("a", "-") == with_unit("a", "") == "a"


class TestSchema:
    def test_the_committed_reference_is_that_of_the_code(self, command):
        # In a process of its own: element classes that tests define are kinds too.
        fresh = subprocess.run(
            [sys.executable, "-m", "dms_core", "schema"], cwd=ROOT, capture_output=True, text=True, check=True
        ).stdout
        committed = (ROOT / "docs" / "model-files.md").read_text()
        assert committed == fresh, "docs/model-files.md is out of date; run `make docs`"

    def test_it_can_be_written_to_a_file(self, command, tmp_path):
        assert command("schema", "--out", tmp_path / "reference.md").status == 0
        assert (tmp_path / "reference.md").read_text() == reference()

    def test_every_key_has_a_meaning(self):
        rows = [line for line in reference().splitlines() if line.startswith("| `")]
        assert len(rows) > 100
        assert [row for row in rows if not row.rsplit("|", 2)[1].strip()] == []

    def test_sensor_components_carry_units(self):
        assert "Components: `angle` [rad], `rate` [rad/s], `acceleration` [rad/s^2]." in reference()


@pytest.mark.parametrize("name", ["", "check", "run", "schema"])
def test_help(command, name):
    done = command(*([name] if name else []), "--help")
    assert done.status == 0 and "usage: python -m dms_core" in done.out


def test_the_progress_bar_shows_simulated_time():
    shown = io.StringIO()
    with tqdm(total=4.0, file=shown, bar_format=BAR, mininterval=0.0, miniters=0) as bar:
        progress = moves(bar)
        progress(1.0)
        progress(3.0)
        assert math.isclose(bar.n, 3.0)
    assert "75%" in shown.getvalue() and "3 of 4 s simulated" in shown.getvalue()


def test_a_module_run_exits_with_the_status():
    done = subprocess.run(
        [sys.executable, "-m", "dms_core", "check", "none.yaml"], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert done.returncode == USER_MISTAKE
    assert done.stderr == "error: file 'none.yaml' cannot be read: No such file or directory.\n"
