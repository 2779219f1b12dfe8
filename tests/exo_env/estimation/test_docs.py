"""The example of docs/elbow-estimation.md runs, and its table is the committed one."""

from __future__ import annotations

import csv
import math

from dms_core.files.config_files import configs

DOCS = configs().parent / "docs"


def test_the_example_prints_a_moment(capsys):
    page = (DOCS / "elbow-estimation.md").read_text(encoding="utf-8")
    code = page.partition("```python\n")[2].partition("```")[0]
    exec(compile(code, "docs/elbow-estimation.md", "exec"), {})  # noqa: S102
    assert capsys.readouterr().out.startswith("Moment(others=")


def test_the_table_is_that_of_the_file():
    page = (DOCS / "elbow-estimation.md").read_text(encoding="utf-8")
    shown = [[cell.strip() for cell in line[1:-1].split("|")] for line in page.splitlines() if line[:2] == "| "]
    with (DOCS / "elbow_estimation.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert len(shown) == len(rows) + 1
    for cells, row in zip(shown[1:], rows, strict=True):
        assert float(cells[2].rstrip(" %")) == round(100.0 * float(row["error_over_rms"]), 1)
        assert float(cells[3].rstrip(" %")) == round(100.0 * float(row["median_of_patients"]), 1)
        assert cells[4] == f"{float(row['error_Nm']):.2f} of {float(row['rms_Nm']):.2f} Nm"
        covered = float(row["coverage_95"])
        assert cells[5] == ("" if math.isnan(covered) else f"{100.0 * covered:.1f} %")
