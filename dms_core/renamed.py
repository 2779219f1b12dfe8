"""Modules that have moved: an import by the old name gives the module of the new name, and a warning that says it."""

from __future__ import annotations

import importlib
import sys
import warnings
from collections.abc import Mapping, Sequence
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec
from types import ModuleType
from typing import Any


class _MovedModule(Loader):
    """Loads a module by its new name."""

    def __init__(self, new: str) -> None:
        self.new = new

    def create_module(self, spec: ModuleSpec) -> ModuleType:
        """The module of the new name."""
        warnings.warn(f"'{spec.name}' is now '{self.new}'; import it by that name.", FutureWarning, stacklevel=2)
        module = importlib.import_module(self.new)
        self._spec = module.__spec__
        return module

    def exec_module(self, module: ModuleType) -> None:
        """Nothing is run twice; the import system has put the old specification into the module, which is undone."""
        module.__spec__ = self._spec


class _MovedModules(MetaPathFinder):
    """Finds the modules of one package that have moved."""

    def __init__(self, moved: Mapping[str, str]) -> None:
        self.moved = moved

    def find_spec(self, name: str, path: Sequence[str] | None, target: ModuleType | None = None) -> ModuleSpec | None:
        """The specification of a module that has moved, None for any other."""
        return ModuleSpec(name, _MovedModule(self.moved[name])) if name in self.moved else None


def moved_modules(package: str, moved: Mapping[str, str]) -> None:
    """From now on, import modules of a package by their old names too.

    Args:
        package: name of the package, such as 'exo_env'.
        moved: old name of each module, then the new one, both inside the package: {'human': 'ecosystem.arm'}.
    """
    names = {f"{package}.{old}": f"{package}.{new}" for old, new in moved.items()}
    # Last: a module that exists is found first.
    sys.meta_path.append(_MovedModules(names))


def replaced(module: str, names: Mapping[str, str]) -> Any:
    """A module's `__getattr__` for names that it no longer has: the error says what to take instead.

    Args:
        module: `__name__` of the module.
        names: each old name, and a sentence on what replaces it.
    """

    def __getattr__(name: str) -> Any:  # noqa: N807
        said = f" {names[name]}" if name in names else ""
        raise AttributeError(f"module '{module}' has no attribute '{name}'.{said}")

    return __getattr__
