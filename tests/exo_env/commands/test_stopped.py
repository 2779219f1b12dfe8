"""Ctrl-C in commands: status 130, and a sentence on what was done."""

import pytest

from dms_core.files.outputs import MANIFEST
from exo_env.__main__ import main
from exo_env.envs.base_env import AssistanceEnv


def test_a_soak_counts_what_was_done(monkeypatch, capsys):
    known, calls = AssistanceEnv.step, []

    def step(self, action):
        calls.append(1)
        if len(calls) == 8:
            raise KeyboardInterrupt
        return known(self, action)

    monkeypatch.setattr(AssistanceEnv, "step", step)
    assert main(["soak", "--steps", "20"]) == 130
    done = capsys.readouterr()
    assert "steps                    7" in done.out and "failed_solves            0" in done.out
    assert done.err == "stopped: the counts above are of 7 of 20 steps.\n"


def test_scenarios_are_all_written_or_none(monkeypatch, capsys, tmp_path):
    import exo_env.commands.scenarios as command

    known, calls = command.run, []

    def run(*given):
        calls.append(1)
        if len(calls) == 2:
            raise KeyboardInterrupt
        return known(*given)

    monkeypatch.setattr(command, "run", run)
    assert main(["scenarios", "--out", str(tmp_path / "out")]) == 130
    assert "stopped: 1 of 4 scenarios were simulated; nothing was written.\n" in capsys.readouterr().err
    assert list((tmp_path / "out").iterdir()) == []


@pytest.mark.parametrize("name", ["tune", "scenarios"])
def test_a_folder_of_others_is_refused_before_the_work(name, monkeypatch, capsys, tmp_path):
    (tmp_path / "fig07_tuned.png").write_text("precious")
    monkeypatch.setattr(f"exo_env.commands.{name}.StepExperiment", lambda *given: pytest.fail("the work began"))
    monkeypatch.setattr("exo_env.commands.scenarios.run", lambda *given: pytest.fail("the work began"))
    assert main([name, "--out", str(tmp_path)]) == 2
    assert f"is not empty and was not written by `{name}`" in capsys.readouterr().err
    assert (tmp_path / "fig07_tuned.png").read_text() == "precious" and not (tmp_path / MANIFEST).exists()
