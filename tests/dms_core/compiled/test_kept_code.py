"""Machine code on disk is that of the present sources, in every place that numba has for it."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from dms_core.compiled.code_key import code_key
from dms_core.files.config_files import configs

FILES = {
    "numbers.py": "from typing import NamedTuple\n\nSCALE = 2.0\n\nclass Place(NamedTuple):\n    a: int\n    b: int\n\n"
    "PLACE = Place(0, 1)\n",
    "inner.py": 'from dms_core.compiled.jit import compiled\n\n@compiled\ndef term(x):\n    """A term."""\n'
    "    return x + 1.0\n\n@compiled\ndef other(x):\n    return x - 1.0\n",
    "theirs.py": "from numba import njit\n\nfrom own.inner import term\n\n@njit(cache=True)\ndef theirs(x):\n"
    "    return term(x)\n",
    "outer.py": "from dms_core.compiled.jit import compiled\nfrom own import numbers\n"
    "from own.inner import other, term\nfrom own.numbers import PLACE\nfrom own.theirs import theirs\n\n"
    "one, two = term, other\n\n"
    "@compiled(makes_arrays=True)\ndef reward(x):\n"
    "    return numbers.SCALE * one(x[PLACE.a]) + 100.0 * two(x[PLACE.b]) + 10000.0 * theirs(x[0])\n",
    "made.py": "from dms_core.compiled.jit import compiled\n\ndef times(k):\n    @compiled\n    def kernel(x):\n"
    "        return k * x\n    return kernel\n\ndouble, triple = times(2.0), times(3.0)\n",
}
RUN = """
import json, numpy as np
from own.outer import reward
from own.made import double, triple
value = reward(np.array([3.0, 7.0]))
print(json.dumps({
    "value": value, "hits": sum(reward.stats.cache_hits.values()), "folder": reward.stats.cache_path,
    "made": [double(1.0), triple(1.0)], "made_hits": [sum(f.stats.cache_hits.values()) for f in (double, triple)],
}))
"""
AT_FIRST = 2.0 * 4.0 + 100.0 * 6.0 + 10000.0 * 4.0


@pytest.fixture(params=["beside the files", "NUMBA_CACHE_DIR", "the user's cache"])
def run(request, tmp_path):
    """Function that runs a small package in a new process and gives what it prints; code is kept in one of the places.

    Its attribute `edit` replaces a text in one of the package's files.
    """
    own = tmp_path / "own"
    own.mkdir()
    (own / "__init__.py").touch()
    for name, text in FILES.items():
        (own / name).write_text(text)
    env = os.environ | {"PYTHONPATH": os.pathsep.join([str(configs().parent), str(tmp_path)])}
    env.pop("NUMBA_CACHE_DIR", None)
    # Python's own bytecode does not see an edit of the same length within the same second.
    env["PYTHONDONTWRITEBYTECODE"] = "1"
    folder = {"beside the files": own / "__pycache__", "NUMBA_CACHE_DIR": tmp_path / "kept"}.get(request.param)
    if request.param == "NUMBA_CACHE_DIR":
        env["NUMBA_CACHE_DIR"] = str(folder)
    elif folder is None:
        # Where numba goes when the package cannot be written; root can always write.
        folder = tmp_path / "home"
        env |= {"NUMBA_CACHE_LOCATOR_CLASSES": "UserWideCacheLocator", "XDG_CACHE_HOME": str(folder)}

    def call(**more: str) -> dict:
        done = subprocess.run(
            [sys.executable, "-c", RUN], env=env | more, capture_output=True, text=True, check=False, timeout=120
        )
        assert done.returncode == 0, done.stderr
        return json.loads(done.stdout) | {"said": done.stderr}

    def edit(name: str, old: str, new: str) -> None:
        text = (own / name).read_text()
        assert old in text
        (own / name).write_text(text.replace(old, new))

    call.edit, call.folder = edit, folder  # type: ignore[attr-defined]
    return call


def test_an_edit_is_seen_wherever_code_is_kept(run):
    assert run()["hits"] == 0
    run.edit("inner.py", "x + 1.0", "x + 2.0")
    found = run()
    assert found["value"] == AT_FIRST + 10002.0 and found["hits"] == 0
    assert Path(found["folder"]).is_relative_to(run.folder)


@pytest.mark.slow
@pytest.mark.parametrize("run", ["NUMBA_CACHE_DIR"], indirect=True)
def test_an_edit_anywhere_below_a_function_is_seen(run):
    first = run()
    assert first["value"] == AT_FIRST and first["hits"] == 0 and Path(first["folder"]).is_relative_to(run.folder)
    assert (again := run())["value"] == AT_FIRST and again["hits"] == 1
    assert again["made"] == [2.0, 3.0] and again["made_hits"] == [1, 1]
    # What compiles to nothing is no reason to compile.
    run.edit("inner.py", "A term.", "A term of the sum.")
    run.edit("inner.py", "from dms_core", "# Why: because.\nfrom dms_core")
    assert run()["hits"] == 1
    edits = (
        ("inner.py", "x + 1.0", "x + 2.0", 2.0 * 5.0 + 100.0 * 6.0 + 10000.0 * 5.0),
        ("numbers.py", "SCALE = 2.0", "SCALE = 3.0", 3.0 * 5.0 + 100.0 * 6.0 + 10000.0 * 5.0),
        ("numbers.py", "Place(0, 1)", "Place(1, 0)", 3.0 * 9.0 + 100.0 * 2.0 + 10000.0 * 5.0),
        ("outer.py", "one, two = term, other", "one, two = other, term", 3.0 * 6.0 + 100.0 * 5.0 + 10000.0 * 5.0),
    )
    for name, old, new, value in edits:
        run.edit(name, old, new)
        found = run()
        assert found["value"] == value and found["hits"] == 0
        assert run()["hits"] == 1


@pytest.mark.slow
@pytest.mark.parametrize("run", ["NUMBA_CACHE_DIR"], indirect=True)
def test_damaged_files_count_as_missing(run):
    run()
    for suffix in ("nbi", "nbc"):
        for damage in (lambda b: b"", lambda b: b[: len(b) // 2], lambda b: b[:-9] + bytes(9)):
            files = sorted(run.folder.rglob(f"*.{suffix}"))
            assert files
            for path in files:
                path.write_bytes(damage(path.read_bytes()))
            found = run()
            assert found["value"] == AT_FIRST and found["said"] == "" and found["hits"] == 0
    assert run()["hits"] == 1


@pytest.mark.parametrize("run", ["NUMBA_CACHE_DIR"], indirect=True)
def test_code_of_one_function_is_not_taken_for_another(run):
    """As two processes leave it that number their files at a time."""
    run()
    files = sorted(run.folder.rglob("*kernel*.nbc"))
    assert len(files) >= 2
    files[0].write_bytes(files[1].read_bytes())
    assert run()["made"] == [2.0, 3.0]


@pytest.mark.slow
@pytest.mark.parametrize("run", ["NUMBA_CACHE_DIR"], indirect=True)
def test_settings_of_numba_are_in_the_key(run):
    run()
    other = {"NUMBA_OPT": "1", "PYTHONOPTIMIZE": "1"}
    assert run(**other)["hits"] == 0
    # Code for one setting does not take the place of that for another.
    assert run(**other)["hits"] == 1 and run()["hits"] == 1


@pytest.mark.parametrize("run", ["beside the files"], indirect=True)
def test_no_place_is_said_once_and_all_works(run):
    # Functions that numba itself is to keep, it refuses without a place.
    run.edit("theirs.py", "(cache=True)", "")
    found = run(NUMBA_CACHE_LOCATOR_CLASSES="IPythonCacheLocator")
    assert found["value"] == AT_FIRST and found["folder"] is None
    assert found["said"].count("NUMBA_CACHE_DIR") == 1 and "compiles anew" in found["said"]


@pytest.mark.parametrize("run", ["beside the files"], indirect=True)
def test_functions_as_python_are_not_what_is_run(run):
    found = run(NUMBA_DISABLE_JIT="1")
    assert found["value"] == AT_FIRST and found["said"].count("NUMBA_DISABLE_JIT is set") == 1


OTHER_WAYS = {
    "vectorised": ("from numba import vectorize\n\n@vectorize\ndef f(x):\n    return 2.0 * x\n", "", "f(x)"),
    "overloaded": (
        "from numba.extending import overload\n\ndef f(x):\n    pass\n\n@overload(f)\ndef _f(x):\n"
        "    return lambda x: 2.0 * x\n",
        "", "f(x)",
    ),
    "of modules that name each other": (
        "import own\nfrom dms_core.compiled.jit import compiled\n\n@compiled\ndef f(x):\n    return 2.0 * x\n",
        "import own\nimport own.inner\n", "own.inner.f(x)",
    ),
    "of a closure": (
        "from dms_core.compiled.jit import compiled\n\ndef make(k):\n    @compiled\n    def g(x):\n"
        "        return k * x\n    return g\n\nf = make(2.0)\n",
        "", "f(x)",
    ),
    "written in LLVM": (
        "from numba import types\nfrom numba.extending import intrinsic\n\n@intrinsic\ndef f(typingctx, x):\n"
        "    def codegen(context, builder, sig, args):\n"
        "        return builder.fmul(args[0], context.get_constant(types.float64, 2.0))\n"
        "    return types.float64(types.float64), codegen\n",
        "", "f(x)",
    ),
    "as a default": (
        "from dms_core.compiled.jit import compiled\n\n@compiled\ndef f(x, k=2.0):\n    return k * x\n", "", "f(x)",
    ),
    "a constant of Python's own name": ("", "from own import profile\n", "profile.GAIN * x"),
}  # fmt: skip
"""How a function may come to what it does: the inner file, more of the outer one, and what that returns."""


def test_whatever_a_function_is_made_of_is_in_its_key(tmp_path):
    names = {way: f"way{k}" for k, way in enumerate(OTHER_WAYS)}
    for way, (inner, more, value) in OTHER_WAYS.items():
        own = tmp_path / names[way]
        own.mkdir()
        (own / "__init__.py").touch()
        (own / "profile.py").write_text("GAIN = 2.0\n")
        imported = "from own.inner import f\n" if "f(" in value and not more else ""
        head = f"from dms_core.compiled.jit import compiled\n{more}{imported}\n"
        outer = f"{head}@compiled\ndef outer(x):\n    return {value}\n"
        for file, text in (("inner.py", inner), ("outer.py", outer)):
            (own / file).write_text(re.sub(r"\bown\b", names[way], text))
    env = os.environ | {"PYTHONPATH": os.pathsep.join([str(configs().parent), str(tmp_path)])}
    call = (
        "import importlib, json, sys\nfound = {}\nfor name in sys.argv[1:]:\n"
        "    outer = importlib.import_module(f'{name}.outer').outer\n"
        "    found[name] = outer(3.0), sum(outer.stats.cache_hits.values())\nprint(json.dumps(found))\n"
    )

    def run() -> dict[str, list[float]]:
        done = subprocess.run(
            [sys.executable, "-c", call, *names.values()],
            env=env, capture_output=True, text=True, check=False, timeout=240,
        )  # fmt: skip
        assert done.returncode == 0, done.stderr
        found = json.loads(done.stdout)
        return {way: found[name] for way, name in names.items()}

    assert run() == dict.fromkeys(OTHER_WAYS, [6.0, 0])
    assert run() == dict.fromkeys(OTHER_WAYS, [6.0, 1])
    for name in names.values():
        for file in ("inner.py", "profile.py"):
            path = tmp_path / name / file
            path.write_text(path.read_text().replace("2.0", "5.0"))
    assert run() == dict.fromkeys(OTHER_WAYS, [15.0, 0])


def test_what_no_key_can_hold_is_not_kept():
    call = (
        "from dms_core.compiled.jit import compiled\nfrom dms_core.compiled.code_key import NoKeyError, code_key\n"
        "class Own:\n    pass\n"
        "own = Own()\n"
        "@compiled\n"
        "def f(x):\n    return x if own is None else 2.0 * x\n"
        "try:\n    code_key(f)\nexcept NoKeyError as error:\n    print(error)\n"
    )
    env = os.environ | {"PYTHONPATH": str(configs().parent)}
    done = subprocess.run([sys.executable, "-c", call], env=env, capture_output=True, text=True, check=True)
    assert done.stdout == "a __main__.Own\n"


def test_a_full_disk_costs_time_only(monkeypatch, capsys):
    from numba.core.caching import IndexDataCacheFile

    from dms_core.compiled import kept_code
    from dms_core.compiled.jit import compiled

    def full(*arguments: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(IndexDataCacheFile, "_open_for_write", full)
    monkeypatch.setattr(kept_code, "_said", False)

    @compiled
    def twice(x):
        return 2.0 * x

    assert twice(2.0) == 4.0 and twice(3) == 6.0
    said = capsys.readouterr().err
    assert said.count("No space left on device") == 1 and "NUMBA_CACHE_DIR" in said


def test_keys_are_the_same_in_every_process():
    """Sets and addresses come in another order in each; a key that held them would compile all over again."""
    call = (
        "from dms_core.compiled.code_key import code_key; from dms_core.linear.lu import factor; "
        "from dms_core.simulation.step_control import advance_method; print(code_key(factor)[0], "
        "code_key(advance_method)[0])"
    )
    found = set()
    for seed in ("1", "2"):
        env = os.environ | {"PYTHONPATH": str(configs().parent), "PYTHONHASHSEED": seed}
        done = subprocess.run([sys.executable, "-c", call], env=env, capture_output=True, text=True, check=True)
        found.add(done.stdout)
    from dms_core.linear.lu import factor

    assert len(found) == 1 and found.pop().split()[0] == code_key(factor)[0]
