"""static, kinematic, inverse and modes on the command line: what they write, and how they end."""

from __future__ import annotations

import json
import math
import os
import subprocess
import sys

import numpy as np
import pytest

from dms_core.command_line import FAILED_RUN, USER_MISTAKE
from dms_core.files.config_files import config_file, configs
from dms_core.model_files.model_file import dump
from tests.dms_core.analyses.mechanisms import von_mises_truss
from tests.dms_core.cli.tables import read

PENDULUM = config_file("models/pendulum.yaml")
FOUR_BAR = config_file("models/four_bar.yaml")
SPRING = config_file("models/spring_mass.yaml")
ATWOOD = config_file("models/atwood.yaml")


class TestStatic:
    def test_the_pendulum_hangs(self, command, tmp_path):
        out, stats = tmp_path / "rest.csv", tmp_path / "rest.json"
        done = command("static", PENDULUM, "--out", out, "--stats", stats)
        assert done.status == 0
        assert "The equilibrium is stable." in done.out and f"written: {out}" in done.out
        table = read(out)
        assert table["swing.angle_rad"][-1] == pytest.approx(0.0, abs=1e-9)
        assert table["bearing.Fy_N"][-1] == pytest.approx(9.81, rel=1e-9)
        assert table["stable"][-1] == 1.0 and "v.rod.x" not in table
        found = json.loads(stats.read_text())
        assert found["stable"] is True and len(found["eigenvalues"]) == 2

    def test_the_truss_snaps_through(self, command, tmp_path):
        model, out, stats = (tmp_path / name for name in ("truss.yaml", "path.csv", "path.json"))
        model.write_text(dump(von_mises_truss(1.0, 0.3, 1000.0, 20.0)))
        done = command("static", model, "--loads", "P", "--follow", "--to", 1, "--out", out, "--stats", stats)
        assert done.status == 0
        assert done.out.count("limit point at load factor") == 2
        table = read(out)
        assert table["load_factor"].min() < -0.4 and table["load_factor"][-1] == pytest.approx(1.0)
        events = json.loads(stats.read_text())["events"]
        assert [e["kind"] for e in events] == ["limit point", "limit point"]

    def test_no_equilibrium_is_a_failure_with_nothing_written(self, command, tmp_path):
        out = tmp_path / "rest.csv"
        done = command("static", ATWOOD, "--out", out)
        assert done.status == FAILED_RUN
        assert (
            "The analysis failed: no equilibrium was found" in done.err and "'heavy' moves along (0, 1, 0)" in done.err
        )
        assert not out.exists()

    @pytest.mark.parametrize(
        ("options", "said"),
        [
            (["--loads", "wind"], "load 'wind': Expected an input, or a force element"),
            (["--steps", 3], "loads: Expected the names of the loads"),
            (["--time", -1], "--time: Expected a time of at least 0 s, got -1"),
            (["--follow", "--steps", 2], "--steps: Expected none beside --follow"),
        ],
    )
    def test_wrong_options(self, command, tmp_path, options, said):
        done = command("static", PENDULUM, "--out", tmp_path / "rest.csv", *options)
        assert done.status == USER_MISTAKE and said in done.err


