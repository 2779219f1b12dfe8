"""Outputs of the commands: twice in the same place works, what others wrote stays, names may be any."""

import csv
import json
from itertools import islice

import pytest

from agents.__main__ import main
from agents.commands.search.tune_baselines import _yaml
from agents.evaluation.results.tables import whole_table
from agents.evaluation.search.tries import Try, table
from dms_core.files.outputs import MANIFEST

EVALUATE = ["evaluate", "--policy", "none", "--population", "stroke_mild", "--patients", "1"]


def test_an_evaluation_is_renewed_and_no_other_folder_is_touched(tmp_path, capsys):
    out = tmp_path / "out"
    for _ in range(2):
        assert main([*EVALUATE, "--out", str(out)]) == 0
    (tmp_path / "others").mkdir()
    (tmp_path / "others" / "evaluation.json").write_text("precious")
    assert main([*EVALUATE, "--out", str(tmp_path / "others")]) == 2
    said = capsys.readouterr().err
    assert "is not empty and was not written by `evaluate`" in said and "--overwrite" in said
    assert (tmp_path / "others" / "evaluation.json").read_text() == "precious"
    assert main([*EVALUATE, "--out", str(tmp_path / "others"), "--overwrite"]) == 0


def test_a_policy_is_not_evaluated_into_its_own_folder(tmp_path, capsys):
    from agents.policies.learned import SHIPPED

    policy = tmp_path / "policy"
    assert main(["export", str(SHIPPED / "learned"), "--no-onnx", "--out", str(policy)]) == 0
    assert main(["export", str(policy), "--no-onnx", "--out", str(policy)]) == 2
    assert f"output '{policy}' is the input" in capsys.readouterr().err
    assert main(["evaluate", "--policy", str(policy), "--out", str(policy), "--overwrite"]) == 2
    assert {p.name for p in policy.iterdir()} == {"policy.json", "weights.safetensors", MANIFEST}


@pytest.mark.parametrize("name", ["film.gif", "film.mp4"])
def test_a_film_is_replaced_with_the_flag(tmp_path, name, monkeypatch, capsys):
    imageio = pytest.importorskip("imageio.v2")
    pytest.importorskip("pygame")
    if name.endswith("mp4"):
        pytest.importorskip("imageio_ffmpeg")
    from agents.commands.pictures import video

    monkeypatch.setattr(video, "pictures", lambda stages, known=video.pictures: islice(known(stages), 6))
    command = ["video", "--policy", "none", "--out", str(tmp_path / name)]
    assert [main(command), main(command), main([*command, "--overwrite"])] == [0, 2, 0]
    assert f"{name}' exists; choose another name" in capsys.readouterr().err
    assert sum(1 for _ in imageio.get_reader(tmp_path / name)) >= 2  # readers take it


def test_numbers_of_the_baselines_are_replaced_with_the_flag(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(
        "agents.commands.search.tune_baselines.tune",
        lambda name, *given, **more: [Try(name, {"x": 1.0}, {"return": 2.0})],
    )
    command = ["tune-baselines", "--tries", "2", "--patients", "1", "--out", str(tmp_path)]
    assert [main(command), main(command), main([*command, "--overwrite"])] == [0, 2, 0]
    assert "baselines.yml' exists; choose another name" in capsys.readouterr().err


def test_a_line_break_in_a_name_stays_in_its_comment():
    tries = {"pid": [Try("pid", {"x": 1.0}, {"return": 2.0})]}
    assert _yaml(tries, {}, "my\npatients: 1", "command\nwith: break", "tries.csv").count("\n") == 5
    assert table(tries, "command\nwith: break").count("\n") == 3


def test_names_with_bars_and_breaks_leave_a_table_whole(tmp_path):
    assert main([*EVALUATE, "--out", str(tmp_path)]) == 0
    results = json.loads((tmp_path / "evaluation.json").read_text())
    results["population"] = "mild\n# or | severe"
    results["policies"]["a|b\nc"] = results["policies"].pop("none")
    lines = whole_table(results)
    rows = [line for line in lines if line.startswith("|")]
    assert all("\n" not in line for line in lines) and rows[0] == "|  | a\\|b\\nc |"
    assert {row.replace("\\|", "").count("|") for row in rows} == {3}


@pytest.mark.slow
def test_a_table_of_schedules_is_replaced_with_the_flag(tmp_path, capsys):
    out = tmp_path / "bound.csv"
    command = ["upper-bound", "--patients", "1", "--population", "stroke_mild", "--out", str(out)]
    assert main(command) == 0 and capsys.readouterr().out.startswith("1 patient of 'stroke_mild', 1 repetition, shared")
    with out.open(newline="") as file:
        assert file.readline().startswith("# python -m agents upper-bound ") and len(list(csv.DictReader(file))) == 1
    out.write_text("seed,ability\n")
    assert main(command) == 2 and out.read_text() == "seed,ability\n"
    assert main([*command, "--overwrite"]) == 0
