"""What can be known of a kernel before it is compiled: whether it is one, and what it uses."""

from __future__ import annotations

import inspect
from collections.abc import Iterator
from functools import cache
from typing import Any

from numba.core.dispatcher import Dispatcher

from dms_core.errors import InputError


def check_kernel(owner: object, name: str) -> Any:
    """The kernel that `owner` declares as its attribute `name`.

    Raises:
        InputError: there is none, or it is no compiled function of one argument.
    """
    found = getattr(owner, name, None)
    # numba binds a compiled function of a class to its objects, as Python does with a function.
    found = getattr(found, "__func__", found)
    who = f"{type(owner).__name__}: {name}"
    expected = "expected a compiled kernel, a function of one packed world with the decorator `compiled`"
    if not isinstance(found, Dispatcher):
        kind = f"the Python function '{found.__name__}'" if inspect.isfunction(found) else repr(found)
        raise InputError(f"{who} is {kind}; {expected} of exo_env.kernels.")
    arguments = inspect.signature(found.py_func).parameters
    if len(arguments) != 1:
        raise InputError(f"{who} is '{found.py_func.__name__}' of {len(arguments)} arguments; {expected}.")
    return found


def _named(function: Any) -> list[Any]:
    """Global variables and variables of enclosing functions that a Python function names."""
    seen = inspect.getclosurevars(function)
    return [*seen.globals.values(), *seen.nonlocals.values()]


def _walk(kernel: Any, done: set[int]) -> Iterator[Any]:
    for value in _named(kernel.py_func):
        if id(value) not in done:
            done.add(id(value))
            yield value
            if isinstance(value, Dispatcher):
                yield from _walk(value, done)


@cache
def used_by(kernel: Any) -> tuple[Any, ...]:
    """Everything that a kernel and the compiled functions that it calls refer to by a name."""
    return tuple(_walk(kernel, {id(kernel)}))


def uses(kernel: Any, thing: Any) -> bool:
    """Whether a kernel, or a compiled function that it calls, refers to a thing, or is it."""
    return kernel is thing or any(x is thing for x in used_by(kernel))
