"""Searches in batches of worlds: the same as one episode after the other, resumed as they began; hindsight."""

import csv
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from agents.__main__ import main
from agents.environment import patient_seeds
from agents.evaluation.comparison.opponents import RETURNS
from agents.evaluation.episodes.episode import judged, world_of
from agents.evaluation.search.batch_trials import batch_returns
from agents.evaluation.search.hindsight import hindsight, place, summed_up, tried_numbers, tuned_difference
from agents.evaluation.search.tries import EXACT, KeptTries, Try, beside, read_table, table
from agents.evaluation.search.tuning import STREAM, tunable, tune
from agents.policies.baselines import REFERENCE_FREE, policy
from agents.policies.tuned import HIDDEN_INTENT, Range
from dms_core.errors import InputError
from dms_core.files.config_files import configs
from dms_core.files.yaml_text import read_yaml

ROOT = Path(__file__).resolve().parents[3]
HIDDEN = "exo/HiddenIntent-v0"
SHORT = {"episode_duration": 0.4}


def here(function, shares):
    """Shares done in this process."""
    return (function(*share) for share in shares)


def search(name="onset", tries=6, patients=3, seed=0, **more):
    return tune(name, tries, patients, seed, environment=HIDDEN, **{"share_out": here, **SHORT, **more})


def test_a_batch_gives_the_returns_of_single_episodes():
    rows = [dict(policy("gravity").numbers), {"share": 3.0, "damping": -1.0, "smoothing": 0.02}]
    seeds = patient_seeds(5, 3)
    returns, unsafe = batch_returns(REFERENCE_FREE["gravity"], rows, seeds, "evaluation", HIDDEN, {})
    for row, found, ended in zip(rows, returns, unsafe, strict=True):
        one = REFERENCE_FREE["gravity"](**row)
        alone = judged(world_of(one, "evaluation", HIDDEN), one, seeds)
        # Sums of 450 rewards in another order.
        np.testing.assert_allclose(found, [m["return"] for m in alone], rtol=0.0, atol=1e-9)
        assert ended.tolist() == [bool(m["unsafe"]) for m in alone]


def test_a_search_in_batches_is_repeatable_and_ranked():
    found = search()
    assert found == search() and len(found) == 6
    returns = [one.measures["return"] for one in found]
    assert returns == sorted(returns, reverse=True) and returns[0] > returns[-1]
    assert search(seed=1) != found


def test_a_search_goes_on_where_it_was_killed():
    whole, done = [], []
    search(progress=whole.append)

    def killed(one):
        done.append(one)
        if len(done) == 4:
            raise RuntimeError("killed")

    with pytest.raises(RuntimeError):
        search(progress=killed)
    more = []
    assert search(known=done, progress=more.append) == search()
    assert [*done, *more] == whole


def test_tries_are_kept_to_the_last_digit(tmp_path):
    kept = KeptTries(tmp_path / "a.csv", "command\nwith a break")
    tries = [
        Try("onset", {"x": 0.123, "y": 1e-05}, {"return": 0.1 + 0.2, "unsafe": 1 / 3}),
        Try("none", {}, {"return": 1.0, "unsafe": 0.0}),
    ]
    for one in tries:
        kept.add(one)
    again = KeptTries(tmp_path / "a.csv", "command\nwith a break")
    assert again.done == {"onset": tries[:1], "none": tries[1:]} and again.count == 2
    with pytest.raises(InputError, match="holds tries of another command: command"):
        KeptTries(tmp_path / "a.csv", "another")
    again.remove()
    assert not (tmp_path / "a.csv").exists() and KeptTries(tmp_path / "a.csv", "another").count == 0


@pytest.mark.parametrize("text", ["", "# c\npolicy,return,numbers\nonset,many,x=1\n", "# c\npolicy,numbers\nonset,x\n"])
def test_a_file_that_is_no_table_of_tries_is_named(text, tmp_path):
    path = tmp_path / "a.csv"
    path.write_text(text)
    with pytest.raises(InputError, match="a.csv' is no table of tries"):
        read_table(path)


def test_the_command_writes_numbers_and_returns_of_all(tmp_path, monkeypatch, capsys):
    asked = []

    def seen(name, *given, **more):
        asked.append(name)
        return tune(name, *given, **more, **SHORT)

    monkeypatch.setattr("agents.commands.search.tune_baselines.tune", seen)
    monkeypatch.setattr("agents.commands.search.tune_baselines.untuned", lambda *given, **more: {"none": 12.5})
    command = ["tune-baselines", "--env", HIDDEN, "--tries", "2", "--patients", "1", "--out", str(tmp_path)]
    assert main(command) == 0
    written = read_yaml(tmp_path / "hidden_intent.yml")
    returns = written.pop(RETURNS)
    assert written.keys() == tunable(HIDDEN).keys() == set(asked)
    assert returns.keys() == {*written, "none"} and returns["none"] == 12.5
    for name, found in written.items():
        REFERENCE_FREE[name](**found)
    _, tries = read_table(tmp_path / "hidden_intent_tries.csv")
    assert len(tries) == 2 * len(written) and not list(tmp_path.glob("*partial*"))
    # Where baselines are of another environment they stay what they are.
    assert not (tmp_path / "baselines.yml").exists()


