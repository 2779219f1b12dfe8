"""Tables, JSON and Markdown: any name of a user can be read back, or is refused before the work."""

import csv
import json

import numpy as np
import pytest

from dms_core.errors import InputError
from dms_core.files.output_file import (
    LARGEST_TABLE,
    check_columns,
    check_size,
    markdown_cell,
    write_csv,
    write_json,
)


class TestTables:
    NAMES = ("time_s", "elbow, left_rad", 'the "good" arm_N', "plain", "#b", "ä|b")

    def test_names_are_quoted_and_read_back(self, tmp_path):
        path = tmp_path / "table.csv"
        write_csv(path, {name: np.arange(3.0) + k for k, name in enumerate(self.NAMES)})
        with path.open(newline="", encoding="utf-8") as file:
            rows = list(csv.reader(file))
        assert tuple(rows[0]) == self.NAMES and rows[1:] == [[str(k + n) for k in range(6)] for n in range(3)]
        np.testing.assert_array_equal(np.loadtxt(path, delimiter=",", skiprows=1, encoding="utf-8")[:, 1], [1, 2, 3])

    @pytest.mark.parametrize("name", ["a\nb", "a\rb", "a\x00b", "a\u2028b", "\ud800", "a\u202eb"])
    def test_names_that_no_reader_takes_are_refused(self, tmp_path, name):
        with pytest.raises(InputError, match="without line breaks"):
            check_columns(["time_s", name])
        with pytest.raises(InputError, match="without line breaks"):
            write_csv(tmp_path / "table.csv", {name: np.zeros(2)})
        assert list(tmp_path.iterdir()) == []

    def test_a_space_that_does_not_break_is_a_character_as_any(self):
        check_columns(["elbow\u00a0angle", "ange de l\u2019\u00e9paule"])

    def test_a_column_that_would_hide_another_is_refused(self):
        with pytest.raises(InputError, match="column 'time_s' would stand twice"):
            check_columns(["time_s", "x", "time_s"])

    def test_parts_are_one_table(self, tmp_path):
        whole = {"a": np.arange(7.0), "b": np.arange(7.0) ** 2}
        write_csv(tmp_path / "whole.csv", whole)
        write_csv(tmp_path / "parts.csv", lambda: ({k: v[n : n + 3] for k, v in whole.items()} for n in (0, 3, 6)))
        assert (tmp_path / "whole.csv").read_bytes() == (tmp_path / "parts.csv").read_bytes()

    def test_the_size_is_known_before(self):
        rows = LARGEST_TABLE // (8 * 10)
        check_size("--sample", 1.0, 1.0 / (rows - 2), 10)
        with pytest.raises(InputError, match=r"--sample 1e-09: 1e\+09 rows of 10 numbers take 74.5 GiB"):
            check_size("--sample", 1.0, 1e-9, 10)

    def test_json_has_no_nan(self, tmp_path):
        write_json(tmp_path / "x.json", {"a": [float("nan"), 1.0], "b": (float("inf"),)})
        assert json.loads((tmp_path / "x.json").read_text()) == {"a": [None, 1.0], "b": [None]}

    def test_markdown_and_comments(self):
        assert markdown_cell("a|b\nc") == "a\\|b\\nc" and markdown_cell("a\nb\u2028c") == "a\\nb\\u2028c"
