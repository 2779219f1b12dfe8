"""What the machine code of a function was made from, as one key: the function and everything that is compiled into it.

numba tells old machine code from new by the source file of a function alone. Code of other files goes into it too: of
functions that it calls, constants and places of arrays that it names, at any depth. `code_key` walks all of it, so that
an edit anywhere below a function gives it another key, and an edit of anything else does not.

What numba.extending registers is named by nothing. The source of a module that uses it counts as a whole, if the walk
comes through that module; what extends functions of others in a module that it does not come through is not seen.
"""

from __future__ import annotations

import enum
import hashlib
import sys
import sysconfig
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from types import CodeType, FunctionType, ModuleType
from typing import Any

import llvmlite
import numba
import numpy as np
from numba import types
from numba.core import config
from numba.core.ccallback import CFunc
from numba.core.dispatcher import Dispatcher
from numba.extending import intrinsic
from numba.np.ufunc.dufunc import DUFunc
from numba.np.ufunc.gufunc import GUFunc
from numba.np.ufunc.ufuncbuilder import UFuncDispatcher

FOREIGN = frozenset({"numba", "llvmlite", "numpy", *sys.stdlib_module_names})
"""Packages that are known by their versions; what they hold is known by its name."""
SWITCHES = (
    "OPT", "BOUNDSCHECK", "LOOP_VECTORIZE", "SLP_VECTORIZE", "ENABLE_AVX", "DEBUGINFO_DEFAULT", "DISABLE_INTEL_SVML",
)  # fmt: skip
"""Settings of numba that change code, by environment variables too; the processor is in numba's own key."""
INTRINSIC = type(intrinsic(lambda typingctx: None))
"""Class of functions that write LLVM."""
MADE_OF: dict[type, str] = {
    Dispatcher: "py_func", INTRINSIC: "_defn", DUFunc: "_dispatcher", GUFunc: "_dispatcher",
    UFuncDispatcher: "py_func", CFunc: "_pyfunc",
}  # fmt: skip
"""What numba's decorators give, and where each keeps the function that it is made of."""
USUAL = (bool, int, float, complex, str, bytes, type(None), type(...), slice, range, enum.Enum, np.generic, np.dtype)
"""Values that are what they are written as."""


class NoKeyError(Exception):
    """Something goes into a function that cannot be told from something else in another process."""


def code_key(function: Any) -> tuple[str, list[Any]]:
    """Key of all that a compiled function is made from but the types of its arguments; the compiled functions in it.

    Raises:
        NoKeyError: it names something that cannot be put into a key.
    """
    walk = _Walk()
    key = walk.key(function)
    return key, [f for f in walk.functions if isinstance(f, Dispatcher)]


@cache
def _settings() -> bytes:
    """Versions, and settings of Python and numba that change code."""
    switches = {name: getattr(config, name, None) for name in SWITCHES}
    versions = f"{numba.__version__} {llvmlite.__version__} {np.__version__} {sys.version_info}"
    return f"{versions} {sys.flags.optimize} {switches}".encode()


def setting_key() -> str:
    """A short key of the settings: code for one of them does not take the place of code for another."""
    return hashlib.sha256(_settings()).hexdigest()[:8]


@cache
def _surroundings() -> bytes:
    """What shapes all code: the settings, and how this package has functions compiled."""
    return b"\0".join([_settings(), *(path.read_bytes() for path in sorted(Path(__file__).parent.glob("*.py")))])


