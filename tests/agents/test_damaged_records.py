"""Damaged evaluations, checkpoints and numbers: one sentence with file and key, and what is unusual is still drawn."""

import copy
import json
import pickle
import struct
import zipfile
from pathlib import Path

import numpy as np
import pytest

from agents.checkpoint import Store
from agents.commands.pictures.report_input import collected
from agents.evaluation.comparison.evaluate import VERSION
from agents.policies.safetensors import from_bytes, to_bytes
from agents.policies.tuned import Range, numbers
from dms_core.errors import DmsError, InputError

OLD = Path(__file__).with_name("before_the_move")


@pytest.fixture
def evaluation(tmp_path):
    """A file, and what it holds."""
    return tmp_path / "evaluation.json", json.loads((OLD / "evaluation.json").read_text())


def changed(content, path, value):
    """A copy with another value; a missing one where it is `...`."""
    found = copy.deepcopy(content)
    *way, last = path
    place = found
    for key in way:
        place = place[key]
    if value is ...:
        del place[last]
    else:
        place[last] = value
    return found


EPISODE = ("policies", "pid", "episodes", 1)


@pytest.mark.parametrize(
    "said, path, value",
    [
        (f"of version {VERSION + 1}: expected at most {VERSION}", ("version",), VERSION + 1),
        ("version = '1'", ("version",), "1"),
        ("'policies' is missing", ("policies",), ...),
        ("policies = {}", ("policies",), {}),
        ("'confidence' is missing", ("confidence",), ...),
        ("confidence = 2", ("confidence",), 2),
        ("seed = -1", ("seed",), -1),
        ("patients = 0", ("patients",), 0),
        ("patients = 1000000000", ("patients",), 10**9),
        ("2 episodes of 2 patients: expected 1 of each of 3", ("patients",), 3),
        ("2 episodes of 2 patients: expected 3 of each of 2", ("loads",), [1.0, 2.0, 3.0]),
        ("loads.0 = 'x'", ("loads",), ["x"] * 10**5),
        ("repetitions = 'x'", ("settings",), {"repetitions": "x"}),
        ("setting 'foo' is unknown", ("settings",), {"foo": 1}),
        ("exoskeleton = 3", ("settings",), {"exoskeleton": 3}),
        ("environment 'exo/Nothing-v1' is not registered", ("environment",), "exo/Nothing-v1"),
        ("low = 1", ("policies", "pid", "summary", "unsafe", "low"), 1),
        ("title = 'xxxx", ("policies", "pid", "title"), "x" * 1000),
        ("'self' is no setting", ("settings",), {"self": 1}),
        ("'patient' is no setting", ("settings",), {"patient": "stroke_mild"}),
        ("policies: pid: episodes = []", ("policies", "pid", "episodes"), []),
        ("policies: pid: episodes: 1: seed = 'x'", (*EPISODE, "seed"), "x"),
        ("policies: pid: expected a mapping", ("policies", "pid"), None),
        ("policies: pid: expected a mapping", ("policies", "pid"), 3),
        ("policies: pid: episodes: 1: measures = ", (*EPISODE, "measures", "return"), None),
        ("'unsafe' is missing", (*EPISODE, "measures", "unsafe"), ...),
        ("expected the measures of the first episode", (*EPISODE, "measures", "other"), 1.0),
        ("measures.return = True", (*EPISODE, "measures", "return"), True),
        ("expected episodes of the same patients", ("policies", "policy", "episodes", 0, "seed"), 2),
        ("summary: return: 'low' is missing", ("policies", "pid", "summary", "return", "low"), ...),
        ("summary: return: count = -1", ("policies", "pid", "summary", "return", "count"), -1),
        ("summary: unknown: expected", ("policies", "pid", "summary", "unknown"), 1),
        ("summary = ", ("policies", "pid", "summary", "return"), ...),
        ("title = ''", ("policies", "pid", "title"), ""),
        ("unknown key 'wings'", ("wings",), 1),
        ("left_out = 1", ("left_out",), 1),
    ],
)
def test_damaged_and_newer_evaluations(said, path, value, evaluation):
    file, content = evaluation
    file.write_text(json.dumps(changed(content, path, value)))
    with pytest.raises(InputError) as caught:
        collected([file])
    assert said in str(caught.value) and str(file) in str(caught.value)
    assert "\n" not in str(caught.value) and len(str(caught.value)) < 500


def test_evaluations_say_their_version_and_older_ones_are_read(evaluation):
    file, content = evaluation
    assert "version" not in content
    for version in ({}, {"version": VERSION}):
        file.write_text(json.dumps(content | version))
        _, (found,) = collected([file])
        assert list(found["policies"]) == ["pid", "policy"]


