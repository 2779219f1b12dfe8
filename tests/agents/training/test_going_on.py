"""A training goes on as what it was: only what changes neither the task nor its measure may differ."""

import json
import shutil
import subprocess
import sys
import time
from pathlib import Path

import pytest
import yaml

pytest.importorskip("sb3_contrib")

from agents.__main__ import main
from agents.training.files.records import seal
from agents.training.files.run_folder import RunFolder, read_record
from agents.training.settings.fixed_values import MAY_CHANGE
from tests.agents.tiny import config_file

ROOT = Path(__file__).parents[3]


def resume(folder, *changes):
    return main(["train", "--resume", str(folder), *(("--set", *changes) if changes else ())])


def content(folder):
    """All files but the lock, with their bytes."""
    return {p: p.read_bytes() for p in folder.rglob("*") if p.is_file() and p.name != ".lock"}


@pytest.fixture(scope="module")
def trained(tmp_path_factory):
    folder = tmp_path_factory.mktemp("trained")
    given = ["--config", str(config_file(folder)), "--out", str(folder / "run"), "--set", "n_timesteps=32"]
    assert main(["train", *given]) == 0
    return folder / "run"


@pytest.fixture
def run(trained, tmp_path):
    """A training of 32 steps, to be written to."""
    return shutil.copytree(trained, tmp_path / "run")


def refused(folder, capsys, *changes):
    """What is said of a start that is refused in one sentence a line and writes nothing."""
    before = content(folder)
    capsys.readouterr()
    assert resume(folder, *changes) == 2
    said = capsys.readouterr().err
    assert said.startswith("error: ") and said.count("\n") == 1 and content(folder) == before
    return said


@pytest.mark.parametrize(
    "old, new, said",
    [
        ("episode_duration: 0.4", "episode_duration: 0.8", "env_kwargs.episode_duration was 0.4 and is 0.8"),
        ("gamma: 0.98", "gamma: 0.9", "gamma was 0.98 and is 0.9"),
        ("  gamma: 0.98\n", "", "gamma was 0.98 and is not given"),
        ("n_envs: 2", "n_envs: 4", "n_envs was 2 and is 4"),
        ("patient: stroke_mild", "action_mode: pid_setpoint", "env_kwargs.action_mode was not given and is 'pid_setp"),
        ("normalize: true", "normalize: false", "normalize was True and is False"),
        ("normalize: true", "normalize: {norm_reward: false}", "normalize.norm_reward was not given and is False"),
        ("vf'': [8]", "vf'': [9]", "policy_kwargs.net_arch.vf was [8] and is [9]"),
        ("learning_rate: lin_1e-3", "learning_rate: lin_1e-4", "learning_rate was 'lin_1e-3' and is 'lin_1e-4'"),
        ("eval_patients: 1", "eval_patients: 2", "training.eval_patients was 1 and is 2"),
        ("hold: 1", "hold: 2", "training.hold was 1 and is 2"),
        ("traces: []", "traces: [0.1]", "training.traces was [] and is [0.1]"),
        ("against: null", "against: [0.0, 0.5]", "training.against was None and is [0.0, 0.5]"),
        ("algorithm: ppo", "algorithm: sac", "sac"),
    ],
)  # fmt: skip
def test_an_edited_configuration_is_refused_by_key_and_values(old, new, said, run, capsys):
    file = run / "config.yml"
    text = file.read_text()
    assert old in text
    # rl_zoo3's copy of the settings is edited with them: sed does so.
    file.write_text(text.replace(old, new))
    assert said in refused(run, capsys, "n_timesteps=64")


def test_many_changes_are_counted(run, capsys):
    file = run / "config.yml"
    read = yaml.safe_load(file.read_text())
    read["training"] |= {"hold": 2, "eval_seed": 1, "eval_patients": 3, "critic": ["privileged"]}
    file.write_text(yaml.safe_dump(read))
    assert " and 1 more; " in refused(run, capsys)


def test_layout_comments_and_order_may_change(run):
    file = run / "config.yml"
    read = yaml.safe_load(file.read_text())
    turned = {key: dict(reversed(section.items())) for key, section in reversed(read.items())}
    turned["exo/ElbowLift-v2"] |= {"frame_stack": 1}  # the default
    text = "# a comment\n" + yaml.safe_dump(turned, sort_keys=False).replace("gamma: 0.98", "gamma: 0.980  # so")
    file.write_bytes(b"\xef\xbb\xbf" + text.replace("\n", "\r\n").encode())
    assert resume(run, "n_timesteps=64") == 0
    assert resume(run, "n_timesteps=96") == 0


def test_what_may_change_goes_into_the_configuration(run):
    changes = {"n_timesteps": 64, "training.eval_every": 32, "training.save_every": 64, "training.threads": 2}
    changes["training.device"] = "auto"
    assert set(changes) == set(MAY_CHANGE)
    assert resume(run, *(f"{key}={value}" for key, value in changes.items())) == 0
    kept = yaml.safe_load((run / "config.yml").read_text())
    assert [kept["training"][k.split(".")[1]] for k in changes if "." in k] == [32, 64, 2, "auto"]
    assert resume(run) == 0


@pytest.mark.parametrize(
    "change",
    [
        "training.eval_patients=3", "training.eval_seed=5", "training.hold=2", "training.against=[0.0, 0.5]",
        "training.start=[0.0, 0.5]", "training.traces=[0.1]", "training.critic=[privileged]", "training.algorithm=sac",
        "gamma=0.5", "gamma=0.98", "n_envs=4", "env_kwargs.episode_duration=4.0", "n_timesteps.x=1", "training={}",
        "training.wings=1", "training.eval_every.x=1", "env_wrapper=x", "nonsense",
    ],
)  # fmt: skip
def test_set_takes_no_other_key(change, run, capsys):
    said = refused(run, capsys, "n_timesteps=64", change)
    assert f"--set {change}: in a training that goes on only these may change: n_timesteps, training.device" in said


