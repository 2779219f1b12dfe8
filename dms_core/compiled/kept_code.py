"""Machine code on disk, in whichever place numba has for it: used where it fits, made anew where it does not.

numba's own way asks whether the source file of a function is the same, trusts what it finds and stops where it cannot
write. Here the code is kept under the key of all that it was made from (code_key.py), each file says whose it is and
holds a checksum of its content, so that a file which is damaged or belongs to something else counts as missing, and a
place that cannot be written costs time only; that is said once.
"""

from __future__ import annotations

import contextlib
import hashlib
import pickle
import warnings
from functools import cached_property
from pathlib import Path
from typing import Any

from numba.core.caching import FunctionCache, IndexDataCacheFile, NullCache

from dms_core.compiled.code_key import NoKeyError, code_key, setting_key
from dms_core.compiled.compilation import write

CHECKSUM = 32
"""Bytes at the beginning of a file of code."""


def keep(function: Any) -> None:
    """From now on, keep the machine code of a function on disk; nothing is read or written before it is needed."""
    function._cache = KeptCode(function)


class KeptCode(NullCache):
    """What numba asks for machine code of one function. The place is found when it is first asked for.

    Args:
        function: the function.
    """

    def __init__(self, function: Any) -> None:
        self._function = function

    @cached_property
    def _place(self) -> _Place | None:
        """Where the code is, None where there is no place for it."""
        try:
            return _Place(self._function)
        except NoKeyError:
            return None
        except (RuntimeError, OSError):
            source = Path(self._function.py_func.__code__.co_filename)
            # What is typed in has no file, and no place.
            if source.is_file():
                _say_once(f"neither '{source.parent}' nor the user's cache takes machine code")
        return None

    @property
    def cache_path(self) -> str | None:
        """The folder; None where there is no place."""
        return self._place.cache_path if self._place else None

    @property
    def fits(self) -> bool:
        """Whether there is code of this function that is made from what it is now."""
        return self._place is not None and self._place.fits

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """The code for these types; None where there is none, or none that fits."""
        return self._place and self._place.load_overload(sig, target_context)

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep the code, where that is possible."""
        if self._place is None:
            return
        try:
            self._place.save_overload(sig, data)
        except OSError as error:
            _say_once(f"'{self._place.cache_path}' takes no machine code ({error.strerror})")

    def flush(self) -> None:
        """Forget what is on disk."""
        if self._place is not None:
            self._place.flush()


class _Place(FunctionCache):
    """numba's cache of one function, with another key and other files."""

    def __init__(self, function: Any) -> None:
        super().__init__(function.py_func)
        self._function = function
        self._renew()

    def _renew(self) -> None:
        """Find the key; what the function names may have become something else since it was last found."""
        key, into = code_key(self._function)
        for function in into:
            # What is compiled into ours has to be found by a key as good, whoever wrote it.
            if type(function._cache) is FunctionCache:
                keep(function)
        # A function that makes functions gives all of them one name and one line.
        which = f".{key[:16]}" if self._function.py_func.__closure__ else ""
        self._cache_file = _File(self._cache_path, f"{self._impl.filename_base}.{setting_key()}{which}", key)

    @property
    def fits(self) -> bool:
        return bool(self._cache_file._load_index())

    def _index_key(self, sig: Any, codegen: Any) -> Any:
        # Named tuples with other names in the same places are the same type to numba.
        names = [getattr(getattr(t, "instance_class", None), "_fields", ()) for t in getattr(sig, "args", sig)]
        return sig, codegen.magic_tuple(), tuple(names)

    def _load_overload(self, sig: Any, target_context: Any) -> Any:
        # Whatever is wrong with a file, the code can be compiled.
        with contextlib.suppress(Exception):
            self._renew()
            return super()._load_overload(sig, target_context)
        return None

    def _save_overload(self, sig: Any, data: Any) -> None:
        with contextlib.suppress(NoKeyError):
            self._renew()
            super()._save_overload(sig, data)


class _File(IndexDataCacheFile):
    """Index and files of code of one function."""

    def load(self, key: Any) -> Any:
        self._what = repr(key)
        return super().load(key)

    def save(self, key: Any, data: Any) -> None:
        self._what = repr(key)
        super().save(key, data)

    def _load_index(self) -> dict[Any, str]:
        # An index that is damaged, cannot be read, or names modules as they were before a move holds nothing.
        with contextlib.suppress(Exception), warnings.catch_warnings():
            warnings.simplefilter("error", FutureWarning)
            return super()._load_index()
        return {}

    def _load_data(self, name: str) -> Any:
        with open(self._data_path(name), "rb") as file:
            checksum, content = file.read(CHECKSUM), file.read()
        if checksum != self._checksum(content):
            raise OSError(f"'{name}' is damaged, or holds another function")
        return pickle.loads(content)

    def _save_data(self, name: str, data: Any) -> None:
        content = self._dump(data)
        with self._open_for_write(self._data_path(name)) as file:
            file.write(self._checksum(content) + content)

    def _checksum(self, content: bytes) -> bytes:
        """Checksum of the content and its owner: two processes that write at a time may mix up the numbers of files."""
        owner = f"{self._source_stamp} {self._what}".encode()
        return hashlib.blake2b(owner + content, digest_size=CHECKSUM).digest()


_said = False


def _say_once(what: str) -> None:
    """One sentence on stderr, the first time that code cannot be kept."""
    global _said
    if _said:
        return
    _said = True
    write(
        f"dms_core: {what}, so that each start compiles anew, which takes about a minute. Set the environment variable "
        "NUMBA_CACHE_DIR to a folder that can be written.\n"
    )
