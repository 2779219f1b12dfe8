"""Training: same seed same weights, any death is survived, every mistake is one sentence."""

import errno
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("sb3_contrib")

from agents.__main__ import main
from agents.policies.learned import LearnedPolicy, find_policy
from agents.training.files.run_folder import RunFolder, read_record
from tests.agents.tiny import config_file

ROOT = Path(__file__).parents[3]


def train(*arguments):
    return main(["train", *map(str, arguments)])


def weights(folder):
    return LearnedPolicy.load(RunFolder(folder).checkpoints.latest()).arrays


def same(one, other):
    return one.keys() == other.keys() and all(np.array_equal(one[k], other[k]) for k in one)


@pytest.mark.parametrize("algorithm", ["ppo", "sac", "tqc", "recurrent_ppo", "dagger"])
def test_every_algorithm_trains_and_leaves_what_it_says(algorithm, tmp_path, capsys):
    path, out = config_file(tmp_path, algorithm), tmp_path / "run"
    assert train("--config", path, "--out", out) == 0
    printed = capsys.readouterr().out
    assert "written:" in printed and "0 steps: return" in printed
    curve = json.loads((out / "evaluations.json").read_text(), parse_constant=pytest.fail)
    assert [e["steps"] for e in curve][0] == 0 and curve[-1]["steps"] >= 96
    # The policy kept is the one that an evaluation found best.
    best = json.loads((RunFolder(out).best.latest() / "state.json").read_text())
    assert best["return"] == max(e["return"] for e in curve)
    record = read_record(out)
    assert record["sessions"][0]["versions"]["torch"] and record["algorithm"] == algorithm
    assert len([p for p in (out / "checkpoints").iterdir() if p.is_dir()]) == 2
    assert any((out / "tensorboard").iterdir())
    assert find_policy(str(out)).description.algorithm == algorithm


def test_seed_decides_the_weights(tmp_path):
    path = config_file(tmp_path)
    for name, seed in (("a", 1), ("b", 1), ("c", 2)):
        assert train("--config", path, "--seed", seed, "--out", tmp_path / name, "--set", "n_timesteps=64") == 0
    assert same(weights(tmp_path / "a"), weights(tmp_path / "b"))
    assert not same(weights(tmp_path / "a"), weights(tmp_path / "c"))


@pytest.mark.parametrize("algorithm", ["ppo", "sac", "dagger"])
def test_going_on_is_exact_where_it_can_be(algorithm, tmp_path):
    # The state goes on to the last bit: a run that goes on without a further step has the same files, and two copies
    # that go on are alike.
    path = config_file(tmp_path, algorithm)
    assert train("--config", path, "--out", tmp_path / "a", "--set", "n_timesteps=64") == 0
    import shutil

    shutil.copytree(tmp_path / "a", tmp_path / "b")
    before = weights(tmp_path / "a")
    for name in "ab":
        assert train("--resume", tmp_path / name, "--set", "n_timesteps=96") == 0
    assert same(weights(tmp_path / "a"), weights(tmp_path / "b"))
    assert not same(weights(tmp_path / "a"), before)
    assert len(read_record(tmp_path / "a")["sessions"]) == 2


