"""Populations between two others: their distributions of the same kinds, with numbers between those of the two."""

from __future__ import annotations

from typing import Any

from dms_core.errors import InputError
from exo_env.patient.population import Population


def between(one: Population, other: Population, part: float) -> Population:
    """A population on the way from one to another.

    Args:
        one: population with fields.
        other: population with the same fields, each with a distribution of the same kind.
        part: of the way, from 0 to 1: numbers are (1 - part) a + part b, log-uniform limits a^(1 - part) b^part.

    Raises:
        InputError: the two are no populations with the same fields and kinds of distributions, or `part` is outside its
            range.
    """
    if not 0.0 <= part <= 1.0:
        raise InputError(f"part = {part}: expected a number from 0 to 1.")
    for end, share in ((one, 0.0), (other, 1.0)):
        if part == share:
            return end
    for end in (one, other):
        if end.mixture:
            raise InputError(f"'{end.title}' is a mixture; expected a population with fields.")
    first, second = one.fields_in_full, other.fields_in_full
    if first.keys() != second.keys():
        names = ", ".join(sorted(first.keys() ^ second.keys()))
        raise InputError(f"'{one.title}' and '{other.title}' do not have the same fields; only one has {names}.")
    fields = {name: _between(name, first[name], second[name], part) for name in first}
    return Population(title=f"{part:.3g} of the way from {one.title} to {other.title}", fields=fields)


def _between(field: str, a: Any, b: Any, part: float, logarithmic: bool = False) -> Any:
    """A specification of a distribution, or a number in it, between two others."""
    if isinstance(a, dict) and isinstance(b, dict) and a.keys() == b.keys():
        return {key: _between(field, a[key], b[key], part, key == "log_uniform") for key in a}
    if isinstance(a, list | tuple) and isinstance(b, list | tuple) and len(a) == len(b):
        return [_between(field, x, y, part, logarithmic) for x, y in zip(a, b, strict=True)]
    numbers = all(isinstance(x, int | float) and not isinstance(x, bool) for x in (a, b))
    if numbers and a != b:
        return a ** (1.0 - part) * b**part if logarithmic else (1.0 - part) * a + part * b
    if a != b:
        raise InputError(f"fields: {field}: nothing lies between {a!r} and {b!r}; expected distributions of one kind.")
    return a