@pytest.mark.parametrize(
    "path, value",
    [
        (("policies", "pid", "title"), "PPO, seed "),
        (("policies", "pid", "title"), "$\\frac{$"),
        (("population",), "$\\frac{$"),
        (("policies", "pid", "summary", "tracking_rms_deg", "value"), 1e9),
        (("policies", "pid", "summary", "tracking_rms_deg", "value"), None),
        ((*EPISODE, "measures", "tracking_rms_deg"), None),
        ((*EPISODE, "measures", "return"), 10**90),
    ],
)
def test_unusual_evaluations_are_drawn(path, value, evaluation, tmp_path):
    pytest.importorskip("matplotlib")
    from agents.commands.pictures.report import _badness, _evaluation
    from agents.evaluation.figures.figure import draw

    file, content = evaluation
    file.write_text(json.dumps(changed(content, path, value)))
    _, (found,) = collected([file])
    assert any("pid" in line for line in _evaluation(tmp_path, found, ""))
    assert max(found["policies"]["pid"]["episodes"], key=_badness)
    draw(tmp_path / "evaluation.png", found)
    assert {p.name for p in tmp_path.glob("*.png")} == {"pareto.png", "evaluation.png"}


def test_evaluations_with_other_patients_stay_apart(evaluation, tmp_path):
    file, content = evaluation
    other = copy.deepcopy(content)
    for policy in other["policies"].values():
        policy["episodes"].reverse()
    file.write_text(json.dumps(content))
    (tmp_path / "other.json").write_text(json.dumps(other))
    _, found = collected([file, tmp_path / "other.json"])
    assert len(found) == 2


@pytest.mark.parametrize(
    "said, pointer, hashes",
    [
        ("expected the name of a folder", "../steps_1", None),
        ("expected the name of a folder", "", None),
        ("expected the name of a folder", "a\x00b", None),
        ("latest' cannot be read: it has more than", "x" * 10_000, None),
        ("hashes.json", "steps_1", "[]"),
        ("hashes.json", "steps_1", "{}"),
        ("hashes.json", "steps_1", '{"file": 3}'),
        ("is not the name of a file", "steps_1", '{"../file": "x"}'),
        ("file is cut off or was changed", "steps_1", '{"file": "x"}'),
        ("other", "steps_1", '{"other": "x"}'),
        ("nested deeper", "steps_1", "[" * 10_000),
    ],
)
def test_damaged_checkpoints(said, pointer, hashes, tmp_path):
    store = Store(tmp_path / "store")
    store.save("steps_1", lambda part: (part / "file").write_text("content"))
    (store.folder / "latest").write_text(pointer)
    if hashes is not None:
        (store.folder / "steps_1" / "hashes.json").write_text(hashes)
    with pytest.raises(InputError) as caught:
        store.latest()
    assert said in str(caught.value)
    assert "\n" not in str(caught.value) and len(str(caught.value)) < 500


def test_archives_that_unpack_to_more_than_they_are(tmp_path):
    pytest.importorskip("stable_baselines3")
    from agents.training.files.model_state import _read

    path = tmp_path / "random.npz"
    np.savez_compressed(path, torch=np.zeros(10**7, np.uint8))
    with pytest.raises(InputError, match="it is compressed"):
        _read(path)
    # An array that claims what no memory holds.
    with zipfile.ZipFile(path, "w") as archive:
        shape = b"{'descr': '<f8', 'fortran_order': False, 'shape': (1000000000000,), }"
        archive.writestr("a.npy", b"\x93NUMPY\x01\x00" + struct.pack("<H", len(shape)) + shape)
    with pytest.raises(InputError, match=r"random.npz' is cut off or no NumPy archive"):
        _read(path)


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"\x80\x04",
        b"cnowhere\nNothing\n.",
        b"\x80\x04\x95\xff\xff\xff\xff\xff\xff\xff\x7f",
        pickle.dumps([1]),
        b"x" * 99,
    ],
)
def test_damaged_pickles_are_one_sentence(content, tmp_path):
    pytest.importorskip("stable_baselines3")
    from agents.export.model_zip import _read, _statistics
    from agents.training.learners.algorithms import find

    path = tmp_path / "vecnormalize.pkl"
    path.write_bytes(content)
    for read in (_statistics, lambda p: _read(find("ppo"), p)):
        with pytest.raises(DmsError) as caught:
            read(path)
        assert str(path) in str(caught.value) and "\n" not in str(caught.value)


@pytest.mark.parametrize("value", ["1", None, True, float("nan"), [1], 10**400, "x" * 10**6])
def test_numbers_of_baselines(value):
    with pytest.raises(InputError) as caught:
        numbers("pid_yielding", {"authority": Range(0.0, 1.0), "lag_deg": Range(-1.0, 3.0)}, {"authority": value})
    said = str(caught.value)
    if value is not True:
        assert "authority = " in said and "expected a number from 0 to 1" in said
    assert len(said) < 300


def test_safetensors_that_are_written_are_read():
    arrays = {"b": np.arange(6.0).reshape(2, 3), "a": np.zeros((0, 4), np.float32), "c": np.float64(3.0)}
    found = from_bytes(to_bytes(arrays), "x")
    assert all(np.array_equal(found[k], v) for k, v in arrays.items())
