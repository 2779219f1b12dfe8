"""Evaluation end to end: same seed same bits, same patients for all, mistakes, files."""

import json
import math
import sys

import numpy as np
import pytest

from agents.__main__ import main
from agents.environment import patient_seeds
from agents.evaluation.comparison.by_patient import by_patient
from agents.evaluation.comparison.evaluate import evaluate
from agents.evaluation.comparison.statistics import interquartile_mean
from agents.evaluation.episodes.measures import MEASURES
from agents.evaluation.results.tables import short_table, whole_table
from agents.policies.baselines import FOLLOWING, POLICIES, policy
from agents.policies.learned import LearnedPolicy, find_policy, repetitions_of, shipped_policies
from dms_core.errors import InputError
from dms_core.files.outputs import MANIFEST

USUAL = [m.name for m in MEASURES if not m.special]
SHORT = {"episode_duration": 0.6}
"""Until the lift has begun; a whole episode tells no more and takes ten times as long."""


def run(names, patients=2, seed=0):
    return evaluate([policy(n) for n in names], "evaluation", patients, seed, **SHORT)


def test_seed_decides_all():
    first, again, other = run(["none", "pid"]), run(["none", "pid"]), run(["none"], seed=1)
    assert json.dumps(first) == json.dumps(again)
    assert first["policies"]["none"] != other["policies"]["none"]


def test_every_policy_meets_the_same_patients():
    found = run(list(FOLLOWING))["policies"]
    met = [[(e["seed"], e["load"], e["patient"], e["reference"]) for e in p["episodes"]] for p in found.values()]
    assert all(m == met[0] for m in met)
    assert met[0][0] != met[0][1]


def test_who_can_do_something_is_summed_up_apart():
    weak = {"base": "stroke_severe", "fields": {"maximum_activation_flexors": {"uniform": [0.0, 0.15]}}}
    found = evaluate([policy("none"), policy("pid")], weak, 6, 2, **SHORT)
    for one in found["policies"].values():
        able = [e["measures"]["return"] for e in one["episodes"] if e["ability"] >= 0.2]
        assert 0 < len(able) < 6
        assert one["summary_able"]["return"]["count"] == len(able)
        assert one["summary_able"]["return"]["value"] == pytest.approx(interquartile_mean(np.array(able)))
    assert f"of the {len(able)} with ability from 0.2" in "\n".join(whole_table(found))


def test_nothing_is_printed_twice():
    found = run(["none", "pid"])
    one = run(["pid"])
    for results, differences in ((found, 2), (one, 0)):
        for p in results["policies"].values():
            for e in p["episodes"]:
                e["ability"] = 1.0
        said = "\n".join(whole_table(results))
        assert "with ability" not in said and "of these" not in said
        assert said.count("mean difference to") == differences
        assert said.count("work of the device") == 1 + differences


def test_round_off_is_printed_as_zero():
    found = run(["none"])
    work = found["policies"]["none"]["summary"]["device_work_share"]
    work |= {"value": 3e-9, "low": -2e-17, "high": 0.0123}
    assert "| 0 [0, 0.0123] |" in "\n".join(whole_table(found))


def test_what_is_printed_fits_a_terminal():
    found = run(list(FOLLOWING))
    head, *rows = short_table(found).splitlines()
    assert [row.split()[0] for row in rows] == list(FOLLOWING) and "difference to" in head
    assert max(map(len, [head, *rows])) <= 120
    # Longer names than those of baselines: the last part of a folder, where these differ.
    found["policies"] = {f"out/some/long/folder/{name}": p for name, p in found["policies"].items()}
    assert short_table(found) == "\n".join([head, *rows])
    found["policies"] = {name.rpartition("/")[2]: p for name, p in found["policies"].items()}
    first, other = (found["policies"][name] for name in list(FOLLOWING)[:2])
    expected = np.mean(by_patient(other["episodes"], "return") - by_patient(first["episodes"], "return"))
    assert f"{expected:.3g} [" in rows[1] and "difference" not in short_table(run(["pid"]))


def test_a_single_unsafe_episode_and_large_numbers_are_not_rounded_away():
    found = run(["pid"])
    p = found["policies"]["pid"]
    p["episodes"] *= 300
    p["episodes"][7] = {**p["episodes"][7], "measures": {**p["episodes"][7]["measures"], "unsafe": 1.0}}
    p["summary"]["return"] |= {"value": 1234.6, "low": 999.6, "high": 12345.0}
    said = short_table(found)
    assert "1 of 600" in said and "1235 [1000, 12345]" in said


def test_repetitions_are_those_that_were_learned_with(tmp_path):
    learned = find_policy("learned")
    folder = tmp_path / "one"
    found = learned.description.model_copy(update={"env_kwargs": {}})
    LearnedPolicy(found, learned.arrays).save(folder)
    one = find_policy(str(folder))
    assert repetitions_of([policy("pid")]) == 1 and repetitions_of([policy("pid"), learned]) == 3
    assert repetitions_of([one, policy("pid")]) == 1 and repetitions_of([one, learned], 2) == 2
    with pytest.raises(InputError, match=r"learned with 3, .*one with 1\); give --repetitions"):
        repetitions_of([learned, one])


