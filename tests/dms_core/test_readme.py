"""The page of the theory names files that exist."""

from __future__ import annotations

import re
from pathlib import Path

import dms_core

FOLDER = Path(dms_core.__file__).parent
PAGE = FOLDER / "README.md"


def test_every_file_it_names_exists():
    names = set(re.findall(r"`([\w/]+\.py)`", PAGE.read_text()))
    assert len(names) > 30
    missing = {name for name in names if not (FOLDER / name).is_file() and not (FOLDER.parent / name).is_file()}
    assert not missing
