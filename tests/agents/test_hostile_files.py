"""Files made to harm: refused in one sentence with file and key, before they cost time or memory."""

import json
import os
import struct
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from agents.__main__ import main
from agents.checkpoint import Store
from agents.commands.pictures.report_input import collected
from agents.environment import ENVIRONMENT, make
from agents.evaluation.comparison.evaluate import evaluate
from agents.evaluation.episodes.time_course import time_course
from agents.evaluation.results.evaluation_file import read_evaluation
from agents.policies.learned import SHIPPED, LearnedPolicy, fingerprint
from agents.policies.safetensors import from_bytes
from agents.training.files.records import read_curve, read_record
from dms_core.errors import InputError, ModelWarning
from dms_core.files.json_text import MOST_KEYS, MOST_VALUES, parse_json

OLD = Path(__file__).with_name("before_the_move")
ROOT = Path(__file__).parents[2]
MEGABYTES, SECONDS = 500, 2.0
"""What refusing a file may take, as a program of its own with what it imports (100 MB)."""


@pytest.fixture
def policy(tmp_path):
    """A copy of the shipped policy, and its description."""
    folder = tmp_path / "policy"
    LearnedPolicy.load(SHIPPED / "learned").save(folder)
    return folder, json.loads((folder / "policy.json").read_text())


def written(folder, facts):
    """A description whose own hash fits."""
    (folder / "policy.json").write_text(json.dumps(facts | {"sha256": fingerprint(facts)}))


@pytest.mark.parametrize(
    "said, changes",
    [
        ("lstm_layers = 1000000000: Expected a number of at most", {"lstm_layers": 10**9}),
        ("lstm_layers = -1", {"lstm_layers": -1}),
        ("lstm_width", {"lstm_layers": 1, "lstm_width": 0}),
        ("hidden.0 = 1000000000", {"hidden": [10**9]}),
        ("hidden.0 = 0", {"hidden": [0]}),
        ("hidden = ", {"hidden": [1] * 100_000}),
        ("traces = ", {"traces": [0.5] * 100_000}),
        ("traces.0 = 'x'", {"traces": ["x"] * 100_000}),
        ("inputs = 1000000000", {"inputs": 10**9}),
        ("n_stack = 1000000000", {"n_stack": 10**9}),
        ("a multiple of", {"n_stack": 5, "inputs": 7}),
        ("hold = True", {"hold": True}),
        ("clip = 0", {"clip": 0}),
        ("outputs = '2'", {"outputs": "2"}),
        ("activation 'x' is unknown", {"activation": "x"}),
        ("have shape", {"hidden": [64, 65]}),
    ],
)
def test_an_architecture_that_would_fill_the_memory_is_refused(said, changes, policy):
    folder, facts = policy
    facts["architecture"] |= changes
    written(folder, facts)
    with pytest.raises(InputError) as caught:
        LearnedPolicy.load(folder)
    assert said in str(caught.value) and "policy" in str(caught.value) and len(str(caught.value)) < 500


@pytest.mark.parametrize(
    "key, value",
    [
        ("title", "Another"), ("environment", "exo/ElbowLift-v0"), ("exo_env", "9"), ("period", 0.01), ("seed", 1),
        ("action_mode", "rope_tension"), ("observation", ["device.angle"]), ("drive", {}), ("env_kwargs", {}),
        ("structure", []), ("algorithm", "sac"), ("steps", 1),
    ],
)  # fmt: skip
def test_a_description_that_was_edited_is_named(key, value, policy):
    folder, facts = policy
    (folder / "policy.json").write_text(json.dumps(facts | {key: value}))
    with pytest.raises(InputError, match="policy.json was changed"):
        LearnedPolicy.load(folder)
    # Layout and order of a file are no change.
    (folder / "policy.json").write_text("\ufeff" + json.dumps(dict(reversed(facts.items()))), encoding="utf-8")
    assert LearnedPolicy.load(folder).description.title == facts["title"]