class _Walk:
    """One walk from a function to all that goes into it. Functions are told apart by their numbers on the way."""

    def __init__(self) -> None:
        self.functions: list[Any] = []
        """In the order in which they were met."""
        self._numbers: dict[int, int] = {}
        self._modules: set[str] = set()

    def key(self, function: Any) -> str:
        digest = hashlib.sha256(_surroundings())
        self._number(function)
        for each in self.functions:  # grows on the way
            digest.update(self._function(each).encode("utf-8", "surrogatepass") + b"\0")
        for name in sorted(self._modules):
            digest.update(_extension(name))
        return digest.hexdigest()

    def _number(self, function: Any) -> int:
        found = self._numbers.setdefault(id(function), len(self.functions))
        if found == len(self.functions):
            self.functions.append(function)
        return found

    def _function(self, function: Any) -> str:
        """A function by its code and by what its names stand for, as text."""
        for kind, inside in MADE_OF.items():
            if isinstance(function, kind):
                options = sorted(getattr(function, "targetoptions", {}).items())
                # Those of fastmath are a set within an object.
                said = [self._text([name, getattr(x, "flags", x)]) for name, x in options]
                said.append(self._text(getattr(function, "locals", {})))
                return f"{kind.__name__} {said} {self._number(getattr(function, inside))}"
        self._modules.add(function.__module__)
        code, names = _code(function.__code__)
        cells = [cell.cell_contents for cell in function.__closure__ or ()]
        given = [*(function.__defaults__ or ()), *(function.__kwdefaults__ or {}).items(), *cells]
        named = [f"{name}={self._text(value)}" for name, value in _named(function.__globals__, names)]
        return f"{code} {[self._text(value) for value in given]} {named}"

    def _text(self, value: Any) -> str:
        """A value that a function names."""
        kind = type(value)
        if isinstance(value, FunctionType) and _foreign(value.__module__):
            return f"{value.__module__}.{value.__qualname__}"
        if isinstance(value, (FunctionType, *MADE_OF)):
            return f"function {self._number(value)}"
        if isinstance(value, ModuleType):
            self._modules.add(value.__name__)
            return f"module {value.__name__}"
        if isinstance(value, type):
            self._modules.add(value.__module__)
            members = [(m.name, m.value) for m in value] if issubclass(value, enum.Enum) else []
            return f"{value.__module__}.{value.__qualname__} {getattr(value, '_fields', ())} {members}"
        if isinstance(value, np.ndarray):
            return f"{value.dtype} {value.shape} {hashlib.sha256(value.tobytes()).hexdigest()}"
        if isinstance(value, tuple | list):
            return f"{kind.__name__}{getattr(value, '_fields', ())}({','.join(self._text(x) for x in value)})"
        if isinstance(value, dict):
            return self._text([item for pair in value.items() for item in pair])
        if isinstance(value, set | frozenset):
            return f"{kind.__name__} {sorted(self._text(x) for x in value)}"
        if isinstance(value, types.Type):
            self._modules.add(kind.__module__)
            return f"{_written(value)} {getattr(getattr(value, 'instance_class', None), '_fields', ())}"
        if isinstance(value, USUAL) or _foreign(kind.__module__):
            return f"{kind.__module__}.{kind.__qualname__} {_written(value)}"
        raise NoKeyError(f"a {kind.__module__}.{kind.__qualname__}")


def _written(value: Any) -> str:
    """A value as text.

    Raises:
        NoKeyError: it holds an address, which is another one in each process.
    """
    text = repr(value)
    if " at 0x" in text:
        raise NoKeyError(text)
    return text


@cache
def _foreign(module: str | None) -> bool:
    """Whether a module is of a foreign package; a file of one's own may have the name of one of Python's."""
    root = (module or "").partition(".")[0]
    file = getattr(sys.modules.get(root), "__file__", None)
    return root in FOREIGN and (file is None or any(Path(file).is_relative_to(place) for place in _places()))


@cache
def _places() -> list[Path]:
    """Folders of Python's own modules and of the foreign packages."""
    packages = [Path(str(package.__file__)).parent for package in (numba, llvmlite, np)]
    return [Path(sysconfig.get_path("stdlib")), Path(sysconfig.get_path("platstdlib")), *packages]


@cache
def _extension(name: str) -> bytes:
    """The source of a module that tells numba how something is compiled; nothing of any other."""
    module = sys.modules.get(name)
    file = getattr(module, "__file__", None)
    if _foreign(name) or file is None:
        return b""
    named = [getattr(value, "__module__", None) or getattr(value, "__name__", "") for value in vars(module).values()]
    modules = [value.__name__ for value in vars(module).values() if isinstance(value, ModuleType)]
    extends = "numba.core.extending" in named or {"numba.extending", "numba.experimental"} & set(modules)
    return Path(file).read_bytes() if extends else b""


def _named(scope: dict[str, Any], names: tuple[str, ...]) -> Iterator[tuple[str, Any]]:
    """What names stand for: globals, and what they take out of modules, but for foreign ones."""
    found, seen = [(name, scope[name]) for name in names if name in scope], set[int]()
    for name, value in found:  # grows on the way
        yield name, value
        # Modules may name each other.
        if isinstance(value, ModuleType) and id(value) not in seen and not _foreign(value.__name__):
            seen.add(id(value))
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