def test_order_of_policies_does_not_matter():
    one, other = run(["none", "pid"], patients=1), run(["pid", "none"], patients=1)
    for part in ("episodes", "summary", "summary_able"):
        assert one["policies"]["pid"][part] == other["policies"]["pid"][part]


def test_more_patients_keep_the_first():
    assert patient_seeds(5, 10)[:4] == patient_seeds(5, 4)


def test_shares_of_work_sum_to_one_and_measures_are_complete():
    for p in run(list(FOLLOWING))["policies"].values():
        assert [n for n in p["summary"] if not n.startswith("reward.")] == USUAL
        for e in p["episodes"]:
            m = e["measures"]
            shares = m["device_work_share"], m["patient_work_share"]
            # Nobody may have done positive work in so short a time: an arm that only sinks.
            assert math.isclose(sum(shares), 1.0, rel_tol=1e-12) or np.isnan(shares).all()
            assert np.isfinite([m["return"], m["tracking_rms_deg"], m["peak_tension_N"], m["peak_reaction_N"]]).all()


@pytest.mark.parametrize(
    "arguments, said",
    [
        (["--policy", "nobody"], "unknown policy 'nobody'. There are: adaptive_gravity, admittance, assist_as_needed"),
        (["--policy", "none", "none"], "different"),
        (["--policy", "none", "--population", "martians"], "unknown population 'martians'"),
        (["--policy", "none", "--patients", "0"], "patients = 0"),
        (["--policy", "none", "--seed", "-1"], "seed = -1"),
        (["--policy", "none", "--policy", "pid"], "--policy stands 2 times"),
    ],
)
def test_mistakes_are_one_message(arguments, said, tmp_path, capsys):
    assert main(["evaluate", *arguments, "--out", str(tmp_path / "out")]) == 2
    captured = capsys.readouterr()
    assert said in captured.err and captured.err.startswith("error: ") and captured.err.count("\n") == 1
    assert not list(tmp_path.rglob("*.json"))


def test_command_writes_table_json_and_figure(tmp_path, capsys):
    pytest.importorskip("matplotlib")
    assert main(["evaluate", "--policy", "none", "--patients", "1", "--out", str(tmp_path)]) == 0
    printed = capsys.readouterr().out
    assert "return" in printed and "evaluation.md" in printed
    assert all(m.label in (tmp_path / "evaluation.md").read_text() for m in MEASURES if not m.special)
    found = json.loads((tmp_path / "evaluation.json").read_text(), parse_constant=pytest.fail)
    assert found["patients"] == 1 and len(found["policies"]["none"]["episodes"]) == 1
    assert (tmp_path / "evaluation.png").read_bytes()[:8] == b"\x89PNG\r\n\x1a\n"
    assert sorted(p.name for p in tmp_path.iterdir()) == [
        MANIFEST,
        "evaluation.json",
        "evaluation.md",
        "evaluation.png",
    ]


def test_without_matplotlib_the_figure_is_left_out_and_no_earlier_one_stays(tmp_path, capsys, monkeypatch):
    pytest.importorskip("matplotlib")
    command = ["evaluate", "--policy", "none", "--patients", "1", "--out", str(tmp_path / "out")]
    assert main(command) == 0 and (tmp_path / "out" / "evaluation.png").is_file()
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    assert main(command) == 0
    assert "evaluation.png is left out: " in capsys.readouterr().out
    assert sorted(p.name for p in (tmp_path / "out").iterdir()) == [MANIFEST, "evaluation.json", "evaluation.md"]


def test_command_takes_repetitions(tmp_path, capsys):
    pytest.importorskip("matplotlib")
    options = ["--policy", "pid", "--patients", "1", "--population", "stroke_mild"]
    returns = []
    for k in (1, 2):
        assert main(["evaluate", *options, "--repetitions", str(k), "--out", str(tmp_path / str(k))]) == 0
        found = json.loads((tmp_path / str(k) / "evaluation.json").read_text())
        assert found["settings"] == {"repetitions": k}
        returns.append(found["policies"]["pid"]["episodes"][0]["measures"]["return"])
    # The second repetition earns something, and less than the first: effort has decayed.
    assert 1.2 * returns[0] < returns[1] < 2.0 * returns[0]


def test_policies_lists_all(capsys):
    assert main(["policies"]) == 0
    assert [line.split()[0] for line in capsys.readouterr().out.splitlines()] == [*POLICIES, *shipped_policies()]


def test_loads_are_lifted_by_every_patient_and_averaged():
    found = evaluate([policy("none"), policy("pid")], "stroke_mild", 2, 3, loads=(0.6, 1.4), **SHORT)
    one, other = (found["policies"][name] for name in ("none", "pid"))
    assert [e["load"] for e in one["episodes"]] == [0.6, 1.4, 0.6, 1.4]
    assert one["episodes"][0]["patient"] == one["episodes"][1]["patient"] != one["episodes"][2]["patient"]
    values = [e["measures"]["return"] for e in one["episodes"]]
    means = [(values[0] + values[1]) / 2, (values[2] + values[3]) / 2]
    np.testing.assert_allclose(by_patient(one["episodes"], "return"), means)
    assert one["summary"]["return"]["count"] == 2
    wanted = np.mean(by_patient(other["episodes"], "return") - means)
    assert other["difference"]["return"]["value"] == pytest.approx(wanted)
    assert one["difference"]["return"]["value"] == 0.0
