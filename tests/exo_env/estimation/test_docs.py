"""The example of docs/elbow-estimation.md runs, and its tables are the committed ones."""

from __future__ import annotations

import csv
import math
import re

import pytest

from dms_core.files.config_files import configs
from exo_env.estimation.reduced_filter import ESTIMATE_NAMES

DOCS = configs().parent / "docs"


def test_the_example_prints_a_moment(capsys):
    page = (DOCS / "elbow-estimation.md").read_text(encoding="utf-8")
    code = page.partition("```python\n")[2].partition("```")[0]
    exec(compile(code, "docs/elbow-estimation.md", "exec"), {})  # noqa: S102
    assert capsys.readouterr().out.startswith("Moment(others=")


def tables() -> list[list[list[str]]]:
    """Cells of each table of the page, without head and rule."""
    page = (DOCS / "elbow-estimation.md").read_text(encoding="utf-8")
    blocks = re.findall(r"(?:^\|.*\n)+", page, re.MULTILINE)
    return [[[cell.strip() for cell in line[1:-1].split("|")] for line in x.splitlines()[2:]] for x in blocks]


@pytest.mark.parametrize(("table", "file", "ending"), [(0, "elbow_estimation", "_Nm"), (5, "elbow_estimated", "")])
def test_the_table_is_that_of_the_file(table, file, ending):
    shown = tables()[table]
    with (DOCS / f"{file}.csv").open(encoding="utf-8") as stream:
        rows = list(csv.DictReader(stream))
    assert len(shown) == len(rows)
    for cells, row in zip(shown, rows, strict=True):
        assert float(cells[2].rstrip(" %")) == round(100.0 * float(row["error_over_rms"]), 1)
        assert float(cells[3].rstrip(" %")) == round(100.0 * float(row["median_of_patients"]), 1)
        error, rms = (float(row[name + ending]) for name in ("error", "rms"))
        assert cells[4].rpartition(" ")[0] == f"{error:.2f} of {rms:.2f}"
        covered = float(row["coverage_95"])
        assert cells[5] == ("" if math.isnan(covered) else f"{100.0 * covered:.1f} %")
        by_patient = [row[f"coverage_{name}_patient"] for name in ("least", "tenth")] if len(cells) > 6 else []
        assert cells[6:] == [f"{100.0 * float(x):.1f} %" for x in by_patient]


def test_the_channels_of_the_page_are_those_of_the_group():
    assert [cells[0].split("`")[1] for cells in tables()[4]] == list(ESTIMATE_NAMES)


@pytest.mark.parametrize(("table", "file"), [(1, "elbow_emg"), (3, "elbow_emg_causes")])
def test_the_tables_with_electrodes_are_those_of_the_files(table, file):
    shown = tables()[table]
    with (DOCS / f"{file}.csv").open(encoding="utf-8") as stream:
        rows = list(csv.DictReader(stream))
    assert len(shown) == len(rows)
    for cells, row in zip(shown, rows, strict=True):
        assert float(cells[1]) == round(float(row["activation"]), 3)
        assert cells[2] == f"{float(row['force_N']):.0f} N"
        best, worst = (100.0 * float(row[f"force_{x}_muscle"]) for x in ("best", "worst"))
        assert cells[3] == f"{best:.1f} % to {worst:.1f} %"
        assert cells[4] == ("known" if "known load" in cells[0] else f"{float(row['load_kg']):.2f} kg")
        assert cells[6] == f"{100.0 * float(row['moment_over_rms']):.1f} %"


def test_the_table_of_causes_is_that_of_the_file():
    shown = tables()[6]
    with (DOCS / "elbow_causes.csv").open(encoding="utf-8") as stream:
        rows = list(csv.DictReader(stream))
    assert [float(cells[1].rstrip(" %")) for cells in shown] == [
        round(100.0 * float(row["error_over_rms"]), 1) for row in rows
    ]
