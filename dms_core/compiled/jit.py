"""How functions of this package are compiled: `compiled` is numba.njit with this project's habits.

numba compiles a function anew for every constant that it is called with (offset 0, offset 7, row 3, ...), which would
triple the time of a first run; here a function is compiled once for each combination of types. Machine code is kept on
disk, and a division by zero gives inf or nan as in numpy, so that a kernel called by address never raises.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from numba import njit, types

from dms_core.compiled.compilation import count_function, drop_stale_code

drop_stale_code()


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
    habits: dict[str, Any] = {"cache": True, "error_model": "numpy", "no_cfunc_wrapper": True, "_nrt": counted}
    dispatcher = njit(**habits, **options)(function)
    by_types = dispatcher.get_call_template

    def get_call_template(args: tuple, kws: dict) -> Any:
        return by_types(tuple(types.unliteral(a) for a in args), {k: types.unliteral(a) for k, a in kws.items()})

    dispatcher.get_call_template = get_call_template
    count_function()
    return dispatcher
