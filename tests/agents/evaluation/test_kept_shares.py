"""Shares of a long evaluation: kept one by one, never mixed up, and gone on with after a kill."""

import dataclasses
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from agents.__main__ import main
from agents.evaluation.comparison.evaluate import Plan
from agents.evaluation.sharing import kept_shares
from agents.evaluation.sharing.kept_shares import KeptShares, Planned, digest
from agents.policies.baselines import policy
from agents.policies.reference_free.gravity import Gravity

ROOT = Path(__file__).resolve().parents[3]
PLAN = Plan("mixed", 3, 5, (), "exo/HiddenIntent-v0")


def work(one, plan, cases):
    """Something different for each case."""
    return [{"seed": seed, "number": 0.1 * seed, "none": float("nan")} for seed, _ in cases]


def here(function, shares):
    return (function(*share) for share in shares)


@pytest.fixture
def small(monkeypatch):
    monkeypatch.setattr(kept_shares, "LARGEST_SHARE", 2)


def run(path, cells, share_out=here):
    seen = []
    kept, planned = KeptShares(path), Planned(work, cells)
    return planned.fill(kept, share_out, lambda name, cases: seen.append((name, cases))), seen


def test_a_cell_that_stands_twice_is_run_once(small, tmp_path):
    cells = [(policy("gravity"), PLAN), (policy("none"), PLAN), (policy("gravity"), PLAN)]
    found, seen = run(tmp_path / "kept.jsonl", cells)
    assert seen == [("gravity", 2), ("gravity", 1), ("none", 2), ("none", 1)]
    assert found[0] == found[2] and [e["seed"] for e in found[0]] == [seed for seed, _ in PLAN.cases]
    assert found[0][0]["none"] is None, "JSON has no NaN"
    assert Planned(work, cells).count() == 6


def test_what_is_done_is_not_done_again(small, tmp_path):
    path, cells = tmp_path / "kept.jsonl", [(policy("gravity"), PLAN), (policy("none"), PLAN)]

    def killed(function, shares):
        for k, share in enumerate(shares):
            if k == 3:
                raise KeyboardInterrupt
            yield function(*share)

    with pytest.raises(KeyboardInterrupt):
        run(path, cells, killed)
    assert Planned(work, cells).count(KeptShares(path).done) == 5
    found, seen = run(path, cells)
    assert seen == [("none", 1)]
    assert found == run(tmp_path / "other.jsonl", cells)[0], "numbers come back to the last bit"


@pytest.mark.parametrize("tail", [b'["abc", [{"se', b'["abc", [{"seed": 1}]]', b"\xff\xfe", b"null\n[1]\n{}\n[1, 2]\n"])
def test_a_line_that_is_not_whole_is_dropped(small, tmp_path, tail):
    path, cells = tmp_path / "kept.jsonl", [(policy("gravity"), PLAN)]
    found, _ = run(path, cells)
    whole = path.read_bytes()
    path.write_bytes(whole + tail)
    assert run(path, cells) == (found, [])
    assert path.read_bytes() == whole


def test_a_share_of_anything_else_has_another_digest():
    cases = PLAN.cases
    others = [
        (work, policy("gravity"), PLAN, cases),
        (here, policy("gravity"), PLAN, cases),
        (work, policy("none"), PLAN, cases),
        (work, Gravity(**{name: r.low for name, r in Gravity.ranges.items()}), PLAN, cases),
        (work, policy("gravity"), dataclasses.replace(PLAN, population="wide"), cases),
        (work, policy("gravity"), dataclasses.replace(PLAN, settings={"control_rate": 100.0}), cases),
        (work, policy("gravity"), dataclasses.replace(PLAN, environment="exo/NewPatient-v0"), cases),
        (work, policy("gravity"), PLAN, cases[:2]),
        (work, policy("gravity"), PLAN, [(seed, 2.0) for seed, _ in cases]),
    ]
    assert len({digest(*one) for one in others}) == len(others)
    assert digest(work, policy("gravity"), PLAN, cases) == digest(*others[0])


def test_ctrl_c_says_what_is_kept(monkeypatch, tmp_path, capsys):
    from agents.evaluation.studies import shift

    known, calls = kept_shares.KeptShares.add, []

    def add(self, key, content):
        known(self, key, content)
        calls.append(key)
        if len(calls) == 2:
            raise KeyboardInterrupt

    monkeypatch.setattr(kept_shares.KeptShares, "add", add)
    monkeypatch.setitem(shift.SHIFTS, "load", dataclasses.replace(shift.SHIFTS["load"], sizes=(1.25, 2.0)))
    out = tmp_path / "run"
    command = ["shift", "--policy", "gravity", "--shifts", "load", "--patients", "1", "--out", str(out)]
    assert main(command) == 130
    said = f"2 of 6 episodes are in '{tmp_path / 'run.partial.jsonl'}'; the same command goes on from there."
    assert said in capsys.readouterr().err
    assert main(command) == 0 and len(calls) == 6


@pytest.mark.slow
def test_a_command_that_was_killed_goes_on(tmp_path):
    def start(out):
        command = [sys.executable, "-m", "agents", "shift", "--policy", "gravity", "--shifts", "load", "--patients"]
        return subprocess.Popen([*command, "2", "--workers", "2", "--out", str(out)], cwd=ROOT, start_new_session=True)

    first, part = start(tmp_path / "a"), tmp_path / "a.partial.jsonl"
    while not part.exists() or part.read_bytes().count(b"\n") < 3:
        assert first.poll() is None
        time.sleep(0.05)
    os.killpg(first.pid, signal.SIGKILL)
    first.wait()
    before = part.read_bytes()
    assert start(tmp_path / "a").wait() == 0 and start(tmp_path / "b").wait() == 0
    assert before.count(b"\n") >= 3 and not part.exists()
    assert (tmp_path / "a" / "shift.csv").read_text() == (tmp_path / "b" / "shift.csv").read_text()