@pytest.mark.parametrize("algorithm", ["ppo", "sac", "recurrent_ppo", "dagger"])
def test_state_comes_back_to_the_last_bit(algorithm, tmp_path):
    import torch

    from agents.training.files.model_state import load_state, save_state
    from agents.training.learners.algorithms import build
    from agents.training.settings.config import Config
    from agents.training.worlds import wrapped

    config = Config.read(config_file(tmp_path, algorithm))
    model = build(config, wrapped(config, 3), 3)
    model.learn(64)
    (tmp_path / "state").mkdir()
    save_state(model, tmp_path / "state")
    drawn = torch.rand(3), np.random.rand(3)
    other = build(config, wrapped(config, 4), 4)
    load_state(other, tmp_path / "state")
    assert torch.equal(torch.rand(3), drawn[0]) and np.array_equal(np.random.rand(3), drawn[1])
    for name, value in model.policy.state_dict().items():
        assert torch.equal(value, other.policy.state_dict()[name])
    for one, two in ((model.get_vec_normalize_env(), other.get_vec_normalize_env()),):
        assert np.array_equal(one.obs_rms.mean, two.obs_rms.mean) and one.ret_rms.count == two.ret_rms.count
    if algorithm == "dagger":
        kept, back = model.demonstrations.columns, other.demonstrations.columns
        assert len(kept["seen"]) == 2 and all(np.array_equal(kept[name], back[name]) for name in kept)
    if algorithm == "sac":
        assert torch.equal(model.log_ent_coef, other.log_ent_coef)
        assert model.replay_buffer.pos == other.replay_buffer.pos > 0
        assert np.array_equal(model.replay_buffer.observations, other.replay_buffer.observations)
        optimizers = model.actor.optimizer, other.actor.optimizer
    else:
        optimizers = model.policy.optimizer, other.policy.optimizer
    one, two = (o.state_dict()["state"] for o in optimizers)
    assert one and all(torch.equal(one[k]["exp_avg"], two[k]["exp_avg"]) for k in one)


def process(*arguments, **options):
    """A training in a process of its own."""
    command = [sys.executable, "-m", "agents", "train", *map(str, arguments)]
    return subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **options)


def wait_for(condition, running, seconds=300.0):
    end = time.monotonic() + seconds
    while not condition():
        assert running.poll() is None, running.communicate()
        assert time.monotonic() < end
        time.sleep(0.01)


@pytest.mark.parametrize(
    "algorithm", ["ppo", pytest.param("sac", marks=pytest.mark.slow), pytest.param("dagger", marks=pytest.mark.slow)]
)
def test_killed_at_any_moment_it_goes_on(algorithm, tmp_path):
    path, out = config_file(tmp_path, algorithm), tmp_path / "run"
    running = process("--config", path, "--out", out, "--set", "n_timesteps=1e6", "training.eval_every=1e6")
    pointer = out / "checkpoints" / "latest"
    wait_for(pointer.exists, running)
    first = pointer.read_text()
    wait_for(lambda: pointer.read_text() != first, running)
    running.send_signal(signal.SIGKILL)
    running.communicate()
    steps = int(pointer.read_text().strip().rpartition("_")[2])
    assert train("--resume", out, "--set", f"n_timesteps={steps + 64}") == 0
    curve = [e["steps"] for e in json.loads((out / "evaluations.json").read_text())]
    assert curve == sorted(curve) and curve[-1] >= steps + 64
    assert RunFolder(out).checkpoints.latest().name >= f"steps_{steps + 64:010d}"
    assert not list((out / "checkpoints").glob(".*"))


@pytest.mark.parametrize("number", [signal.SIGINT, pytest.param(signal.SIGTERM, marks=pytest.mark.slow)])
def test_told_to_stop_it_saves_and_says_how_to_go_on(number, tmp_path):
    path, out = config_file(tmp_path), tmp_path / "run"
    running = process(
        "--config", path, "--out", out, "--set", "n_timesteps=1e6", "training.save_every=1e6", "training.eval_every=1e6"
    )
    wait_for((out / "evaluations.json").exists, running)
    time.sleep(0.5)
    running.send_signal(number)
    said, errors = running.communicate(timeout=300)
    assert running.returncode == 130
    assert errors.strip() == "stopping after this step; Ctrl-C once more stops at once"
    assert said.splitlines()[-1].endswith(f"go on with: python -m agents train --resume {out}")
    assert not RunFolder(out).checkpoints.empty
    RunFolder(out).checkpoints.latest()