@pytest.mark.parametrize(
    "change", ["training.device=cuda:99", "training.threads=0", "n_timesteps=.inf", "n_timesteps=0"]
)
def test_unusable_values_leave_the_training_as_it_was(change, run, capsys):
    assert change.partition("=")[0].removeprefix("training.") in refused(run, capsys, change)
    assert resume(run, "n_timesteps=64") == 0


def test_an_edited_population_is_refused(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    from exo_env.patient.population import population

    facts = yaml.safe_dump(json.loads(population("stroke_mild").model_dump_json(exclude_defaults=True)))
    Path("mine.yaml").write_text(facts)
    path = config_file(tmp_path, env_kwargs={"patient": "mine.yaml", "episode_duration": 0.4})
    assert main(["train", "--config", str(path), "--out", "run", "--set", "n_timesteps=32"]) == 0
    Path("mine.yaml").write_text("# the same\n" + facts)
    assert resume(Path("run"), "n_timesteps=64") == 0
    read = yaml.safe_load(facts)
    Path("mine.yaml").write_text(yaml.safe_dump(read | {"title": "another one"}))
    assert "content of env_kwargs.patient was '" in refused(Path("run"), capsys)


@pytest.mark.parametrize(
    "key, value",
    [("seed", 7), ("algorithm", "sac"), ("environment", "exo/A-v0"), ("fixed", None), ("sha256", "")],
)
def test_an_edited_record_is_refused(key, value, run, capsys):
    record = read_record(run)
    (run / "run.json").write_text(json.dumps(record | {key: value}))
    assert "run.json' was changed: its SHA-256 is not the one that it holds" in refused(run, capsys)


def test_layout_and_command_lines_of_the_record_may_change(run):
    record = read_record(run)
    record["sessions"][0]["command"] = "of somebody"
    (run / "run.json").write_text(json.dumps(dict(reversed(record.items()))))
    assert resume(run) == 0


def test_a_value_of_a_later_version_has_its_default(run, capsys):
    """The record of an older version does not know the key, and its configuration had the default."""
    record = read_record(run)
    del record["fixed"]["training"]["hold"]
    (run / "run.json").write_text(json.dumps(record | {"sha256": seal(record)}))
    assert resume(run) == 0
    file = run / "config.yml"
    file.write_text(file.read_text().replace("hold: 1", "hold: 2"))
    assert "training.hold was 1 and is 2" in refused(run, capsys)


def test_folders_of_older_versions_go_on(run, capsys):
    record = read_record(run)
    (run / "run.json").write_text(json.dumps({k: v for k, v in record.items() if k not in ("fixed", "sha256")}))
    assert resume(run, "n_timesteps=64") == 0
    assert "only these may change" in refused(run, capsys, "gamma=0.5")


def test_seed_and_environment_are_the_training_s(run, capsys):
    assert main(["train", "--resume", str(run), "--seed", "0", "--env", "exo/ElbowLift-v2"]) == 0
    for given in (["--seed", "7"], ["--env", "exo/ElbowTrack-v1"]):
        before = content(run)
        assert main(["train", "--resume", str(run), *given]) == 2
        assert capsys.readouterr().err.count("which may not change" if "7" in given else "error: ") == 1
        assert content(run) == before


def test_a_second_process_changes_nothing(run, capsys):
    """While another one trains: neither its configuration nor its record."""
    with RunFolder(run).locked():
        assert "another process is training" in refused(run, capsys, "n_timesteps=64")
    assert resume(run, "n_timesteps=64") == 0


@pytest.mark.slow
def test_of_two_processes_that_go_on_at_once_one_does(run):
    command = [sys.executable, "-m", "agents", "train", "--resume", str(run), "--set", "n_timesteps=20000"]
    both = [
        subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) for _ in "ab"
    ]
    try:
        # The loser ends at once, the winner long after it.
        while all(one.poll() is None for one in both):
            time.sleep(0.05)
        lost, won = sorted(both, key=lambda one: one.poll() is None)
        assert lost.returncode == 2 and lost.communicate()[1].count("another process is training in") == 1
    finally:
        for one in both:
            one.kill()
            one.communicate()
    assert won.returncode != 2 and len(read_record(run)["sessions"]) == 2
    assert not [p for p in (run / "checkpoints").iterdir() if p.name.endswith("_again")]


def test_what_is_no_training_gets_no_lock(tmp_path):
    assert resume(tmp_path) == 2 and resume(tmp_path / "nowhere") == 2
    assert list(tmp_path.iterdir()) == []
    config = config_file(tmp_path)
    assert main(["train", "--config", str(config), "--out", str(tmp_path)]) == 2
    assert [p.name for p in tmp_path.iterdir()] == [config.name]


def test_a_sweep_goes_on_by_the_same_rules(run):
    from agents.distributed.sweep import train_share
    from agents.training.settings.config import Config
    from dms_core.errors import InputError

    file = run / "config.yml"
    config = Config.read(file).content()
    with RunFolder(run).locked():
        before = content(run)
        with pytest.raises(InputError, match="another process is training"):
            train_share(config, 0, str(run))
        assert content(run) == before
    assert train_share(config, 0, str(run))["steps"] <= 32
    file.write_text(file.read_text().replace("gamma: 0.98", "gamma: 0.9"))
    with pytest.raises(InputError, match="gamma was 0.98 and is 0.9"):
        train_share(config, 0, str(run))