class TestKinematic:
    def test_table_and_statistics(self, command, tmp_path):
        out, stats = tmp_path / "bars.csv", tmp_path / "bars.json"
        done = command("kinematic", FOUR_BAR, "--t-end", 2, "--sample", 0.05, "--out", out, "--stats", stats)
        assert done.status == 0
        table = read(out)
        assert len(table["time_s"]) == 41 and table["time_s"][-1] == 2.0
        assert "motor.load_Nm" in table
        assert table["crank_angle.angle_rad"][20] == pytest.approx(-math.pi, abs=1e-9) or table[
            "crank_angle.angle_rad"
        ][20] == pytest.approx(math.pi, abs=1e-9)
        assert json.loads(stats.read_text())["failure"] == ""

    def test_a_missing_driver(self, command, tmp_path):
        done = command("kinematic", PENDULUM, "--t-end", 1, "--sample", 0.1, "--out", tmp_path / "x.csv")
        assert done.status == USER_MISTAKE
        assert "1 driver is missing: nothing determines that 'rod' turns about (0, 0, 1)" in done.err
        assert list(tmp_path.iterdir()) == []

    def test_a_motion_that_ends_early_is_kept_and_told(self, command, tmp_path):
        model, out = tmp_path / "beyond.yaml", tmp_path / "beyond.csv"
        # From its start at 1.98 rad the rocker cannot come below 1.77 rad.
        text = FOUR_BAR.read_text().replace("joint: main_bearing, input: turn", "joint: rocker_bearing, input: turn")
        model.write_text(text.replace("values: [0.0, 6.283185307179586]", "values: [1.98231317286, 1.0]"))
        done = command("kinematic", model, "--t-end", 2, "--sample", 0.05, "--out", out)
        assert done.status == FAILED_RUN
        assert "cannot reach beyond t = " in done.err and f"'{out}' holds the part before." in done.err
        assert 2 < len(read(out)["time_s"]) < 40

    def test_a_sample_that_would_fill_memory(self, command, tmp_path):
        done = command("kinematic", FOUR_BAR, "--t-end", 2, "--sample", 1e-9, "--out", tmp_path / "x.csv")
        assert done.status == USER_MISTAKE
        assert "--sample 1e-09: 2e+09 rows of" in done.err and "for a table of at most 0.5 GiB" in done.err


class TestInverse:
    def test_nothing_drives_a_free_pendulum(self, command, tmp_path):
        run, out, stats = (tmp_path / name for name in ("run.csv", "loads.csv", "loads.json"))
        command("run", PENDULUM, "--t-end", 1, "--rtol", 1e-8, "--sample", 0.01, "--out", run)
        done = command("inverse", PENDULUM, "--motion", run, "--out", out, "--stats", stats)
        assert done.status == 0
        assert "left out: nothing" in done.out
        table = read(out)
        (load,) = (x for name, x in table.items() if name.endswith("swing.load_Nm"))
        # The recorded angle has 12 digits, and 1e-8 of error in time; inner samples, away from the ends of the spline.
        assert np.abs(load[5:-5]).max() < 2e-3
        assert json.loads(stats.read_text())["rows"] == 101

    def test_the_drivers_of_a_model_need_times(self, command, tmp_path):
        done = command("inverse", FOUR_BAR, "--out", tmp_path / "x.csv")
        assert done.status == USER_MISTAKE
        assert "--t-end and --sample: Expected both where no --motion gives them." in done.err
        done = command("inverse", FOUR_BAR, "--t-end", 1, "--sample", 0.1, "--out", tmp_path / "x.csv")
        assert done.status == 0 and "load of motor" in done.out

    @pytest.mark.parametrize(
        ("text", "options", "said"),
        [
            (
                "time_s,hip\n0,0\n1,1\n",
                [],
                "no column is named after a joint or a joint_angle sensor. Columns: hip",
            ),
            ("time_s,swing\n0,0\n1,\n", [], "line 3, column 'swing': the cell is empty"),
            ("time_s,swing\n1,0\n0,1\n", [], "the time in 'time_s' falls"),
            ("time_s,swing,swing_deg\n0,0,0\n1,1,1\n", [], "two columns are named after 'swing'"),
            (None, ["--cutoff", 3], "--cutoff: Expected a --motion that is filtered"),
        ],
    )
    def test_wrong_motions(self, command, tmp_path, text, options, said):
        motion = tmp_path / "motion.csv"
        if text is not None:
            motion.write_text(text)
            options = ["--motion", motion, *options]
        done = command("inverse", PENDULUM, "--out", tmp_path / "x.csv", *options)
        assert done.status == USER_MISTAKE and said in done.err

    def test_names_of_columns_may_hold_the_separator(self, command, tmp_path):
        model, motion = tmp_path / "pendulum.yaml", tmp_path / "motion.csv"
        model.write_text(PENDULUM.read_text().replace("name: swing", 'name: "swing, left"'))
        motion.write_text('time_s,"a note, not read","swing, left_deg"\n' + "".join(f"0.{k},,{k}\n" for k in range(9)))
        done = command("inverse", model, "--motion", motion, "--out", tmp_path / "x.csv")
        assert done.status == 0 and "load of swing, left: " in done.out

    def test_muscles_are_asked_for_where_there_are_none(self, command, tmp_path):
        motion = tmp_path / "motion.csv"
        motion.write_text("time_s,swing_deg\n" + "".join(f"{0.1 * k},{k}\n" for k in range(20)))
        done = command(
            "inverse", PENDULUM, "--motion", motion, "--muscles", tmp_path / "m.csv", "--out", tmp_path / "x.csv"
        )
        assert done.status == USER_MISTAKE and "muscles: Expected a model with muscles, got none." in done.err