@pytest.mark.slow
def test_full_disk_leaves_the_last_checkpoint(tmp_path):
    resource = pytest.importorskip("resource")
    path, out = config_file(tmp_path, "sac"), tmp_path / "run"
    assert train("--config", path, "--out", out, "--set", "n_timesteps=64") == 0
    kept = RunFolder(out).checkpoints.latest()
    # No file may be longer than 4 kB: the model is.
    limit = lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (4096, 4096))  # noqa: E731
    running = process("--resume", out, "--set", "n_timesteps=128", preexec_fn=limit)
    _, errors = running.communicate(timeout=300)
    assert running.returncode == 2
    assert errors.startswith("error: ") and errors.count("\n") == 1
    assert "File too large" in errors and f"go on with --resume {out}" in errors
    assert RunFolder(out).checkpoints.latest() == kept
    assert train("--resume", out, "--set", "n_timesteps=128") == 0


@pytest.mark.parametrize("file", ["model.zip", "statistics.npz", "replay.npz", "state.json", "random.npz"])
def test_corrupt_files_are_named(file, tmp_path, capsys):
    path, out = config_file(tmp_path, "sac"), tmp_path / "run"
    assert train("--config", path, "--out", out) == 0
    latest = RunFolder(out).checkpoints.latest()
    content = (latest / file).read_bytes()
    (latest / file).write_bytes(content[: len(content) // 2])
    capsys.readouterr()
    assert train("--resume", out) == 2
    said = capsys.readouterr().err
    assert (
        f"{file} is cut off or was changed" in said and said.count("\n") == 1 and "To go on from the one before" in said
    )
    # What the sentence advises works.
    older = said.rpartition("write ")[2].split()[0]
    (out / "checkpoints" / "latest").write_text(older)
    assert train("--resume", out) == 0


def test_loaders_name_files_that_pass_the_hash_but_do_not_fit(tmp_path):
    from agents.training.files.model_state import load_state
    from agents.training.learners.algorithms import build
    from agents.training.settings.config import Config
    from agents.training.worlds import wrapped
    from dms_core.errors import InputError

    path, out = config_file(tmp_path, "sac"), tmp_path / "run"
    assert train("--config", path, "--out", out) == 0
    latest = RunFolder(out).checkpoints.latest()
    for changes, file in (
        (["policy_kwargs.net_arch=[5]"], "model.zip"),
        (["buffer_size=20"], "replay.npz"),
        (["frame_stack=1"], "model.zip"),
    ):
        config = Config.read(path, changes)
        with pytest.raises(InputError, match=file):
            load_state(build(config, wrapped(config, 0), 0), latest)


@pytest.mark.parametrize(
    "said, arguments",
    [
        ("--config FILE or --resume DIR", []),
        ("cannot be read", ["--config", "nowhere.yml"]),
        ("is not the folder of a training", ["--resume", "nowhere"]),
        ("leave out --config", ["--config", "{config}", "--resume", "x"]),
        ("seed = -1", ["--config", "{config}", "--seed", "-1"]),
        ("ppo.yml' is a file: expected a new or empty folder", ["--config", "{config}", "--out", "{config}"]),
        ("ppo.yml: unknown population 'martians'", ["--config", "{config}", "--set", "env_kwargs.patient=martians"]),
        ("ppo.yml: setting 'wings' is unknown; there are action_mode", ["--config", "{config}", "--set", "env_kwargs.wings=2"]),  # noqa: E501
        ("ppo refuses its arguments", ["--config", "{config}", "--set", "n_steps=1", "n_envs=1"]),
    ],
)  # fmt: skip
def test_mistakes_are_one_message(said, arguments, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    path = config_file(tmp_path)
    assert train(*(a.format(config=path) for a in arguments)) == 2
    errors = capsys.readouterr().err
    assert said in errors and errors.startswith("error: ") and errors.count("\n") == 1


def test_what_is_ahead_is_said_where_it_is_not_what_was_asked_for(tmp_path, capsys):
    """Rounds have 2 times 16 steps."""
    path, out = config_file(tmp_path), tmp_path / "run"
    assert train("--config", path, "--out", out, "--set", "n_timesteps=40") == 0
    printed = capsys.readouterr().out
    assert "the training ends after 64 steps, not 40" in printed and "64 steps in" in printed
    assert train("--resume", out) == 0
    assert "already complete: 64 of 40 steps" in capsys.readouterr().out
    assert train("--resume", out, "--set", "n_timesteps=96") == 0
    printed = capsys.readouterr().out
    assert "going on after 64 steps" in printed and "whole rounds" not in printed and "96 steps in" in printed


def test_missing_packages_are_named(monkeypatch, tmp_path, capsys):
    monkeypatch.setitem(sys.modules, "sb3_contrib", None)
    assert train("--config", config_file(tmp_path)) == 2
    wanted = 'training needs sb3_contrib. Install the extra "train"; in a checkout: pip install -c constraints.txt'
    assert wanted in capsys.readouterr().err


def test_a_start_killed_before_its_record_is_begun_again(tmp_path):
    path, out = config_file(tmp_path), tmp_path / "run"
    out.mkdir()
    (out / "config.yml").write_text("half a f")
    assert train("--config", path, "--out", out, "--set", "n_timesteps=32") == 0


def test_an_unfinished_checkpoint_is_never_taken(tmp_path):
    from agents.checkpoint import Store

    def fail(part):
        (part / "half").write_text("x")
        raise OSError(28, "No space left on device")

    store = Store(tmp_path / "checkpoints")
    first = store.save("a", lambda part: (part / "whole").write_text("1"))
    with pytest.raises(OSError, match="No space left"):
        store.save("b", fail)
    assert store.latest() == first and [p.name for p in store.folder.iterdir() if p.is_dir()] == ["a"]
    # A run that goes on from an older checkpoint comes by the same name again; the old one is whole until then.
    again = store.save("a", lambda part: (part / "whole").write_text("2"))
    assert store.latest() == again and (again / "whole").read_text() == "2"


def test_a_folder_in_use_is_refused(tmp_path, capsys):
    path, out = config_file(tmp_path), tmp_path / "run"
    assert train("--config", path, "--out", out, "--set", "n_timesteps=32") == 0
    assert train("--config", path, "--out", out) == 2
    assert f"go on with --resume {out}" in capsys.readouterr().err
    with RunFolder(out).locked():
        assert train("--resume", out) == 2
    assert "another process is training" in capsys.readouterr().err


def test_networks_that_diverge_are_one_sentence(tmp_path, capsys):
    path, out = config_file(tmp_path), tmp_path / "run"
    arguments = ["--config", path, "--out", out, "--set", "learning_rate=1e30", "n_timesteps=512", "max_grad_norm=1e30"]
    assert train(*arguments) == 2
    errors = capsys.readouterr().err
    assert "the networks have diverged" in errors and errors.count("\n") == 1


def test_train_runs_share_no_environment_seeds():
    from agents.training.run import mixed

    firsts = [mixed(seed, steps) for seed in range(50) for steps in (0, 4096, 8192)]
    streams = {s + k for s in firsts for k in range(16)}
    assert len(streams) == 16 * len(firsts)
    assert max(firsts) + 16 < 2**32 and os.cpu_count()


@pytest.mark.parametrize("place", ["config.yml", "run.json", "tensorboard", "state.json", "latest", "evaluations.json"])
def test_a_full_disk_is_one_sentence_wherever_it_comes(place, tmp_path, capsys, monkeypatch):
    """Each write of a training fails once, from the first on."""
    import agents.training.run
    from dms_core.files import output_place

    full, known = OSError(errno.ENOSPC, os.strerror(errno.ENOSPC)), output_place._replace

    def replace(target, content):
        if target.name == place:
            raise full
        known(target, content)

    def configure(folder, *given):
        raise full

    monkeypatch.setattr(output_place, "_replace", replace)
    if place == "tensorboard":
        monkeypatch.setattr(agents.training.run, "configure", configure)
    out = tmp_path / "run"
    assert train("--config", config_file(tmp_path), "--out", out, "--set", "n_timesteps=64") in (1, 2)
    said = [line for line in capsys.readouterr().err.splitlines() if line.startswith("error: ")]
    assert len(said) == 1 and "No space left on device" in said[0] and "free some space" in said[0]
    assert not [p for p in out.rglob("*") if p.name.startswith(".") and p.name != ".lock"]
