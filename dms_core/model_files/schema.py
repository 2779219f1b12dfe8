"""The reference of model files, generated from the declarations themselves."""

from __future__ import annotations

import inspect
import re
from types import NoneType, UnionType
from typing import Any, Literal, Union, get_args, get_origin

from pydantic import BaseModel
from pydantic.fields import FieldInfo

from dms_core.model.constraints.couplings.linear_coupling import JointTerm
from dms_core.model.element import Declaration
from dms_core.model.flexible import BeamSection, Interface, LoadDistribution, ModalData
from dms_core.model.forces import BushingCurves, LoadCurve
from dms_core.model.muscles import ThelenCurves
from dms_core.model.ropes import PathPoint
from dms_core.model.signals import Function, Signal
from dms_core.model_files.model_file import BRANCHES, kinds

HEAD = """\
# Model files

Generated from the code by `python -m dms_core schema`; do not edit.

A model file is YAML with the keys `name`, `compositions`, `bodies`, `constraints`, `forces`, `sensors` and `inputs`;
each of the last six holds a list of declarations. `kind` chooses what is declared, `name` is unique in the whole file,
`ground` is the fixed frame. All numbers are in SI units (m, kg, s, N) and radians. Keys that are left out take their
default; a required key left out, a wrong type, and a key or kind that does not exist are errors that name file, line
and element.

Numbers are those of YAML 1.2: `010` is 10, `0o10` is 8, `1e5` is a number; `1:30`, `1_000`, `yes` and dates are text,
and so is a number in quotes. A merge takes keys from another mapping, and those beside it come first:
`{<<: *rod, name: rod2}`. A file has at most 4 MB and 100,000 keys and values, aliases written out.

```yaml
name: pendulum
bodies:
  - {kind: rigid_body, name: rod, mass: 1.0, inertia: [0.1, 0.001, 0.1], position: [0.5, 0.0, 0.0]}
constraints:
  - {kind: revolute, name: hinge, body_j: rod}
forces:
  - {kind: gravity, name: weight}
sensors:
  - {kind: joint_angle, name: swing, joint: hinge}
```

Euler parameters of rigid bodies have unit length by themselves; no constraint is declared for that. Results carry a
column `q.<element>.<coordinate>` for each coordinate, `v.<element>.<coordinate>` for its rate, and one for each sensor
component with its unit at the end of the name.
"""

INTRODUCTIONS = {
    "compositions": "What stands for several bodies, constraints and forces, whose names begin with its own and a dot.",
    "bodies": "What has mass.",
    "constraints": "Equations between bodies: joints, guides, couplings, ropes of fixed length, drivers.",
    "forces": "Loads, springs, ropes, muscles, controllers, differential equations.",
    "sensors": "What is measured.",
    "inputs": "Courses in time u(t), named by the elements that follow them. `kind: input` may be left out.",
}
PARTS = (
    BeamSection,
    BushingCurves,
    Interface,
    JointTerm,
    LoadCurve,
    LoadDistribution,
    ModalData,
    PathPoint,
    ThelenCurves,
)
"""Mappings inside declarations."""


def reference() -> str:
    """The whole page, in Markdown."""
    blocks = [HEAD]
    for section in BRANCHES:
        blocks.append(f"## {section}\n\n{INTRODUCTIONS[section]}\n")
        found = kinds(section)
        blocks += [_kind(kind, cls) for kind, cls in found.items() if cls.__module__.startswith("dms_core.")]
    blocks.append("## Signals\n\nThe `signal` of an input; `kind` chooses.\n")
    blocks += [_kind(cls.model_fields["kind"].default, cls) for cls in _signals()]
    blocks.append("## Parts\n\nMappings inside declarations; they have no `kind`.\n")
    blocks += [_kind(cls.__name__, cls) for cls in PARTS]
    return "\n".join(blocks)


def _signals() -> list[type[Signal]]:
    """Concrete signals that a file can hold, in the order of their definition."""
    pending, found = [Signal], []
    while pending:
        cls = pending.pop(0)
        pending += [c for c in cls.__subclasses__() if c.__module__.startswith("dms_core.")]
        if "kind" in cls.model_fields and cls is not Function:
            found.append(cls)
    return sorted(found, key=lambda cls: inspect.getsourcelines(cls)[1])


def _kind(title: str, cls: type[BaseModel]) -> str:
    """Heading, docstring and table of one class."""
    text = re.split(r"\n\s*(?:Example|Args|Raises):", inspect.cleandoc(cls.__doc__ or ""))[0].strip()
    lines = [f"### {title}", "", _escaped(text), ""]
    if issubclass(cls, Declaration) and hasattr(cls, "outputs") and (units := _outputs(cls)):
        lines += [f"Components: {units}.", ""]
    lines += ["| key | value | default | meaning |", "|---|---|---|---|"]
    for key, field in cls.model_fields.items():
        if key != "kind":
            value, meaning = _type(field.annotation) + _bounds(field), _escaped(field.description or "")
            lines.append(f"| `{key}` | {value} | {_default(field)} | {meaning} |")
    return "\n".join(lines) + "\n"


def _escaped(text: str) -> str:
    """Plain text in Markdown: '<name>' would be taken for a tag, '|' for the end of a cell, '*' for emphasis."""
    return re.sub(r"([<|*])", r"\\\1", text)


def _bounds(field: FieldInfo) -> str:
    """Limits of a number, as ' > 0'."""
    signs = {"gt": ">", "ge": ">=", "lt": "<", "le": "<="}
    limits = [f" {sign} {getattr(m, key):g}" for m in field.metadata for key, sign in signs.items() if hasattr(m, key)]
    return " and".join(limits)


def _outputs(cls: Any) -> str:
    """(name, unit) of a sensor's components where they do not depend on its keys."""
    try:
        parts = cls.outputs(cls.model_construct())
    except Exception:  # the components depend on keys that have no default
        return ""
    return ", ".join(f"`{name}` [{unit or '-'}]" if name else f"one [{unit}]" for name, unit in parts)


def _type(annotation: Any) -> str:
    """A Python type in plain words."""
    words = {float: "number", int: "whole number", str: "text", bool: "true or false", NoneType: "null", Any: "any"}
    if annotation in words:
        return words[annotation]
    origin, inner = get_origin(annotation), get_args(annotation)
    if hasattr(annotation, "__metadata__"):
        return _type(inner[0])
    if origin is Literal:
        return " or ".join(f"`{x}`" for x in inner)
    if origin in (Union, UnionType):
        if all(isinstance(t, type) and issubclass(t, Signal) for t in inner):
            return "[signal](#signals)"
        return " or ".join(_type(t) for t in inner if t is not NoneType)
    if origin is tuple and inner[-1] is Ellipsis:
        return f"list of {_plural(_type(inner[0]))}"
    if origin is tuple:
        return f"{len(inner)} {_plural(_type(inner[0]))}"
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return f"[{annotation.__name__}](#{annotation.__name__.lower()})"
    return str(annotation)


def _plural(word: str) -> str:
    """'numbers' from 'number'."""
    return f"{word}s" if word in ("number", "text", "whole number") else word


def _default(field: FieldInfo) -> str:
    """The default as it would be written in a file."""
    if field.is_required():
        return "required"
    value = field.get_default(call_default_factory=True)
    if value is None:
        return ""
    if isinstance(value, bool):
        return f"`{str(value).lower()}`"
    if isinstance(value, tuple):
        return f"`[{', '.join(str(x) for x in value)}]`"
    if isinstance(value, BaseModel):
        return "its defaults"
    return f"`{value}`" if value != "" else "empty"
