"""Folders of the core import in one direction."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

import dms_core

FOLDER = Path(dms_core.__file__).parent
ABOVE = {
    "linear": {"model", "assembly", "simulation"},
    "model": {"linear", "assembly", "simulation"},
    "assembly": {"simulation"},
    "compiled": {"simulation", "linear"},
}
"""What a folder must not import."""


def _imported(path: Path) -> set[str]:
    """Folders of the core that a file imports, also for its types only."""
    nodes = ast.walk(ast.parse(path.read_text()))
    modules = [n.module for n in nodes if isinstance(n, ast.ImportFrom) and n.module]
    return {parts[1] for parts in (m.split(".") for m in modules) if parts[0] == "dms_core" and len(parts) > 1}


@pytest.mark.parametrize("folder", ABOVE)
def test_no_file_imports_from_a_folder_above(folder):
    files = sorted((FOLDER / folder).rglob("*.py"))
    assert files
    wrong = {path.name: found for path in files if (found := _imported(path) & ABOVE[folder])}
    assert not wrong