@pytest.mark.parametrize("name", ["clip", "epsilon", "output", "hold"])
def test_an_architecture_that_was_edited_is_named(name, policy):
    folder, facts = policy
    facts["architecture"][name] = {"clip": 5.0, "epsilon": 1e-3, "output": "tanh", "hold": 9}[name]
    (folder / "policy.json").write_text(json.dumps(facts))
    with pytest.raises(InputError, match="policy.json was changed"):
        LearnedPolicy.load(folder)


def test_every_shipped_policy_holds_its_hash():
    for folder in SHIPPED.glob("*/"):
        facts = json.loads((folder / "policy.json").read_text())
        assert facts["format"] == 2 and facts["sha256"] == fingerprint(facts)


def test_a_policy_of_the_first_format_is_renewed(tmp_path, capsys):
    assert main(["export", str(OLD / "policy"), "--no-onnx", "--out", str(tmp_path / "new")]) == 0
    assert f"renew it: python -m agents export {OLD / 'policy'} --out" in capsys.readouterr().err
    new = LearnedPolicy.load(tmp_path / "new")
    assert new.description.format == 1 + 1 and new.training == "e3e190e250772dd1"  # as evaluation.json of then has it
    facts = json.loads((tmp_path / "new" / "policy.json").read_text())
    (tmp_path / "new" / "policy.json").write_text(json.dumps(facts | {"format": 1}))
    with pytest.raises(InputError, match="policy.json was changed"):
        LearnedPolicy.load(tmp_path / "new")


