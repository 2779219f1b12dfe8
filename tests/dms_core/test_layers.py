"""Folders of the core import in one direction, and no files of a package import each other in a circle."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from graphlib import CycleError, TopologicalSorter
from importlib import import_module
from pathlib import Path

import pytest

import agents
import dms_core
import exo_env

FOLDER = Path(dms_core.__file__).parent
LATER = {"analyses", "sensitivity", "estimation", "model_files"}
"""What stands on a world in time."""
ABOVE = {
    "linear": {"model", "assembly", "simulation", *LATER},
    "model": {"linear", "assembly", "simulation", *LATER},
    "assembly": {"simulation", *LATER},
    "compiled": {"simulation", "linear", *LATER},
    "simulation": LATER,
    "analyses": {"sensitivity", "estimation"},
    "sensitivity": {"estimation"},
    "files": {"compiled", "linear", "model", "assembly", "simulation", *LATER},
}
"""What a folder must not import."""
ORDER = {
    "agents.commands": ("options", "evaluate", "training", "search", "studies", "pictures"),
    "agents.evaluation": ("episodes", "comparison", "sharing", "results", "search", "studies", "figures"),
    "agents.training": (
        "settings",
        "wrappers",
        "learners",
        "networks",
        "worlds",
        "usable",
        "files",
        "learning_curve",
        "run",
    ),
    "exo_env.tasks": (
        "observation",
        "checked",
        "movements",
        "task",
        "judgement",
        "elbow",
        "elbow_task",
        "lift",
        "hidden_intent",
    ),
    "exo_env.world": ("draw", "work_sharing", "kernels", "estimator", "world", "batch", "episodes"),
}
"""What a folder holds: each may import those before it."""


def _module(path: Path, root: Path) -> str:
    """Name of the module in a file; `root` is the folder of its outermost package."""
    parts = path.relative_to(root.parent).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def _imported(path: Path, root: Path) -> Iterator[str]:
    """Every name that a file imports, made absolute: at its head, in a function, or for its types only.

    `from a import b` gives both a and a.b, since b may be a module.
    """
    package = path.relative_to(root.parent).parent.parts
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            above = package[: len(package) - node.level + 1] if node.level else ()
            origin = ".".join([*above, *([node.module] if node.module else [])])
            yield origin
            yield from (f"{origin}.{alias.name}" for alias in node.names)


def _circle(root: Path) -> list[str]:
    """Modules of a package of which each imports the next and the last is the first; empty where there is none."""
    files = {_module(path, root): path for path in sorted(root.rglob("*.py"))}
    assert files
    graph = {module: set(_imported(path, root)) & (files.keys() - {module}) for module, path in files.items()}
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        # graphlib lists each module before the one that imports it.
        return error.args[1][::-1]
    return []


@pytest.mark.parametrize("folder", ABOVE)
def test_no_file_imports_from_a_folder_above(folder):
    files = sorted((FOLDER / folder).rglob("*.py"))
    assert files
    above = {f"dms_core.{name}" for name in ABOVE[folder]}
    folders = {_module(path, FOLDER): {".".join(x.split(".")[:2]) for x in _imported(path, FOLDER)} for path in files}
    wrong = {module: found & above for module, found in folders.items() if found & above}
    assert not wrong


@pytest.mark.parametrize("folder", ORDER)
def test_what_a_folder_holds_imports_in_one_direction(folder):
    package = import_module(folder.partition(".")[0])
    root, here = Path(package.__file__).parent, folder.split(".")
    inside = root.joinpath(*here[1:])
    assert {path.stem for path in inside.iterdir() if not path.name.startswith("_")} == set(ORDER[folder])
    for path in sorted(inside.rglob("*.py")):
        mine = path.relative_to(inside).with_suffix("").parts[0]
        found = {name.split(".")[2] for name in _imported(path, root) if name.startswith(f"{folder}.")} - {mine}
        after = found - set(ORDER[folder][: ORDER[folder].index(mine)]) if mine != "__init__" else found
        assert not after & set(ORDER[folder]), f"{path.relative_to(root.parent)} imports {sorted(after)}"


@pytest.mark.parametrize("package", [dms_core, exo_env, agents], ids=lambda package: package.__name__)
def test_no_circle_of_files(package):
    circle = _circle(Path(package.__file__).parent)
    assert not circle, " imports ".join(circle)


@pytest.mark.parametrize(
    "back",
    [
        "from package.inside.one import name",
        "from package.inside import one",
        "import package.inside.one",
        "from .inside.one import name",
        "from .inside import one",
        "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    from package.inside.one import name",
        "def function():\n    from package.inside.one import name",
    ],
)
def test_a_circle_is_found_however_it_is_imported(tmp_path, back):
    root = tmp_path / "package"
    (root / "inside").mkdir(parents=True)
    for path in (root, root / "inside"):
        (path / "__init__.py").write_text("")
    (root / "inside" / "one.py").write_text("from ..two import name\n")
    (root / "two.py").write_text("import math\n")
    assert _circle(root) == []
    (root / "two.py").write_text(f"{back}\n")
    circle = _circle(root)
    assert circle[0] == circle[-1]
    assert set(circle) == {"package.inside.one", "package.two"}
