"""Damaged files: every reader of them gives what they hold, or one short sentence, in bounded time."""

import hashlib
import json
import random
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from agents.checkpoint import Store
from agents.commands.options import device_settings
from agents.environment import ENVIRONMENT, make
from agents.evaluation.comparison.pooling import pooled
from agents.evaluation.results.evaluation_file import read_evaluation
from agents.evaluation.results.tables import short_table, whole_table
from agents.policies.learned import SHIPPED, LearnedPolicy, fingerprint, repetitions_of
from agents.policies.safetensors import from_bytes, to_bytes
from agents.training.files.records import read_curve, read_point, read_record, read_state
from dms_core.files.outputs import MANIFEST, Outputs
from exo_env.ecosystem.bare_arm import read_excitations
from tests.fuzz.damage import is_read_or_refused, of_bytes, of_json

OLD = Path(__file__).parents[1] / "agents" / "before_the_move"
POLICIES = {"learned": SHIPPED / "learned", "lstm": OLD / "policy_lstm"}
DESCRIPTIONS = {name: (folder / "policy.json").read_text() for name, folder in POLICIES.items()}
WEIGHTS = {name: (folder / "weights.safetensors").read_bytes() for name, folder in POLICIES.items()}
EVALUATION = (OLD / "evaluation.json").read_text()
POINT = {"steps": 0, "seconds": 0.9, "return": 11.5, "unsafe": 0.0, "smoothness_sparc": None, "returns": [11.5]}
CURVE = [POINT, POINT | {"steps": 64}]
SESSION = {"started": "2026-11-27T17:20:54+00:00", "command": "train", "versions": {"python": "3.11.7"}, "git": None}
RECORD = {"environment": ENVIRONMENT, "algorithm": "ppo", "seed": 0, "sessions": [SESSION]}
STATE = {"steps": 64, "updates": 8, "episodes": 3, "seconds": 1.5, "evaluations": CURVE}
HASHES = {"policy.json": hashlib.sha256(b"{}").hexdigest()}
WRITTEN = {"command": "evaluate", "files": {"table.md": hashlib.sha256(b"precious").hexdigest()}}
EXCITATIONS = "time_s,TRIlong,TRIlat,TRImed,BIClong,BICshort,BRA\n0,0,0,0,0,0.1,1e-1\n0.5,0,0,0,1,0,0.25\n"
HEADER = int.from_bytes(WEIGHTS["lstm"][:8], "little")

pytestmark = pytest.mark.filterwarnings("ignore:policy .* is of format 1")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("damaged")


@pytest.fixture(scope="module")
def envs():
    """An environment for each of the policies."""
    modes = {name: json.loads(text)["action_mode"] for name, text in DESCRIPTIONS.items()}
    found = {name: make(ENVIRONMENT, patient="stroke_mild", action_mode=mode) for name, mode in modes.items()}
    for one in found.values():
        one.reset(seed=0)
    yield found
    for one in found.values():
        one.close()


def signed(content):
    """A description with the hash that fits, so that more than the hash is looked at."""
    return content | {"sha256": fingerprint(content)} if isinstance(content, dict) else content


def run_policy(folder, env):
    """Load a policy, begin an episode and act."""
    one = LearnedPolicy.load(folder)
    repetitions_of([one])
    one.reset(env)
    one(np.zeros(env.observation_space.shape, np.float32), {})


DAMAGED_DESCRIPTIONS = {name: of_json(text, signed) for name, text in DESCRIPTIONS.items()}


@pytest.mark.parametrize("name", POLICIES)
@given(data=st.data())
def test_descriptions_of_policies(name, folder, envs, data):
    place = folder / name
    place.mkdir(exist_ok=True)
    (place / "weights.safetensors").write_bytes(WEIGHTS[name])
    (place / "policy.json").write_bytes(data.draw(DAMAGED_DESCRIPTIONS[name]))
    is_read_or_refused(run_policy, place, envs[name])


def with_header(header):
    return len(header).to_bytes(8, "little") + header + WEIGHTS["lstm"][8 + HEADER :]


@given(
    st.one_of(
        of_bytes(WEIGHTS["lstm"]),
        of_bytes(to_bytes({"a": np.arange(3.0), "b": np.ones((2, 2), np.float32)})),
        of_json(WEIGHTS["lstm"][8 : 8 + HEADER].decode()).map(with_header),
    )
)
def test_safetensors(content):
    found = is_read_or_refused(from_bytes, content, "weights.safetensors")
    # No number is read twice.
    assert found is None or sum(a.nbytes for a in found.values()) <= len(content)


