"""The table of docs/design.md is the committed one, as `python -m exo_env design` wrote it."""

import csv

from dms_core.files.config_files import configs
from exo_env.design.comparison import HEAD

DOCS = configs().parent / "docs"


def test_the_table_is_that_of_the_file():
    lines = (DOCS / "design.md").read_text(encoding="utf-8").splitlines()
    first = lines.index("| patients | quantity | unit | today | found | change_percent |")
    shown = [[cell.strip() for cell in line[1:-1].split("|")] for line in lines[first + 2 :]]
    with (DOCS / "design.csv").open(encoding="utf-8", newline="") as file:
        head, *rows = csv.reader(file)
    assert tuple(head) == HEAD and len(rows) == 12
    assert shown[: len(rows)] == rows
    assert (DOCS / "design.png").exists()
