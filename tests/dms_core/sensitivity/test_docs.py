"""The Python of docs/sensitivities.md runs as it stands there."""

import re

import pytest

from dms_core.files.config_files import configs

PAGE = configs().parent / "docs" / "sensitivities.md"


@pytest.mark.parametrize("block", [0, 1], ids=["a run", "an environment"])
def test_a_block_of_the_page_runs(block, capsys):
    pytest.importorskip("torch")
    found = re.findall(r"```python\n(.*?)```", PAGE.read_text(), re.S)
    assert len(found) == 2
    exec(compile(found[block], str(PAGE), "exec"), {})
    said = capsys.readouterr().out
    assert said and "nan" not in said
