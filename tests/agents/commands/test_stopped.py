"""Ctrl-C in commands: status 130, a sentence on what is kept, and no traceback, of no process."""

import errno
import json
import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

from agents.__main__ import main
from agents.commands.pictures.report_input import collected
from agents.evaluation.search.tries import Try
from agents.evaluation.sharing.shares import processes
from dms_core.errors import SimulationError
from dms_core.files import output_place

ROOT = Path(__file__).resolve().parents[3]


@pytest.fixture
def stopped_at(monkeypatch):
    """Makes Ctrl-C fall into a call of a function, counted from 1."""

    def patch(place: str, number: int):
        from importlib import import_module

        module, _, name = place.rpartition(".")
        known, calls = getattr(import_module(module), name), []

        def called(*given, **more):
            calls.append(1)
            if len(calls) == number:
                raise KeyboardInterrupt
            return known(*given, **more)

        monkeypatch.setattr(place, called)

    return patch


EVALUATE = ["evaluate", "--policy", "none", "pid", "--population", "stroke_mild", "--patients", "2"]


def test_an_evaluation_keeps_the_policies_that_are_done(stopped_at, tmp_path, capsys):
    stopped_at("agents.evaluation.comparison.evaluate.episode", 4)
    assert main([*EVALUATE, "--out", str(tmp_path)]) == 130
    part = tmp_path / "evaluation.partial.json"
    assert capsys.readouterr().err.splitlines()[-1] == f"stopped: 2 patients with none are in '{part}'."
    assert not (tmp_path / "evaluation.json").exists()
    found = json.loads(part.read_text())
    assert list(found["policies"]) == ["none"] and found["patients"] == 2
    # A report takes it as any evaluation.
    assert len(collected([part])[1]) == 1


def test_an_evaluation_keeps_whole_patients_of_its_first_policy(stopped_at, tmp_path, capsys):
    stopped_at("agents.evaluation.comparison.evaluate.episode", 4)
    assert main([*EVALUATE, "--loads", "1", "2", "--out", str(tmp_path)]) == 130
    found = json.loads((tmp_path / "evaluation.partial.json").read_text())
    assert found["patients"] == 1 and len(found["policies"]["none"]["episodes"]) == 2
    assert "stopped: 1 patient with none is in " in capsys.readouterr().err


def test_a_part_outlives_the_next_evaluations(stopped_at, tmp_path):
    stopped_at("agents.evaluation.comparison.evaluate.episode", 2)
    assert main(["evaluate", "--policy", "none", "--patients", "2", "--out", str(tmp_path)]) == 130
    part = tmp_path / "evaluation.partial.json"
    before = part.read_bytes()
    for _ in range(2):
        assert main(["evaluate", "--policy", "none", "--patients", "1", "--out", str(tmp_path)]) == 0
    assert part.read_bytes() == before


def test_an_evaluation_says_where_its_part_is_when_the_disk_is_full(stopped_at, tmp_path, capsys, monkeypatch):
    (tmp_path / "temporary").mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "temporary"))
    known = output_place._replace

    def full(target, content):
        if target.parent == tmp_path / "out":
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        known(target, content)

    monkeypatch.setattr(output_place, "_replace", full)
    stopped_at("agents.evaluation.comparison.evaluate.episode", 4)
    assert main([*EVALUATE, "--out", str(tmp_path / "out")]) == 130
    (kept,) = (tmp_path / "temporary").iterdir()
    assert f"stopped: 2 patients with none are in '{kept}'." in capsys.readouterr().err
    assert (kept / "evaluation.partial.json").exists()


def test_an_evaluation_that_did_nothing_says_so(stopped_at, tmp_path, capsys):
    stopped_at("agents.evaluation.comparison.evaluate.episode", 1)
    assert main([*EVALUATE, "--out", str(tmp_path)]) == 130
    assert "no patient was done; nothing was written." in capsys.readouterr().err and not list(tmp_path.iterdir())


@pytest.mark.slow
def test_an_upper_bound_keeps_its_patients(stopped_at, tmp_path, capsys):
    stopped_at("agents.evaluation.search.upper_bound.tried_on", 2)
    out = tmp_path / "bound.csv"
    assert main(["upper-bound", "--patients", "3", "--population", "stroke_mild", "--out", str(out)]) == 130
    lines = (tmp_path / "bound.partial.csv").read_text().splitlines()
    assert not out.exists() and len(lines) == 3 and "1 of 3 patients are in" in capsys.readouterr().err


def test_a_search_keeps_its_tries(monkeypatch, tmp_path, capsys):
    def search(name, *given, progress, **more):
        progress(Try(name, {"x": 1.0}, {"return": 2.0}))
        raise KeyboardInterrupt

    monkeypatch.setattr("agents.commands.search.tune_baselines.tune", search)
    assert main(["tune-baselines", "--tries", "2", "--patients", "1", "--out", str(tmp_path)]) == 130
    (part,) = tmp_path.iterdir()
    assert part.name == "baselines_tries.partial.csv" and part.read_text().endswith(",2,x=1\n")
    assert "1 of " in (said := capsys.readouterr().err) and str(part) in said


def test_a_film_is_whole_or_not_there(stopped_at, tmp_path, capsys):
    pytest.importorskip("imageio")
    pytest.importorskip("pygame")
    stopped_at("agents.commands.pictures.video.band", 3)
    assert main(["video", "--policy", "none", "--out", str(tmp_path / "film.gif")]) == 130
    assert "2 of " in (said := capsys.readouterr().err) and "nothing was written" in said
    assert list(tmp_path.iterdir()) == []


@pytest.mark.filterwarnings("error::pytest.PytestUnhandledThreadExceptionWarning")
def test_processes_of_a_pool_end_without_a_word(capfd):
    begin = time.perf_counter()
    with pytest.raises(KeyboardInterrupt), processes(2) as share_out:
        tried = share_out(time.sleep, [(60.0,)] * 20)
        threading.Timer(1.0, os.kill, (os.getpid(), signal.SIGINT)).start()
        next(tried)
    assert capfd.readouterr().err == ""
    assert time.perf_counter() - begin < 20.0  # not the 60 s of a job


def test_a_process_that_is_killed_is_a_sentence():
    with pytest.raises(SimulationError, match="a worker process was killed .* goes on"), processes(1) as share_out:
        list(share_out(os._exit, [(9,)]))


SCRIPT = """
import sys, time
from dms_core.command_line import run_command
def wait() -> int:
    print("waiting", flush=True)
    time.sleep(60.0)
    return 0
sys.exit(run_command({"wait": wait, "other": wait}, "test", "", ["wait"]))
"""


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_is_one_line_and_status_130(number):
    with subprocess.Popen(
        [sys.executable, "-c", SCRIPT], cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        watchdog = threading.Timer(120.0, process.kill)
        watchdog.start()
        assert process.stdout.readline() == "waiting\n"
        os.kill(process.pid, number)
        _, said = process.communicate()
        watchdog.cancel()
    assert process.returncode == 130 and said == "stopped: nothing was written.\n"