def tabulated(path):
    """All that a report writes of an evaluation."""
    one = read_evaluation(path)
    one["policies"] |= pooled(one["policies"], one["seed"])
    for policy in one["policies"].values():
        policy["difference"] = {"return": policy["summary"]["return"]}
    assert "|" in "".join(whole_table(one)) and short_table(one)


@pytest.fixture
def few_resamples(monkeypatch):
    monkeypatch.setattr("agents.evaluation.comparison.statistics.RESAMPLES", 10)


@given(of_json(EVALUATION))
def test_evaluations(folder, few_resamples, content):
    path = folder / "evaluation.json"
    path.write_bytes(content)
    is_read_or_refused(tabulated, path)


RECORDS = {
    read_record: ("run.json", of_json(json.dumps(RECORD))),
    read_curve: ("evaluations.json", of_json(json.dumps(CURVE))),
    read_state: ("state.json", of_json(json.dumps(STATE))),
    read_point: ("state.json", of_json(json.dumps(POINT))),
}


@pytest.mark.parametrize("read", RECORDS)
@given(data=st.data())
def test_records_of_trainings(read, folder, data):
    name, damaged = RECORDS[read]
    (folder / name).write_bytes(data.draw(damaged))
    is_read_or_refused(read, folder)


@given(of_json(json.dumps(HASHES)), of_bytes(b"steps_1\n"), st.booleans())
def test_checkpoints(folder, hashes, pointer, pointed):
    place = folder / "store" / "steps_1"
    place.mkdir(parents=True, exist_ok=True)
    (place / "policy.json").write_bytes(b"{}")
    (place / "hashes.json").write_bytes(hashes)
    (place.parent / "latest").write_bytes(b"steps_1\n" if pointed else pointer)
    is_read_or_refused(Store(place.parent).latest)


@given(of_json(json.dumps({"hinge_damping": 0.1, "lower_link": {"mass": 1.0}})))
def test_settings_on_the_command_line(content):
    is_read_or_refused(device_settings, "{" + content.decode("utf-8", "surrogateescape"))
    is_read_or_refused(device_settings, content.decode("utf-8", "replace"))


@given(of_json(json.dumps(WRITTEN)))
def test_lists_of_what_was_written(folder, content):
    place, outside = folder / "written", folder / "x"
    place.mkdir(exist_ok=True)
    for path in (place / "table.md", outside):
        path.write_bytes(b"precious")
    (place / MANIFEST).write_bytes(content)
    outputs = is_read_or_refused(lambda: Outputs("evaluate", folder=place))
    if outputs is not None:
        # What the list names may be renewed or removed: nothing but the folder's own file, as it was written.
        with outputs:
            outputs.write(place / "new.md", lambda file: file.write(b"1"))
        (place / "new.md").unlink()
    assert outside.read_bytes() == b"precious"


@given(of_bytes(EXCITATIONS.encode()))
def test_excitations(folder, content):
    path = folder / "excitations.csv"
    path.write_bytes(content)
    is_read_or_refused(read_excitations, path)


@pytest.fixture(scope="module")
def model():
    """A small model that goes on from files, and the folder of whole ones."""
    pytest.importorskip("stable_baselines3")
    from agents.training.learners.algorithms import build
    from agents.training.settings.config import Config
    from agents.training.worlds import wrapped
    from tests.agents.tiny import content

    config = Config.of(content("sac"), "sac")
    return build(config, wrapped(config, 0), 0)


@pytest.fixture(scope="module")
def checkpoint(model, folder):
    """Whole files of the model; states of what is random are put back in the end."""
    import torch

    from agents.training.files.model_state import save_state

    states = np.random.get_state(), random.getstate(), torch.get_rng_state()
    place = folder / "checkpoint"
    place.mkdir()
    save_state(model, place)
    yield place
    np.random.set_state(states[0])
    random.setstate(states[1])
    torch.set_rng_state(states[2])


def load_part(file, model, path):
    """Put one file of a checkpoint into a model."""
    from agents.training.files import model_state

    if file == "model.zip":
        model_state._load_networks(model, path)
    elif file == "statistics.npz":
        model_state._load_statistics(model.get_vec_normalize_env(), path)
    elif file == "replay.npz":
        model_state._load_replay(model, path)
    else:
        model_state._load_random(path)


@pytest.mark.parametrize("file", ["model.zip", "statistics.npz", "replay.npz", "random.npz"])
@given(data=st.data())
def test_states_of_trainings(file, model, checkpoint, data):
    path = checkpoint / f"damaged_{file}"
    path.write_bytes(data.draw(of_bytes((checkpoint / file).read_bytes())))
    is_read_or_refused(load_part, file, model, path)
