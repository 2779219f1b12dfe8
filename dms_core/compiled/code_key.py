"""What the machine code of a function was made from, as one key: the function and everything that is compiled into it.

numba tells old machine code from new by the source file of a function alone. Code of other files goes into it too: of
functions that it calls, constants and places of arrays that it names, at any depth. `code_key` walks all of it, so that
an edit anywhere below a function gives it another key, and an edit of anything else does not.
"""

from __future__ import annotations

import enum
import hashlib
import sys
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from types import BuiltinFunctionType, CodeType, FunctionType, ModuleType
from typing import Any

import llvmlite
import numba
import numpy as np
from numba import types
from numba.core import config
from numba.core.dispatcher import Dispatcher
from numba.extending import intrinsic

FOREIGN = frozenset({"numba", "llvmlite", "numpy", *sys.stdlib_module_names})
"""Packages that are known by their versions; what they hold is known by its name."""
SWITCHES = ("OPT", "BOUNDSCHECK", "LOOP_VECTORIZE", "SLP_VECTORIZE", "ENABLE_AVX", "DEBUGINFO_DEFAULT")
"""Settings of numba that change code, by environment variables too; the processor is in numba's own key."""
INTRINSIC = type(intrinsic(lambda typingctx: None))
"""Class of functions that write LLVM."""


def code_key(function: Any) -> tuple[str, list[Any]]:
    """Key of all that a compiled function is made from but the types of its arguments; the compiled functions in it."""
    walk = _Walk()
    key = walk.key(function)
    return key, [f for f in walk.functions if isinstance(f, Dispatcher)]


@cache
def _surroundings() -> bytes:
    """What shapes all code: versions, numba's settings, and how this package has functions compiled."""
    switches = {name: getattr(config, name, None) for name in SWITCHES}
    said = f"{numba.__version__} {llvmlite.__version__} {np.__version__} {sys.version_info} {switches}"
    sources = [path.read_bytes() for path in sorted(Path(__file__).parent.glob("*.py"))]
    return b"\0".join([said.encode(), *sources])


class _Walk:
    """One walk from a function to all that goes into it. Functions are told apart by their numbers on the way."""

    def __init__(self) -> None:
        self.functions: list[Any] = []
        """In the order in which they were met."""
        self._numbers: dict[int, int] = {}

    def key(self, function: Any) -> str:
        digest = hashlib.sha256(_surroundings())
        self._number(function)
        for each in self.functions:  # grows on the way
            digest.update(self._function(each).encode("utf-8", "surrogatepass") + b"\0")
        return digest.hexdigest()

    def _number(self, function: Any) -> int:
        found = self._numbers.setdefault(id(function), len(self.functions))
        if found == len(self.functions):
            self.functions.append(function)
        return found

    def _function(self, function: Any) -> str:
        """A function by its code and by what its names stand for, as text."""
        if isinstance(function, Dispatcher):
            # Those of fastmath are a set within an object.
            options = {name: getattr(x, "flags", x) for name, x in sorted(function.targetoptions.items())}
            return f"compiled {self._text(options)} {self._text(function.locals)} {self._number(function.py_func)}"
        if isinstance(function, INTRINSIC):
            return f"intrinsic {self._number(function._defn)}"
        code, names = _code(function.__code__)
        cells = [cell.cell_contents for cell in function.__closure__ or ()]
        given = [*(function.__defaults__ or ()), *(function.__kwdefaults__ or {}).items(), *cells]
        named = [f"{name}={self._text(value)}" for name, value in _named(function.__globals__, names)]
        return f"{code} {[self._text(value) for value in given]} {named}"

    def _text(self, value: Any) -> str:
        """A value that a function names."""
        kind = type(value)
        if isinstance(value, FunctionType) and _root(value.__module__) in FOREIGN:
            return f"{value.__module__}.{value.__qualname__}"
        if isinstance(value, Dispatcher | INTRINSIC | FunctionType):
            return f"function {self._number(value)}"
        if isinstance(value, ModuleType | BuiltinFunctionType):
            return f"{getattr(value, '__module__', '')}.{value.__name__}"
        if isinstance(value, type):
            members = [(m.name, m.value) for m in value] if issubclass(value, enum.Enum) else []
            return f"{value.__module__}.{value.__qualname__} {getattr(value, '_fields', ())} {members}"
        if isinstance(value, types.Type):
            return f"{value} {getattr(getattr(value, 'instance_class', None), '_fields', ())}"
        if isinstance(value, np.ndarray):
            return f"{value.dtype} {value.shape} {hashlib.sha256(value.tobytes()).hexdigest()}"
        if isinstance(value, tuple | list):
            return f"{kind.__name__}{getattr(value, '_fields', ())}({','.join(self._text(x) for x in value)})"
        if isinstance(value, dict):
            return self._text([item for pair in value.items() for item in pair])
        if isinstance(value, set | frozenset):
            return f"{kind.__name__} {sorted(map(repr, value))}"
        return f"{kind.__module__}.{kind.__qualname__} {_said(value)}"


def _said(value: Any) -> str:
    """A value as text; for one whose text holds an address, another one in each process, its class's source."""
    text = repr(value)
    if " at 0x" not in text:
        return text
    file = getattr(sys.modules.get(type(value).__module__), "__file__", None)
    return hashlib.sha256(Path(file).read_bytes()).hexdigest() if file else ""


def _root(module: str | None) -> str:
    """The package of a module."""
    return (module or "").partition(".")[0]


def _named(scope: dict[str, Any], names: tuple[str, ...]) -> Iterator[tuple[str, Any]]:
    """What names stand for: globals, and what they take out of modules, but for foreign ones."""
    found = [(name, scope[name]) for name in names if name in scope]
    for name, value in found:  # grows on the way
        yield name, value
        if isinstance(value, ModuleType) and _root(value.__name__) not in FOREIGN:
            found.extend((f"{name}.{x}", vars(value)[x]) for x in names if x in vars(value))


@cache
def _code(code: CodeType) -> tuple[str, tuple[str, ...]]:
    """Key of code without its place in the file, and all names in it, those of inner functions too."""
    inner = [_code(c) for c in code.co_consts if isinstance(c, CodeType)]
    constants = [c for c in code.co_consts if not isinstance(c, CodeType)]
    if _documented(code):
        constants[0] = ""
    said = [repr(sorted(map(repr, c)) if isinstance(c, frozenset) else c) for c in constants]
    parts = (
        code.co_code.hex(), said, code.co_names, code.co_varnames, code.co_freevars, code.co_cellvars,
        code.co_argcount, code.co_kwonlyargcount, code.co_flags, [key for key, _ in inner],
    )  # fmt: skip
    names = dict.fromkeys([*code.co_names, *(name for _, more in inner for name in more)])
    return hashlib.sha256(repr(parts).encode("utf-8", "surrogatepass")).hexdigest(), tuple(names)


def _documented(code: CodeType) -> bool:
    """Whether the first constant is a docstring, which compiles to nothing."""
    if not (code.co_consts and isinstance(code.co_consts[0], str)):
        return False
    # Until Python 3.12 a function without one has None there; since then a flag tells.
    return bool(code.co_flags & 0x4000000) if sys.version_info >= (3, 13) else not code.co_name.startswith("<")
