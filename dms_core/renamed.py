"""Modules that have moved: an import by the old name gives the module of the new name, and a warning that says it."""

from __future__ import annotations

import importlib
import sys
import warnings
from collections.abc import Mapping, Sequence
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec
from types import ModuleType
from typing import Any, NoReturn


class _OldModule(ModuleType):
    """A module under its old name, where some of its names have gone elsewhere than the rest."""

    def __init__(self, name: str, new: str, names: Mapping[str, str]) -> None:
        super().__init__(name, f"Moved to '{new}'.")
        self._new, self._names = new, names

    def __getattr__(self, name: str) -> Any:
        if name == "__all__":
            return self._public()
        return moved_name(self.__name__, name, self._names, self._new)

    def _public(self) -> list[str]:
        """What `from module import *` gives: names of the new module, and single ones that have gone elsewhere."""
        new = vars(importlib.import_module(self._new))
        names = new.get("__all__", [name for name in new if not name.startswith("_")])
        return sorted({*names, *self._names} - {name for name, place in self._names.items() if " " in place})


class _MovedModule(Loader):
    """Loads a module by its new name."""

    def __init__(self, new: str, names: Mapping[str, str]) -> None:
        self.new, self.names = new, names

    def create_module(self, spec: ModuleSpec) -> ModuleType:
        """The module of the new name, or one that also knows where single names have gone."""
        warnings.warn(f"'{spec.name}' is now '{self.new}'; import it by that name.", FutureWarning, stacklevel=2)
        module = importlib.import_module(self.new)
        self._spec = module.__spec__
        return _OldModule(spec.name, self.new, self.names) if self.names else module

    def exec_module(self, module: ModuleType) -> None:
        """Nothing is run twice; the import system has put the old specification into the module, which is undone."""
        if not isinstance(module, _OldModule):
            module.__spec__ = self._spec

    def get_code(self, name: str) -> NoReturn:
        """Refuse `python -m` with the old name, which would run what is imported by the new one a second time."""
        raise ImportError(f"'{name}' is now '{self.new}'; run it by that name.", name=name)


def moved_name(module: str, name: str, names: Mapping[str, str], new: str | None = None) -> Any:
    """What an old name of a module stands for.

    Args:
        module: name of the old module.
        name: asked for in it.
        names: where single names are now, as "package.module:name", or a sentence on what replaces them.
        new: module that has all other names; None: no other name is known.

    Raises:
        ImportError: the name is gone; says what replaces it. (`from module import name` would hide the sentence of an
            AttributeError.)
        AttributeError: there never was such a name.
    """
    if name.startswith("__"):
        raise AttributeError(name)
    place = names.get(name, f"{new}:{name}" if new else "")
    home, _, attribute = place.partition(":")
    if attribute and " " not in place:
        if name in names:
            warnings.warn(f"'{module}.{name}' is now '{home}.{attribute}'.", FutureWarning, stacklevel=3)
        return getattr(importlib.import_module(home), attribute)
    if place:
        raise ImportError(f"'{name}' is no longer in '{module}'. {place}", name=module)
    raise AttributeError(f"module '{module}' has no attribute '{name}'.")


class _MovedModules(MetaPathFinder):
    """Finds the modules of one package that have moved."""

    def __init__(self, moved: Mapping[str, str], names: Mapping[str, Mapping[str, str]]) -> None:
        self.moved, self.names = moved, names

    def find_spec(self, name: str, path: Sequence[str] | None, target: ModuleType | None = None) -> ModuleSpec | None:
        """The specification of a module that has moved, None for any other."""
        if name not in self.moved:
            return None
        return ModuleSpec(name, _MovedModule(self.moved[name], self.names.get(name, {})))


def moved_modules(package: str, moved: Mapping[str, str], names: Mapping[str, Mapping[str, str]] | None = None) -> None:
    """From now on, import modules of a package by their old names too.

    Args:
        package: name of the package, such as 'exo_env'.
        moved: old name of each module, then the new one, both inside the package: {'human': 'ecosystem.arm'}.
        names: by old module, names that are not in the new one: where they are, as "module:name" inside the package, or
            a sentence on what replaces them.
    """
    modules = {f"{package}.{old}": f"{package}.{new}" for old, new in moved.items()}
    given = {f"{package}.{old}": inside(package, those) for old, those in (names or {}).items()}
    # Last: a module that exists is found first.
    sys.meta_path.append(_MovedModules(modules, given))


def inside(package: str, names: Mapping[str, str]) -> dict[str, str]:
    """The same with places "module:name" inside a package made whole; sentences stay."""
    return {name: place if " " in place else f"{package}.{place}" for name, place in names.items()}


def replaced(module: str, names: Mapping[str, str]) -> Any:
    """A module's `__getattr__` for names that it no longer has: the error says what to take instead.

    Args:
        module: `__name__` of the module.
        names: each old name, and a sentence on what replaces it.
    """

    def __getattr__(name: str) -> Any:  # noqa: N807
        return moved_name(module, name, names)

    return __getattr__
