"""Work shared out by Ray: the same results as in one process, also where a worker is killed."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("ray")

from agents.__main__ import main
from agents.commands.options import sharing_out
from agents.distributed.cluster import share_out
from agents.distributed.shared_evaluation import shared_out
from agents.evaluation.comparison.evaluate import Plan, evaluate
from agents.evaluation.search.tuning import tune
from agents.policies.baselines import policy
from dms_core.errors import DmsError, InputError
from tests.agents.tiny import config_file

SHORT = {"episode_duration": 0.4}


def square_or_die(number, folder):
    """The square; the first call with 2 dies with its worker."""
    marker = Path(folder) / "died"
    if number == 2 and not marker.exists():
        marker.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return number**2, os.getpid()


def complain(number):
    raise InputError("number = 1: expected 2.")


def test_a_lost_share_is_done_again(tmp_path):
    seen = []
    found = share_out(square_or_die, [(n, str(tmp_path)) for n in range(4)], cpus=2, done=seen.append)
    assert [f[0] for f in found] == [0, 1, 4, 9] and sorted(seen) == [0, 1, 2, 3]
    assert (tmp_path / "died").exists() and os.getpid() not in {f[1] for f in found}


def test_mistakes_come_back_as_one_sentence():
    with pytest.raises(DmsError, match=r"^number = 1: expected 2\.$"):
        share_out(complain, [(1,)], cpus=1)


def test_a_cluster_that_is_not_there_is_named(monkeypatch):
    monkeypatch.delenv("RAY_AUTH_TOKEN", raising=False)
    with pytest.raises(DmsError, match="Ray at '127.0.0.1:1' cannot be reached.*RAY_AUTH_TOKEN"):
        share_out(complain, [(1,)], address="127.0.0.1:1")


@pytest.mark.slow
def test_a_search_is_that_of_one_process():
    short = {"environment": "exo/HiddenIntent-v0", **SHORT}
    # First, since it forks this process, and threads that Ray leaves in it do not survive that.
    alone = tune("gravity", 6, 2, 0, **short)
    with sharing_out(2, "local") as share_out:
        assert tune("gravity", 6, 2, 0, share_out=share_out, **short) == alone


@pytest.mark.slow
def test_evaluation_is_that_of_one_process(monkeypatch):
    monkeypatch.setattr("agents.distributed.shared_evaluation.LARGEST_SHARE", 2)
    names, seen = ["pid", "none"], []
    used = [policy(n) for n in names]
    shared = shared_out(used, Plan("evaluation", 3, 4, settings=SHORT), progress=seen.append)
    alone = evaluate([policy(n) for n in names], "evaluation", 3, 4, **SHORT)
    assert json.dumps(shared) == json.dumps(alone) and sorted(seen) == sorted(names * 3)


@pytest.mark.slow
def test_sweep_survives_a_killed_worker_and_gives_what_trainings_give(tmp_path):
    pytest.importorskip("sb3_contrib")
    from agents.policies.learned import find_policy
    from agents.training.files.run_folder import read_record

    path = config_file(tmp_path, n_timesteps=512, training={"eval_every": 256, "save_every": 32})
    command = [sys.executable, "-m", "agents", "sweep", "--configs", path, "--seeds", "3", "5", "--cpus", "2"]
    command += ["--out", tmp_path / "sweep"]
    running = subprocess.Popen(
        list(map(str, command)),
        cwd=Path(__file__).parents[3],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    one = tmp_path / "sweep" / "ppo_3"
    end = time.monotonic() + 300.0
    while not (one / "checkpoints" / "latest").exists():
        assert running.poll() is None and time.monotonic() < end, running.communicate()
        time.sleep(0.005)
    os.kill(int((one / ".lock").read_text()), signal.SIGKILL)
    said, errors = running.communicate(timeout=400)
    assert running.returncode == 0, errors
    assert f"{one}: best return" in said
    # Killed and gone on with: one more start; the other one is as if trained alone.
    assert len(read_record(one)["sessions"]) == 2
    assert main(["train", "--config", str(path), "--seed", "5", "--out", str(tmp_path / "alone")]) == 0
    shared, alone = (find_policy(str(p)) for p in (tmp_path / "sweep" / "ppo_5", tmp_path / "alone"))
    assert all(np.array_equal(shared.arrays[k], v) for k, v in alone.arrays.items())


@pytest.mark.parametrize(
    "said, arguments",
    [
        ("two trainings would share a folder", ["--configs", "{config}", "{config}"]),
        ("seeds from 0", ["--configs", "{config}", "--seeds", "-1"]),
        ("unknown key 'wrong'", ["--configs", "{config}", "--set", "wrong=1"]),
    ],
)
def test_mistakes_are_found_before_anything_runs(said, arguments, tmp_path, capsys):
    pytest.importorskip("sb3_contrib")
    given = [a.format(config=config_file(tmp_path)) for a in arguments]
    assert main(["sweep", *given, "--out", str(tmp_path / "out")]) == 2
    errors = capsys.readouterr().err
    assert said in errors and errors.count("\n") == 1 and not (tmp_path / "out").exists()