def test_no_module_is_imported_because_a_file_names_it(policy, tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(tmp_path)
    (tmp_path / "harm.py").write_text("raise SystemExit('harm was imported')")
    folder, facts = policy
    written(folder, facts | {"environment": "harm:exo/ElbowLift-v2"})
    with pytest.raises(InputError, match="an id without a module"):
        LearnedPolicy.load(folder)
    found = json.loads((OLD / "evaluation.json").read_text()) | {"environment": "harm:exo/ElbowLift-v2"}
    (tmp_path / "evaluation.json").write_text(json.dumps(found))
    with pytest.raises(InputError, match="environment = 'harm:"):
        read_evaluation(tmp_path / "evaluation.json")


def test_a_policy_acts_where_it_was_begun_and_on_its_own_observations(policy):
    one = LearnedPolicy.load(policy[0])
    size = one.network.shape.observed
    with pytest.raises(InputError, match=r"call reset\(env\)"):
        one(np.zeros(size), {})
    for shape in ((size + 1,), (1, size), ()):
        with pytest.raises(InputError, match="the observation has shape"):
            one.network(np.zeros(shape))


def by_evaluation(one, settings):
    evaluate([one], "stroke_mild", 1, 0, **settings)


def by_time_course(one, settings):
    time_course(one, "stroke_mild", 0, **settings)


def by_video(one, settings):
    pytest.importorskip("pygame")
    from agents.commands.pictures.video import Stage

    Stage(one, "stroke_mild", 0, **settings)


def by_hand(one, settings):
    env = make(ENVIRONMENT, action_mode=one.action_mode, observation=list(one.observation), **settings)
    env.reset(seed=0)
    one.reset(env)


@pytest.mark.parametrize("path", [by_evaluation, by_time_course, by_video, by_hand])
@pytest.mark.parametrize(
    "said, settings",
    [
        ("another control period: 0.02, not 0.01", {"control_rate": 100.0}),
        ("another drive", {"drive_settings": {"setpoint_range": 0.1}}),
    ],
)
def test_a_policy_is_refused_elsewhere_whoever_runs_it(said, settings, path, policy):
    with pytest.raises(InputError, match=f"was trained with {said}"):
        path(LearnedPolicy.load(policy[0]), settings)


@pytest.mark.parametrize(
    "said, changes",
    [
        ("another action mode", {"action_mode": "rope_tension"}),
        ("another observation", {"observation": ["device.angle"]}),
        ("another observation", {"observation": ["device", "emg"]}),
    ],
)
def test_an_environment_of_another_mode_or_observation_is_refused(said, changes, policy):
    one = LearnedPolicy.load(policy[0])
    env = make(ENVIRONMENT, **{"action_mode": one.action_mode, "observation": list(one.observation), **changes})
    env.reset(seed=0)
    with pytest.raises(InputError, match=said):
        one.reset(env)


def test_another_environment_that_looks_the_same_is_said(policy):
    import gymnasium

    one = LearnedPolicy.load(policy[0])
    gymnasium.register("tests/Twin-v0", entry_point=gymnasium.spec(ENVIRONMENT).entry_point)
    env = make("tests/Twin-v0", action_mode=one.action_mode, observation=list(one.observation))
    env.reset(seed=0)
    with pytest.warns(ModelWarning, match=f"was trained in {ENVIRONMENT} and acts in tests/Twin-v0"):
        one.reset(env)
    del gymnasium.registry["tests/Twin-v0"]


def test_ropes_in_another_order_are_another_observation(policy):
    folder, facts = policy
    tension = next(part for part in facts["structure"] if part["name"] == "tension")
    tension["labels"].reverse()
    written(folder, facts)
    with pytest.raises(InputError, match="another observation"):
        by_hand(LearnedPolicy.load(folder), {})


def header(text):
    return struct.pack("<Q", len(text)) + text.encode()


WHOLE = '{"a":{"dtype":"F32","shape":[2],"data_offsets":[0,8]}}'


@pytest.mark.parametrize(
    "said, content",
    [
        ("the header claims 1152921504606846976 bytes", struct.pack("<Q", 1 << 60) + b"{}"),
        ("it is cut off", struct.pack("<Q", 100) + b"{}"),
        ("it is cut off", header(WHOLE) + bytes(12)),
        ("array 'a' stands at bytes (0, 8): expected (0, 16)", header(WHOLE.replace("F32", "F64")) + bytes(8)),
        ("array 'a': dtype = 'F16'", header(WHOLE.replace("F32", "F16")) + bytes(8)),
        ("array 'a': shape.0 = -2", header(WHOLE.replace("[2]", "[-2]")) + bytes(8)),
        ("array 'a': shape = ", header(WHOLE.replace("[2]", f"[{'1,' * 99}2]")) + bytes(8)),
        ("array 'a': shape.0 = 1000000000000000000", header(WHOLE.replace("[2]", f"[{10**18}]")) + bytes(8)),
        ("array 'a': shape.0 = True", header(WHOLE.replace("[2]", "[true]")) + bytes(8)),
        ("the key 'a' stands twice", header(f"{WHOLE[:-1]},{WHOLE[1:]}") + bytes(8)),
        ("array 'b' stands at bytes (4, 12)", header(
            WHOLE[:-1] + ',"b":{"dtype":"F32","shape":[2],"data_offsets":[4,12]}}') + bytes(12)),
        ("nested deeper", header("[" * 5000) + bytes(8)),
        ("is no mapping", header("[]")),
    ],
)  # fmt: skip
def test_headers_of_safetensors(said, content):
    with pytest.raises(InputError) as caught:
        from_bytes(content, "x")
    assert said in str(caught.value) and "file 'x' holds no whole safetensors" in str(caught.value)
    assert len(str(caught.value)) < 400
    assert from_bytes(header(WHOLE) + bytes(8), "x")["a"].tolist() == [0.0, 0.0]


@pytest.mark.parametrize(
    "said, text",
    [
        ("it is empty", ""), ("NaN is no number", '{"a": NaN}'), ("Infinity is no number", "[-Infinity]"),
        ("1e400 is not finite", "[1e400]"), ("has 5000 characters", "9" * 5000), ("stands twice", '{"a": 1, "a": 1}'),
        ("lone surrogate", '"\\udc00"'), ("nested deeper", "[" * 100_000), ("nested deeper", "[" * 51 + "]" * 51),
        ("more than", f"[{'0,' * MOST_VALUES}0]"), ("keys", json.dumps({str(k): 0 for k in range(MOST_KEYS + 1)})),
        ("Expecting value", '{"a": '), ("Extra data", "{} {}"),
    ],
)  # fmt: skip
def test_what_json_may_not_hold(said, text):
    with pytest.raises(InputError) as caught:
        parse_json(text, "file 'x'")
    assert said in str(caught.value) and str(caught.value).startswith("file 'x' ") and len(str(caught.value)) < 200
    assert parse_json('{"a": [1, 2.5, null, "\\ud83d\\ude00"]}', "x") == {"a": [1, 2.5, None, "\U0001f600"]}


PLACES = {
    "policy.json": lambda folder: LearnedPolicy.load(folder),
    "weights.safetensors": lambda folder: LearnedPolicy.load(folder),
    "evaluation.json": lambda folder: collected([folder / "evaluation.json"]),
    "run.json": lambda folder: read_record(folder),
    "evaluations.json": lambda folder: read_curve(folder),
    "latest": lambda folder: Store(folder).latest(),
}


def _fifo(path):
    os.mkfifo(path)


def _large(path):
    with path.open("wb") as file:
        file.truncate(1 << 40)


OTHERS = {
    "folder": Path.mkdir, "pipe": _fifo, "device": lambda path: path.symlink_to("/dev/zero"), "large": _large,
    "utf-16": lambda path: path.write_text("{}", encoding="utf-16"),
    "binary": lambda path: path.write_bytes(bytes(range(256))), "empty": Path.touch,
}  # fmt: skip


@pytest.mark.skipif(os.name == "nt", reason="no pipes among files")
@pytest.mark.parametrize("other", OTHERS)
@pytest.mark.parametrize("name", PLACES)
def test_what_stands_in_the_place_of_a_file(name, other, policy):
    folder, _ = policy
    (folder / name).unlink(missing_ok=True)
    OTHERS[other](folder / name)
    if (name, other) in {("evaluations.json", o) for o in ("folder", "pipe", "device")}:
        assert PLACES[name](folder) == []  # none yet
        return
    with pytest.raises(InputError) as caught:
        PLACES[name](folder)
    assert str(folder) in str(caught.value) and "\n" not in str(caught.value)


HARM = {
    "deep": '"[" * 30_000_000',
    "values": '"[" + "[],{}," * 5_000_000 + "0]"',
    "traces": """text.replace('"traces": [', '"traces": [' + '"x",' * 249_000)""",
    "numbers": """text.replace('"traces": [', '"traces": [' + '0.5,' * 240_000)""",
    "strings": """text.replace('"title": "', '"title": "' + 'x' * 1_000_000)""",
    "structure": """text.replace('"structure": [', '"structure": [' + '1,' * 499_000)""",
}


@pytest.mark.skipif(sys.platform != "linux", reason="reads the peak of the memory as Linux says it")
@pytest.mark.parametrize("file", ["policy.json", "evaluation.json"])
@pytest.mark.parametrize("harm", HARM)
def test_time_and_memory_are_bounded(file, harm, policy):
    if file == "evaluation.json" and harm in ("traces", "numbers", "strings", "structure"):
        pytest.skip("keys of a policy")
    code = f"""
import re, sys, time
from pathlib import Path
from agents.evaluation.results.evaluation_file import read_evaluation
from agents.policies.learned import LearnedPolicy
from dms_core.errors import DmsError, InputError, ModelWarning
folder = Path(sys.argv[1])
text = (folder / 'policy.json').read_text()
(folder / {file!r}).write_text({HARM[harm]})
before = time.process_time()
try:
    LearnedPolicy.load(folder) if {file!r} == 'policy.json' else read_evaluation(folder / {file!r})
except InputError as error:
    # Since this program began: what getrusage gives may be the peak of the process that started it.
    peak = re.search("VmHWM: *([0-9]+)", Path("/proc/self/status").read_text().replace(chr(9), ""))[1]
    print(len(str(error)), time.process_time() - before, int(peak) / 1024)
"""
    done = subprocess.run([sys.executable, "-c", code, policy[0]], capture_output=True, text=True, cwd=ROOT)
    assert done.returncode == 0, done.stderr[-2000:]
    length, seconds, megabytes = map(float, done.stdout.split())
    assert length < 500 and seconds < SECONDS and megabytes < MEGABYTES
