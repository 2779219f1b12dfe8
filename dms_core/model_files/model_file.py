"""Model files: the declarations of `dms_core.model` as YAML, with the same keys, units, defaults and checks.

    name: pendulum
    bodies:
      - {kind: rigid_body, name: rod, mass: 1.0, inertia: [0.1, 0.001, 0.1], position: [0.5, 0.0, 0.0]}
    constraints:
      - {kind: revolute, name: hinge, body_j: rod}

`kind` chooses the class; classes of other packages count as soon as they are imported. SI units and radians only.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from pydantic import BaseModel

import dms_core.model  # noqa: F401  (makes every kind known)
from dms_core.assembly.layout import Layout
from dms_core.errors import DmsError, InputError, ModelError, choices
from dms_core.files.yaml_builder import Section
from dms_core.files.yaml_text import read_yaml, yaml_of
from dms_core.model.constraints.euler_norm import EulerNorm
from dms_core.model.element import Body, Composition, Constraint, Declaration, Force, Sensor
from dms_core.model.signals import Function, Input
from dms_core.model.system import System
from dms_core.validation import cut, shown

BRANCHES: dict[str, type[Declaration]] = {
    "compositions": Composition,
    "bodies": Body,
    "constraints": Constraint,
    "forces": Force,
    "sensors": Sensor,
    "inputs": Input,
}
"""Sections of a file and what stands in them."""


def kinds(section: str) -> dict[str, type[Declaration]]:
    """Kind to class of everything that may stand in a section, by kind.

    Raises:
        ModelError: two classes have the same kind.
    """
    found: dict[str, type[Declaration]] = {}
    pending = [BRANCHES[section]]
    while pending:
        cls = pending.pop()
        pending += cls.__subclasses__()
        # The unit-norm equations come by themselves with the bodies.
        if not cls.kind or cls is EulerNorm:
            continue
        other = found.setdefault(cls.kind, cls)
        if other is not cls:
            raise ModelError(
                f"two classes are of kind '{cls.kind}': {other.__module__}.{other.__name__} and "
                f"{cls.__module__}.{cls.__name__}; give one of them another kind."
            )
    return dict(sorted(found.items()))


def load(path: str | Path) -> System:
    """The system that a model file declares.

    Raises:
        InputError: the file cannot be read or is not YAML.
        ModelError: a declaration is wrong; names file, line, element, key, value and what is right.
    """
    content = read_yaml(path)
    unknown = content.keys() - BRANCHES.keys() - {"name"}
    if unknown:
        allowed = choices({"name", *BRANCHES})
        raise ModelError(f"{path}: unknown key {_quoted(unknown)} at the top. Allowed: {allowed}.")
    name = content.get("name", Path(path).stem)
    if not isinstance(name, str):
        raise ModelError(f"{path}: name: Expected a text, got {shown(name)}.")
    items = {section: _section(path, section, content.get(section)) for section in BRANCHES}
    lines = {declared.name: line for found in items.values() for declared, line in found}
    try:
        system = System(name, **{section: [e for e, _ in found] for section, found in items.items()})  # type: ignore[arg-type]
    except DmsError as error:
        raise ModelError(f"{path}: {error}") from None
    _check_names(path, system, lines)
    return system


def _check_names(path: str | Path, system: System, lines: dict[str, int]) -> None:
    """Bodies, joints, coordinates and inputs that an element names in vain are an error with the element's line."""
    try:
        Layout(system)
    except ModelError as error:
        # What concerns no single element (a system without bodies) is said when the model is compiled.
        declared = system.composed.get(error.element, error.element)
        if declared in lines:
            raise ModelError(f"{path}, line {lines[declared]}: {error}", error.element) from None


def _section(path: str | Path, section: str, items: Any) -> list[tuple[Declaration, int]]:
    """The declarations of one section, each with its line."""
    if items is None:
        return []
    if not isinstance(items, list):
        raise ModelError(f"{path}: {section}: Expected a list whose items begin with '- ', got {shown(items)}.")
    return [(_declaration(path, section, item), getattr(item, "line", 0)) for item in items]


def _declaration(path: str | Path, section: str, item: Any) -> Declaration:
    """One item of a section as the class that its kind names."""
    if not isinstance(item, Section):
        raise ModelError(f"{path}: {section}: {shown(item)} is not a mapping with the keys 'kind' and 'name'.")
    where, data = f"{path}, line {item.line}", dict(item)
    who = f"{cut(repr(str(data.get('name', '?'))))} in {section}"
    # Only one class may stand among the inputs.
    kind = data.pop("kind", "input" if section == "inputs" else None)
    allowed = kinds(section)
    if kind is None:
        raise ModelError(f"{where}: {who}: 'kind' is missing. Kinds of {section}: {choices(allowed)}.")
    if not isinstance(kind, str) or kind not in allowed:
        others = [s for s in BRANCHES if kind in list(kinds(s))]
        hint = f" It belongs under '{others[0]}'." if others else ""
        raise ModelError(f"{where}: {who}: unknown kind {shown(kind)}.{hint} Kinds of {section}: {choices(allowed)}.")
    if section == "inputs":
        data = _beside(path, data)
    try:
        declaration = allowed[kind](**data)
    except DmsError as error:
        raise ModelError(f"{where}: {error}") from None
    if isinstance(declaration, Input) and isinstance(declaration.signal, Function):
        raise ModelError(f"{where}: {who}: a signal of kind 'function' is Python code; declare it in Python.")
    return declaration


def _beside(path: str | Path, data: dict[str, Any]) -> dict[str, Any]:
    """An input whose table, if it has one, is found from the folder of the model file."""
    signal = data.get("signal")
    if not isinstance(signal, dict) or signal.get("kind") != "table" or not isinstance(signal.get("file"), str):
        return data
    file = Path(path).resolve().parent / signal["file"] if signal["file"] else ""
    return {**data, "signal": {**signal, "file": str(file)}}


def dump(system: System) -> str:
    """The model file of a system: `load` of it gives equal declarations. Values that are defaults are left out.

    Raises:
        InputError: an input is a Python function, which no file can hold.
    """
    content: dict[str, Any] = {"name": system.name}
    for section in BRANCHES:
        if declared := system.own(section):
            content[section] = [_plain(e) for e in declared]
    return yaml_of(content, default_flow_style=None, allow_unicode=True)


def _plain(value: Any) -> Any:
    """A declaration, or a value in it, as mappings, lists and scalars."""
    if isinstance(value, Function):
        raise InputError("a signal of kind 'function' is Python code; a model file cannot hold it.")
    if isinstance(value, BaseModel):
        kind = getattr(value, "kind", None)
        plain = {} if kind is None or isinstance(value, Input) else {"kind": kind}
        for key, field in type(value).model_fields.items():
            item = getattr(value, key)
            if key != "kind" and (field.is_required() or item != field.get_default(call_default_factory=True)):
                plain[key] = _plain(item)
        return plain
    if isinstance(value, tuple | list):
        return [_plain(item) for item in value]
    return value


def _quoted(names: Any) -> str:
    """The first names in quotes, sorted."""
    return cut(", ".join(f"'{name}'" for name in sorted(names)))
