"""How functions of this package are compiled: `compiled` is numba.njit with this project's habits.

numba compiles a function anew for every constant that it is called with (offset 0, offset 7, row 3, ...), which would
triple the time of a first run; here a function is compiled once for each combination of types. Machine code is kept on
disk, and a division by zero gives inf or nan as in numpy, so that a kernel called by address never raises.
"""

from __future__ import annotations

from collections.abc import Callable
from types import FunctionType
from typing import Any

from numba import config, njit, types

from dms_core.compiled.compilation import CALLED, count_function, write
from dms_core.compiled.kept_code import keep

_settings: Any = config
if _settings.DISABLE_JIT:
    _settings.DISABLE_JIT = 0
    write(
        "dms_core: NUMBA_DISABLE_JIT is set, and off from here on: this package's functions call each other by "
        "addresses of machine code.\n"
    )


def compiled(function: Callable | None = None, makes_arrays: bool | None = None, **options: Any) -> Any:
    """Decorator: compile on first use, once for each combination of types, and keep the machine code on disk.

    Args:
        function: the function.
        makes_arrays: whether it allocates an array, copies one to another by slices, or gives one back. numba then
            counts the references to all its arrays, which makes a quarter more code. None: functions of this package
            do not, those of other packages may. Where it is wrongly False, numba refuses to compile the function.
        options: of numba.njit.
    """
    if function is None:
        return lambda f: compiled(f, makes_arrays, **options)
    counted = not function.__module__.startswith("dms_core.") if makes_arrays is None else makes_arrays
    habits: dict[str, Any] = {"error_model": "numpy", "no_cfunc_wrapper": True, "_nrt": counted}
    dispatcher = njit(**habits, **options)(function)
    inner = njit(**{**habits, **options, "no_cpython_wrapper": True})(_renamed(function))
    keep(dispatcher)
    keep(inner)
    by_types = inner.get_call_template

    def get_call_template(args: tuple, kws: dict) -> Any:
        return by_types(tuple(types.unliteral(a) for a in args), {k: types.unliteral(a) for k, a in kws.items()})

    dispatcher.get_call_template, dispatcher.get_overload = get_call_template, inner.get_overload
    count_function()
    return dispatcher


def _renamed(function: Callable) -> FunctionType:
    """The function under a name of its own, as numba keeps machine code by name.

    Most functions are called from compiled code only. What lets Python call one, its arguments taken out of objects, is
    a good part of its code; so callers that are compiled get this copy, which is without.
    """
    name = f"{function.__name__}{CALLED}"
    code = function.__code__.replace(co_name=name, co_qualname=name)
    copy = FunctionType(code, function.__globals__, name, function.__defaults__, function.__closure__)
    copy.__module__, copy.__qualname__ = function.__module__, name
    return copy
