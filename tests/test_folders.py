"""A folder holds what can be taken in at a glance: what grows beyond a dozen modules is cut by subject."""

from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
MOST = 12
"""Modules of a folder beside its `__init__`."""


@pytest.mark.parametrize("package", ["dms_core", "exo_env", "agents"])
def test_no_folder_has_more_than_a_dozen_modules(package):
    folders = [path for path in (ROOT / package).rglob("*") if (path / "__init__.py").exists()]
    assert folders
    counts = {str(path.relative_to(ROOT)): len(list(path.glob("*.py"))) - 1 for path in folders}
    crowded = {name: count for name, count in counts.items() if count > MOST}
    assert not crowded, f"Expected at most {MOST} modules a folder, got {crowded}; cut them by subject."
