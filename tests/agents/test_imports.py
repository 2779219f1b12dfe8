"""The folders of agents import in one direction, relatively, and know no environment but by its id."""

import ast
from pathlib import Path

import pytest

import agents

FOLDER = Path(agents.__file__).parent
MODULES = sorted(FOLDER.rglob("*.py"))
GROUND = ("environment", "checkpoint", "provenance", "old_names")
FLOORS = {
    **dict.fromkeys(GROUND, 0), "policies": 1, "training": 2, "evaluation": 2, "export": 3, "distributed": 4,
    "commands": 5, "__main__": 6, "ceiling": 6,
}  # fmt: skip
"""A folder may import lower ones; those of one floor know nothing of each other."""


def imports(path):
    """Absolute names that a module imports, relative ones as inside agents."""
    package = path.relative_to(FOLDER).parent.parts
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            yield from ((alias.name, 0) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            if node.level == 0:
                yield str(node.module), 0
                continue
            above = package[: len(package) - node.level + 1]
            inside = [*above, *(node.module or "").split(".")] if node.module else [*above]
            for alias in node.names:
                yield ".".join(inside or [alias.name]), node.level


@pytest.mark.parametrize("path", MODULES, ids=lambda p: str(p.relative_to(FOLDER)))
def test_imports_go_down(path):
    mine = path.relative_to(FOLDER).with_suffix("").parts[0]
    for name, level in imports(path):
        top = name.partition(".")[0]
        assert not (level == 0 and top == "agents"), f"{name} is not imported relatively"
        if level > 0 and mine != "__init__" and top != mine:
            assert FLOORS[top] < FLOORS[mine], f"{mine} imports {name}"


@pytest.mark.parametrize("path", MODULES, ids=lambda p: str(p.relative_to(FOLDER)))
def test_environments_are_made_in_one_place(path):
    if path.name != "environment.py":
        assert not [name for name, _ in imports(path) if name.startswith("exo_env.envs")]


@pytest.mark.parametrize("path", MODULES, ids=lambda p: str(p.relative_to(FOLDER)))
def test_no_module_depends_on_the_name_of_the_folder(path):
    tree = ast.parse(path.read_text())
    documentation = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in documentation:
            assert "agents." not in node.value and "-m agents" not in node.value, node.value