def test_the_command_goes_on_after_a_stop(tmp_path, monkeypatch, capsys):
    calls = []

    def stopped(name, *given, known, **more):
        calls.append((name, len(known)))
        if len(calls) == 2:
            raise KeyboardInterrupt
        return tune(name, *given, known=known, **more, **SHORT)

    monkeypatch.setattr("agents.commands.search.tune_baselines.tune", stopped)
    monkeypatch.setattr("agents.commands.search.tune_baselines.untuned", lambda *given, **more: {"none": 0.0})
    command = ["tune-baselines", "--env", HIDDEN, "--tries", "2", "--patients", "1", "--out", str(tmp_path)]
    assert main(command) == 130
    assert f"2 of {2 * len(tunable(HIDDEN))} tries are in" in (said := capsys.readouterr().err) and "goes on" in said
    assert main([*command, "--seed", "1"]) == 2
    assert "holds tries of another command" in capsys.readouterr().err
    assert main(command) == 0
    assert calls[2] == (calls[0][0], 2) and calls[3][1] == 0


@pytest.mark.slow
def test_a_search_that_is_killed_goes_on(tmp_path):
    command = [sys.executable, "-m", "agents", "tune-baselines", "--env", HIDDEN, "--tries", "4", "--patients", "2"]
    running = subprocess.Popen([*command, "--out", str(tmp_path / "killed")], cwd=ROOT)
    part, end = tmp_path / "killed" / "hidden_intent_tries.partial.csv", time.monotonic() + 300.0
    while not part.exists() and time.monotonic() < end:
        time.sleep(0.05)
    running.kill()
    running.wait()
    before = read_table(part)[1]
    assert 0 < len(before) < 4 * len(tunable(HIDDEN))
    for folder in ("killed", "whole"):
        subprocess.run([*command, "--out", str(tmp_path / folder)], cwd=ROOT, check=True)
    for name in ("hidden_intent.yml", "hidden_intent_tries.csv"):
        assert (tmp_path / "killed" / name).read_bytes() == (tmp_path / "whole" / name).read_bytes()


def test_shipped_numbers_are_the_best_of_the_table_of_tries():
    shipped = read_yaml(configs() / HIDDEN_INTENT)
    returns = shipped.pop(RETURNS)
    assert shipped.keys() == tunable(HIDDEN).keys() and returns.keys() >= {*shipped, "none"}
    _, tries = read_table(configs() / "baselines/hidden_intent_tries.csv")
    for name, found in shipped.items():
        policy(name)
        best = max((one for one in tries if one.policy == name), key=lambda one: one.measures["return"])
        assert best.numbers == found
        # The table has four digits.
        assert best.measures["return"] == pytest.approx(returns[name], rel=1e-3)
    # Nobody who does not know the plan does as well as who does.
    assert max(returns, key=returns.__getitem__) not in {n for n, k in REFERENCE_FREE.items() if not k.informed}


def test_places_and_ranges_are_inverse():
    for r in (Range(-1.0, 3.0), Range(0.01, 1.0, True)):
        for x in (0.0, 0.3, 1.0):
            # Numbers have three digits.
            assert place(r, r.at(x)) == pytest.approx(x, abs=2e-3)


def test_hindsight_begins_with_the_tuned_numbers_and_is_never_below_them():
    rows = tried_numbers("gravity", 6, 0)
    assert rows[0] == dict(policy("gravity").numbers) and len({tuple(r.values()) for r in rows}) == 6
    found = {
        name: hindsight(name, 6, 3, 0, population="evaluation", environment=HIDDEN, share_out=here, **SHORT)
        for name in ("gravity", "mean_clock")
    }
    for row in summed_up(found, 0):
        assert row["hindsight"]["value"] >= row["tuned"]["value"] and row["gain"]["low"] >= 0.0
        assert row["tuned"]["count"] == 3
    clock, gravity = (np.array(list(found[name][0].measures.values())) for name in ("mean_clock", "gravity"))
    worth = tuned_difference(found["mean_clock"], found["gravity"], 0)
    assert worth["value"] == pytest.approx(np.mean(clock - gravity))
    known = found["gravity"][:4]
    more = []
    again = hindsight(
        "gravity", 6, 3, 0, population="evaluation", environment=HIDDEN, share_out=here, known=known,
        progress=more.append, **SHORT,
    )  # fmt: skip
    assert again == found["gravity"] and more == found["gravity"][4:]
    assert "return" not in table(found, "c", EXACT)


def test_the_hindsight_command_writes_a_row_a_policy_and_patient(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(
        "agents.commands.search.hindsight.tried", lambda *given, **more: hindsight(*given, **more, **SHORT)
    )
    out = tmp_path / "hindsight.csv"
    assert main(["hindsight", "--patients", "2", "--tries", "2", "--out", str(out)]) == 0
    assert "mean_clock - mean_angle, tuned, patient by patient:" in capsys.readouterr().out
    with out.open() as file:
        assert file.readline().startswith("# python -m agents hindsight --population evaluation --patients 2 --tries 2")
        rows = list(csv.DictReader(file))
    assert [row["policy"] for row in rows] == [name for name in tunable(HIDDEN) for _ in range(2)]
    assert all(float(row["hindsight_return"]) >= float(row["tuned_return"]) for row in rows)
    assert not beside(out).exists()


@pytest.mark.parametrize(
    ("more", "said"),
    [(["--env", "exo/ElbowLift-v2"], "hides the patient's plan"), (["--tries", "1"], "tries = 1"),
     (["--patients", "0"], "patients = 0")],
)  # fmt: skip
def test_mistakes_of_hindsight_are_named(more, said, tmp_path, capsys):
    assert main(["hindsight", "--out", str(tmp_path / "a.csv"), *more]) == 2
    assert said in capsys.readouterr().err


def test_patients_of_a_search_are_not_those_of_hindsight():
    assert not set(patient_seeds(STREAM, 50)) & set(patient_seeds(0, 50))
