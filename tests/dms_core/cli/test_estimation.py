"""estimate and observability on the command line: what they write, what they refuse, how they end."""

from __future__ import annotations

import json

import numpy as np
import pytest

from dms_core.command_line import USER_MISTAKE
from dms_core.files.config_files import config_file
from dms_core.files.output_file import write_csv
from tests.dms_core.cli.tables import read

PENDULUM = config_file("models/pendulum.yaml")
SETTINGS = """
period: 0.01
channels:
  swing.angle: {deviation: 0.002}
noise: {acceleration: 0.05}
"""


@pytest.fixture
def files(tmp_path):
    """Settings, and a record of a rod that is let go."""
    settings, record = tmp_path / "filter.yaml", tmp_path / "record.csv"
    settings.write_text(SETTINGS, encoding="utf-8")
    t = 0.01 * np.arange(30)
    # At first it turns as if its weight had no lever of cosine: 1.5 g / l.
    angle = 0.5 * np.pi - 0.5 * 14.715 * t**2 + 0.001 * np.random.default_rng(1).normal(size=30)
    write_csv(record, {"time_s": t, "swing.angle_rad": angle})
    return settings, record


class TestEstimate:
    def test_a_record_gives_states_deviations_and_nis(self, command, files, tmp_path):
        (settings, record), out, stats = files, tmp_path / "out.csv", tmp_path / "out.json"
        done = command("estimate", PENDULUM, "--measurements", record, "--settings", settings, "--out", out,
                       "--stats", stats)  # fmt: skip
        assert done.status == 0
        assert "mean NIS per reading" in done.out and f"written: {out}" in done.out
        table = read(out)
        assert len(table["time_s"]) == 30
        assert {"swing.rate_rad_per_s", "deviation.swing.rate_rad_per_s", "bearing.Fy_N", "q.rod.x", "v.rod.x",
                "deviation.q.rod.x", "nis", "readings"} <= table.keys()  # fmt: skip
        assert all(np.isfinite(x).all() for x in table.values())
        assert table["swing.rate_rad_per_s"][-1] == pytest.approx(-14.715 * 0.29, rel=0.05)
        found = json.loads(stats.read_text())
        assert found["readings"] == 30
        assert found["divergences"] == 0

    def test_smoothing_lowers_deviations(self, command, files, tmp_path):
        (settings, record), deviations = files, []
        for options in ((), ("--smooth",)):
            out = tmp_path / f"{len(options)}.csv"
            done = command("estimate", PENDULUM, "--measurements", record, "--settings", settings, "--out", out,
                           *options)  # fmt: skip
            assert done.status == 0
            deviations.append(read(out)["deviation.swing.rate_rad_per_s"][10])
        assert deviations[1] < 0.7 * deviations[0]

    @pytest.mark.parametrize(
        ("settings", "said"),
        [("channels: {swing.rate: {deviation: 1.0}}", "no column tells sensor 'swing.rate'"),
         ("channels: {swing.speed: {deviation: 1.0}}", "no sensor 'swing.speed'"),
         ("channels: {swing.angle: {deviation: -1.0}}", "Expected a number above 0"),
         ("period: 0.01", "'channels' is missing"), ("channels: [1]", "channels")],
    )  # fmt: skip
    def test_wrong_settings_are_one_message(self, command, files, tmp_path, settings, said):
        (path, record), out = files, tmp_path / "out.csv"
        path.write_text(settings, encoding="utf-8")
        done = command("estimate", PENDULUM, "--measurements", record, "--settings", path, "--out", out)
        assert done.status == USER_MISTAKE
        assert said in done.err and "Traceback" not in done.err
        assert not out.exists()

    def test_help_lists_the_options(self, command):
        said = command("estimate", "--help").out
        assert all(option in said for option in ("--measurements", "--settings", "--out", "--smooth", "--stats"))


class TestObservability:
    @pytest.mark.parametrize("gramian", ["local", "empirical"])
    def test_a_pendulum_is_told_by_its_angle(self, command, tmp_path, gramian):
        out, stats = tmp_path / "o.csv", tmp_path / "o.json"
        done = command("observability", PENDULUM, "--sensors", "swing.angle", "--t-end", 0.2, "--gramian", gramian,
                       "--out", out, "--stats", stats)  # fmt: skip
        assert done.status == 0
        assert "rank: 2" in done.out and "not observable" not in done.out
        found = json.loads(stats.read_text())
        assert found["rank"] == len(found["states"]) == 2
        assert len(read(out)["singular_value"]) == 2

    def test_a_force_does_not_tell_a_free_mass(self, command, tmp_path):
        model, out = tmp_path / "free.yaml", tmp_path / "o.csv"
        model.write_text(
            "bodies: [{kind: point_mass, name: m, mass: 1.0}]\n"
            "constraints: [{kind: line_guide, name: track, body_j: m, axis_i: [1.0, 0.0, 0.0]}]\n"
            "sensors: [{kind: joint_reaction, name: load, constraint: track, body: m}]\n", encoding="utf-8"
        )  # fmt: skip
        done = command("observability", model, "--sensors", "load.Fy", "--t-end", 0.1, "--out", out)
        assert done.status == 0
        assert "rank: 0" in done.out and "not observable: 'm' moves along (1, 0, 0)" in done.out

    @pytest.mark.parametrize(
        ("options", "said"),
        [((), "--sensors: Expected sensor components"), (("--sensors", "swing.speed"), "no sensor 'swing.speed'"),
         (("--sensors", "swing.angle", "--t-end", 0.001), "--t-end: Expected a time of at least a period"),
         (("--sensors", "swing.angle", "--period", -1.0), "period = -1")],
    )  # fmt: skip
    def test_wrong_options_are_one_message(self, command, tmp_path, options, said):
        done = command("observability", PENDULUM, *options, "--out", tmp_path / "o.csv")
        assert done.status == USER_MISTAKE
        assert said in done.err
