"""How a number of a person or a patient is declared: once, with its range, its unit and where it acts.

    grip_strength: float = trait(1.0, ge=0.0, le=2.0, unit="-", acts="effort", description="...; assumed")

Everything else follows: the patient's row of numbers, the ranges that populations are checked against, what a
privileged observer is shown, and how the numbers of a world are scaled. `acts` says which part of the simulation reads
the number:

    size      body and muscles: the numbers of the world are scaled with it (world/kernels/scaling.py)
    muscle    time constants of the muscles
    effort    from the command to the excitations, at every tick of the patient (patient/excitation/effort.py)
    plan      what the patient expects when the command is planned (patient/excitation/motor_command.py)
    joint     a number of a joint's own element, in which the numbers of the world are linear (ecosystem/arm.py)
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, Literal

from pydantic import BaseModel, Field
from pydantic.fields import FieldInfo

from dms_core.errors import InputError

Acts = Literal["size", "muscle", "effort", "plan", "joint"]


def trait(
    default: Any,
    *,
    acts: Acts,
    unit: str = "-",
    neutral: bool = False,
    description: str,
    **limits: float,
) -> Any:
    """A number of a person or a patient.

    Args:
        default: value of a healthy subject.
        acts: part of the simulation that reads it.
        unit: SI unit.
        neutral: True where the default changes nothing, so that a population file need not name it. Every trait that
            is added later must be neutral, or files that users have would no longer load.
        description: what it is, with the source of its range or the word "assumed".
        limits: `ge`, `gt` and `le` of what is accepted.
    """
    more = {"unit": unit, "acts": acts, "neutral": neutral}
    return Field(default=default, description=description, json_schema_extra=more, **limits)  # type: ignore[call-overload]


def _declared(field: FieldInfo, key: str) -> Any:
    """A declaration of a trait by its key; None for a field that is no trait."""
    extra = field.json_schema_extra
    return extra.get(key) if isinstance(extra, dict) else None


def traits_of(model: type[BaseModel], *acts: Acts) -> tuple[str, ...]:
    """Names of a model's traits that act in one of some parts, in the order of their declaration."""
    return tuple(name for name, field in model.model_fields.items() if _declared(field, "acts") in acts)


def unit_of(model: type[BaseModel], name: str) -> str:
    """SI unit of a trait."""
    return str(_declared(model.model_fields[name], "unit"))


def neutral_traits(model: type[BaseModel]) -> frozenset[str]:
    """Names of the traits that a population file need not name."""
    return frozenset(name for name, field in model.model_fields.items() if _declared(field, "neutral"))


def range_of(model: type[BaseModel], name: str) -> tuple[float, float]:
    """Least and greatest value of a trait.

    Raises:
        InputError: the trait is declared without a greatest value.
    """
    limits: dict[str, float] = {}
    for rule in model.model_fields[name].metadata:
        limits |= {k: float(getattr(rule, k)) for k in ("ge", "gt", "le") if hasattr(rule, k)}
    if "le" not in limits:
        raise InputError(
            f"{model.__name__}: trait '{name}' has no greatest value; expected le=... in its declaration, since "
            "populations are checked against its range and channels show it in that scale."
        )
    return limits.get("ge", limits.get("gt", 0.0)), limits["le"]


def row_of(values: Iterable[Any], words: tuple[str, ...]) -> list[float]:
    """Numbers of traits; a word becomes its place in `words`."""
    return [float(words.index(x)) if isinstance(x, str) else float(x) for x in values]
