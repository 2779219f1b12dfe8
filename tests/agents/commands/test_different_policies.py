"""A policy is compared with others, not with itself under another name."""

import shutil
from pathlib import Path

import pytest

from agents.__main__ import main
from agents.commands.options import different_policies
from agents.policies.baselines import POLICIES
from agents.policies.learned import SHIPPED, LearnedPolicy
from dms_core.errors import InputError
from dms_core.files.config_files import configs

LEARNED = configs() / "policies" / "learned"
OWN = "tests.agents.policies.test_own_policy:Half"


class SamePid(POLICIES["pid"]):
    """Another class is another policy."""


Again = POLICIES["pid"]


@pytest.fixture
def here(tmp_path, monkeypatch):
    """A folder with a policy, a link to it, a copy of it, and a training that kept it as its best."""
    monkeypatch.chdir(tmp_path)
    shutil.copytree(LEARNED, "a/pol")
    shutil.copytree(LEARNED, "copy")
    Path("link").symlink_to("a/pol", target_is_directory=True)
    from agents.checkpoint import Store

    one = LearnedPolicy.load(LEARNED)
    Store(Path("run/best")).save("steps_1", one.save)
    Path("run/run.json").write_text("{}")
    return tmp_path


@pytest.mark.parametrize(
    "names",
    [
        ("a/pol", "./a/pol"), ("a/pol", "a/pol/"), ("a/pol", "a/../a/pol"), ("a/pol", "link"),
        ("a/pol", "{here}/a/pol"), ("run", "run/"), ("run", "run/best/steps_1"),
        ("learned", str(SHIPPED / "learned")), ("pid", "pid"),
        ("pid", "agents.policies.baselines:PidControl"), ("pid", f"{__name__}:Again"), (OWN, OWN),
    ],
)  # fmt: skip
def test_one_policy_under_two_names_is_refused(names, here):
    names = [name.format(here=here) for name in ("none", *names)]
    with pytest.raises(InputError) as caught:
        different_policies(names)
    assert str(caught.value) == f"policies '{names[1]}' and '{names[2]}' are the same one: expected different policies."


def test_others_are_taken(here):
    names = ["none", "pid", "learned", "a/pol", "copy", "run", OWN, f"{__name__}:SamePid"]
    assert [one.name for one in different_policies(names)] == names


def test_every_command_that_compares_refuses(here, capsys):
    pytest.importorskip("matplotlib")
    assert main(["evaluate", "--policy", "a/pol", "./a/pol", "--out", "out"]) == 2
    assert main(["video", "--policy", "a/pol", "link", "--out", "a.gif"]) == 2
    assert main(["evaluate", "--policy", "none", "--patients", "1", "--out", "evaluated"]) == 0
    assert main(["report", "evaluated", "--policies", "a/pol", "a/pol/", "--out", "report"]) == 2
    assert capsys.readouterr().err.count("are the same one") == 3


@pytest.mark.parametrize("loads", [("1", "1.0"), ("0.6", "1", "6e-1"), ("0", "-0.0")])
def test_a_load_counts_once(loads, tmp_path, capsys):
    assert main(["evaluate", "--policy", "pid", "--loads", *loads, "--out", str(tmp_path / "out")]) == 2
    assert "expected each load once" in capsys.readouterr().err and not list(tmp_path.rglob("*.json"))