class TestModes:
    def test_frequency_and_damping(self, command, tmp_path):
        out, matrices = tmp_path / "modes.csv", tmp_path / "matrices.json"
        done = command("modes", SPRING, "--out", out, "--matrices", matrices)
        assert done.status == 0 and "'mass' moves along (1, 0, 0)" in done.out
        table = read(out)
        assert table["damping_ratio"][0] == pytest.approx(0.1, rel=1e-9)
        found = json.loads(matrices.read_text())
        assert found["states"] == ["q.mass.x", "v.mass.x"]
        assert np.array(found["A"]).shape == (2, 2)

    def test_about_the_start(self, command, tmp_path):
        done = command("modes", PENDULUM, "--about", "start", "--out", tmp_path / "modes.csv")
        assert done.status == 0 and "stability: " in done.out

    def test_pictures(self, command, tmp_path):
        pytest.importorskip("matplotlib")
        done = command("modes", PENDULUM, "--out", tmp_path / "modes.csv", "--pictures", tmp_path / "modes.png")
        assert done.status == 0 and (tmp_path / "modes.png").stat().st_size > 5000

    def test_a_picture_of_no_kind(self, command, tmp_path):
        done = command("modes", PENDULUM, "--out", tmp_path / "modes.csv", "--pictures", tmp_path / "modes.txt")
        assert done.status == USER_MISTAKE and "Expected a name that ends with .png, .svg, .pdf" in done.err

    def test_an_unknown_backend_is_named_before_the_analysis(self, tmp_path):
        pytest.importorskip("matplotlib")
        options = ["--out", tmp_path / "modes.csv", "--pictures", tmp_path / "modes.png"]
        done = subprocess.run(
            [sys.executable, "-m", "dms_core", "modes", PENDULUM, *options], cwd=configs().parent,
            env=os.environ | {"MPLBACKEND": "nonsense"}, capture_output=True, text=True, check=False,
        )  # fmt: skip
        assert done.returncode == USER_MISTAKE and list(tmp_path.iterdir()) == []
        assert done.stderr.startswith("error: matplotlib cannot be imported") and "'nonsense'" in done.stderr


@pytest.mark.parametrize("name", ["static", "kinematic", "inverse", "modes"])
def test_outputs_are_never_replaced_unasked(command, tmp_path, name):
    out = tmp_path / "out.csv"
    out.write_text("mine")
    times = ["--t-end", 1, "--sample", 0.5] if name in ("kinematic", "inverse") else []
    done = command(name, FOUR_BAR if times else PENDULUM, *times, "--out", out)
    assert done.status == USER_MISTAKE and "exists; choose another name, or give --overwrite" in done.err
    assert out.read_text() == "mine"
    assert command(name, FOUR_BAR if times else PENDULUM, *times, "--out", out, "--overwrite").status == 0
    assert out.read_text() != "mine"
