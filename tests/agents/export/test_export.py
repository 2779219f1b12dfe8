"""Exported policies: the same actions in PyTorch, NumPy and ONNX, no pickles, every damage named."""

import importlib.util
import io
import json
import pickle
import shutil
import sys

import numpy as np
import pytest

from agents.__main__ import main
from agents.environment import ENVIRONMENT, make
from agents.policies.learned import Description, LearnedPolicy, find_policy, world_facts
from agents.policies.network import ACTIVATIONS, Architecture, Network
from agents.policies.safetensors import from_bytes, to_bytes
from agents.training.files.run_folder import RunFolder
from agents.training.settings.config import Config
from dms_core.errors import DmsError, InputError
from tests.agents.tiny import config_file, content

PARITY = 1e-6
"""PyTorch computes in single precision, whose round-off is 6e-8 times sums of some ten terms."""


@pytest.fixture(scope="module")
def trained(tmp_path_factory):
    """Models trained a little, with their policies in numpy."""
    pytest.importorskip("sb3_contrib")
    from agents.evaluation.episodes.episode import judged
    from agents.training.run import TrainingRun

    found = {}

    def of(algorithm, **changes):
        key = (algorithm, repr(changes))
        if key not in found:
            folder = RunFolder(tmp_path_factory.mktemp(algorithm) / "run")
            config = Config.of(content(algorithm, {"eval_every": 10**6}, **changes), algorithm)
            folder.begin(config, 0)
            run = TrainingRun(folder, config, 0, lambda steps, evaluation: None, judged)
            run.run()
            found[key] = run
        return found[key]

    return of


CASES = [
    ("ppo", {}),
    ("ppo", {"frame_stack": 4, "policy_kwargs": {"net_arch": [], "activation_fn": "relu"}}),
    ("ppo", {"normalize": False, "policy_kwargs": {"net_arch": [9], "activation_fn": "leaky_relu"}}),
    ("sac", {}),
    ("tqc", {"policy_kwargs": {"net_arch": [8], "activation_fn": "silu"}}),
    ("recurrent_ppo", {}),
]


def shown(run, observations):
    """Actions of the model in PyTorch over an episode."""
    statistics, stack = run.model.get_vec_normalize_env(), run.config.frame_stack
    seen, state, actions = np.zeros(observations.shape[1] * stack, np.float32), None, []
    for k, observation in enumerate(observations):
        seen = np.concatenate([seen[observation.size :], observation])
        x = seen if statistics is None else statistics.normalize_obs(seen)
        action, state = run.model.predict(x, state=state, episode_start=np.array([k == 0]), deterministic=True)
        actions.append(action)
    return np.array(actions)


def observed(run, count=60):
    generator = np.random.default_rng(5)
    return generator.normal(0.5, 1.0, (count, run.curve.env.observation_space.shape[0])).astype(np.float32)


@pytest.mark.parametrize("algorithm, changes", CASES)
def test_numpy_acts_as_pytorch(algorithm, changes, trained):
    run = trained(algorithm, **changes)
    policy, observations = run.policy(), observed(run)
    wanted = shown(run, observations)
    for _ in range(2):  # The second episode shows that the first is forgotten.
        policy.network.reset()
        found = np.array([policy.network(o) for o in observations])
        assert np.abs(found - wanted).max() < PARITY
    assert np.ptp(wanted, axis=0).min() > 1e-3


@pytest.mark.parametrize("algorithm, changes", CASES)
def test_onnx_acts_as_numpy(algorithm, changes, trained, tmp_path):
    pytest.importorskip("onnx")
    runtime = pytest.importorskip("onnxruntime")
    from agents.export.onnx_file import write_onnx

    run = trained(algorithm, **changes)
    policy, observations, shape = run.policy(), observed(run), run.policy().description.architecture
    write_onnx(policy, tmp_path / "policy.onnx")
    session = runtime.InferenceSession(str(tmp_path / "policy.onnx"), providers=["CPUExecutionProvider"])
    states = {n: np.zeros((shape.lstm_layers, shape.lstm_width), np.float32) for n in ("hidden", "cell")}
    seen = np.zeros(shape.inputs, np.float32)
    for observation in observations:
        seen = np.concatenate([seen[observation.size :], observation])
        given = {"observation": seen[None]} | (states if shape.lstm_layers else {})
        action, *new = session.run(None, given)
        states = dict(zip(states, new, strict=False))
        # States and actions pass through single precision between two calls.
        assert np.abs(action[0] - policy.network(observation)).max() < PARITY


@pytest.mark.parametrize("name", ACTIVATIONS)
def test_activations_are_those_of_pytorch(name):
    torch = pytest.importorskip("torch")
    from agents.training.learners.algorithms import activation

    x = np.linspace(-30.0, 30.0, 201)
    # Both in double precision: round-off only.
    np.testing.assert_allclose(
        ACTIVATIONS[name](x), activation(name)()(torch.tensor(x)).numpy(), rtol=1e-12, atol=1e-15
    )


def test_safetensors_are_those_of_the_package(tmp_path):
    package = pytest.importorskip("safetensors.numpy")
    arrays = {"b": np.arange(6, dtype=np.float32).reshape(2, 3), "a": np.array([1.5, -2.0]), "c": np.zeros((0, 3))}
    theirs = package.load(to_bytes(arrays))
    mine = from_bytes(package.save({k: np.ascontiguousarray(v) for k, v in arrays.items()}), "x")
    for k, v in arrays.items():
        assert np.array_equal(theirs[k], v) and theirs[k].dtype == v.dtype
        assert np.array_equal(mine[k], v) and mine[k].dtype == v.dtype


def made(tmp_path, **changes):
    """A policy of random numbers, without PyTorch."""
    env = make(ENVIRONMENT, patient="stroke_mild")
    shape = Architecture(inputs=12, hidden=(5,), activation="tanh", output="clip", normalised=True)
    generator = np.random.default_rng(0)
    arrays = {k: generator.uniform(0.1, 1.0, s) for k, s in shape.shapes().items()}
    description = Description(
        title="made", algorithm="ppo", environment=ENVIRONMENT, exo_env="0", env_kwargs={}, steps=0,
        architecture=shape, **{**world_facts(env), **changes},
    )  # fmt: skip
    LearnedPolicy(description, arrays).save(tmp_path / "policy")
    return tmp_path / "policy", env


def test_folder_is_evaluated_like_a_baseline(tmp_path, capsys):
    pytest.importorskip("matplotlib")
    folder, _ = made(tmp_path)
    arguments = ["--policy", str(folder), "none", "--patients", "1", "--out", str(tmp_path / "out")]
    assert main(["evaluate", *arguments]) == 0
    found = json.loads((tmp_path / "out" / "evaluation.json").read_text())["policies"]
    assert list(found) == [str(folder), "none"] and found[str(folder)]["title"] == "made"


def test_evaluation_of_a_run_is_that_of_its_training(trained):
    # The best policy, on the patient that the training set aside, gives the return that the training wrote down.
    from agents.evaluation.episodes.episode import episode

    run = trained("ppo")
    policy = find_policy(str(run.folder.path))
    env = make(ENVIRONMENT, **run.config.env_kwargs)
    best = max(e["return"] for e in run.evaluations)
    assert episode(env, policy, run.curve.seeds[0])["measures"]["return"] == pytest.approx(best, rel=1e-12)


@pytest.mark.parametrize("algorithm", ["ppo", "recurrent_ppo"])
def test_command_exports_a_run(algorithm, trained, tmp_path, capsys):
    run, installed = trained(algorithm), importlib.util.find_spec("onnx") is not None
    for flags in ([], ["--last", "--no-onnx"]):
        out = tmp_path / ("last" if flags else "best")
        assert main(["export", str(run.folder.path), "--out", str(out), *flags]) == 0
        assert {"policy.json", "weights.safetensors"} <= {p.name for p in out.iterdir()}
        assert (out / "policy.onnx").exists() == (installed and not flags)
        text = b"".join(p.read_bytes() for p in out.iterdir())
        assert b"pickle" not in text and b"\x80\x04\x95" not in text
    assert np.array_equal(
        LearnedPolicy.load(tmp_path / "last").arrays["layer.0.weight"], run.policy().arrays["layer.0.weight"]
    )


def test_a_run_whose_best_policy_is_untrained_is_exported_with_a_warning(trained, tmp_path, capsys):
    run = trained("ppo", n_timesteps=32)
    shutil.copytree(run.folder.path, tmp_path / "run")
    folder, untrained = RunFolder(tmp_path / "run"), run.policy()
    untrained.description = untrained.description.model_copy(update={"steps": 0})
    folder.best.save("steps_again", untrained.save)
    for flags, warned in (([], True), (["--last"], False)):
        assert main(["export", str(folder.path), "--out", str(tmp_path / "out"), "--no-onnx", *flags]) == 0
        said = capsys.readouterr().err
        assert ("is the untrained one (0 steps); --last" in said) == warned


def test_a_run_without_checkpoint_is_named(tmp_path, capsys):
    folder = RunFolder(tmp_path / "run")
    folder.begin(Config.of(content(), "ppo"), 0)
    for arguments in (["export", str(folder.path)], ["evaluate", "--policy", str(folder.path)]):
        assert main([*arguments, "--out", str(tmp_path / "out")]) == 2
        said = capsys.readouterr().err
        assert "has not reached its first checkpoint" in said and said.count("\n") == 1


def test_what_lacks_a_package_says_how_to_install_it(tmp_path, capsys, monkeypatch):
    from agents.commands.pictures.video import _possible
    from agents.distributed.cluster import _started
    from agents.export.onnx_file import write_onnx

    folder, _ = made(tmp_path)
    for package in ("onnx", "ray", "imageio"):
        monkeypatch.setitem(sys.modules, package, None)
    for extra, start in (
        ("sweep", lambda: _started(None, 1)), ("pictures", lambda: _possible(tmp_path / "a.gif")),
        ("export", lambda: write_onnx(LearnedPolicy.load(folder), tmp_path / "policy.onnx")),
    ):  # fmt: skip
        with pytest.raises(DmsError) as caught:
            start()
        assert str(caught.value).endswith(f'pip install -c constraints.txt -e ".[{extra}]"')
    assert main(["export", str(folder), "--out", str(tmp_path / "out")]) == 0
    assert 'pip install -c constraints.txt -e ".[export]"\n' in capsys.readouterr().out


def test_zip_from_elsewhere_needs_trust(trained, tmp_path, capsys):
    run = trained("ppo")
    path, statistics = tmp_path / "model.zip", tmp_path / "vecnormalize.pkl"
    run.model.save(path)
    run.model.get_vec_normalize_env().save(str(statistics))
    arguments = ["export", str(path), "--out", str(tmp_path / "out"), "--statistics", str(statistics)]
    assert main(arguments) == 2
    assert "--trust" in capsys.readouterr().err and not (tmp_path / "out").exists()
    arguments += ["--trust"]
    assert main(arguments) == 2
    assert "Give the --action-mode that it was trained in" in capsys.readouterr().err
    arguments += ["--action-mode", "pid_setpoint"]
    assert main(arguments) == 0
    found = LearnedPolicy.load(tmp_path / "out")
    assert all(np.array_equal(found.arrays[k], v) for k, v in run.policy().arrays.items())
    assert found.description.action_mode == "pid_setpoint"
    for file in (path, statistics):
        whole = file.read_bytes()
        file.write_bytes(whole[: len(whole) // 2])
        assert main(arguments) == 2
        errors = capsys.readouterr().err
        assert f"'{file}' is no whole" in errors and errors.count("\n") == 1
        file.write_bytes(whole)


def test_runs_are_read_without_opening_a_pickle(trained, tmp_path, monkeypatch):
    # Whoever can change a run's files could put code into pickles; none is opened, by export or by going on.
    import cloudpickle

    run = trained("sac")
    shutil.copytree(run.folder.path, tmp_path / "run")

    def refuse(*_, **__):
        raise AssertionError("a pickle is read")

    for where, name in ((pickle, "load"), (pickle, "loads"), (cloudpickle, "load"), (cloudpickle, "loads")):
        monkeypatch.setattr(where, name, refuse)
    assert main(["export", str(tmp_path / "run"), "--out", str(tmp_path / "out")]) == 0
    assert main(["train", "--resume", str(tmp_path / "run"), "--set", "n_timesteps=110"]) == 0


@pytest.mark.parametrize(
    "said, change",
    [
        ("weights.safetensors is cut off or was changed", lambda f: _cut(f / "weights.safetensors")),
        ("is no JSON", lambda f: _cut(f / "policy.json")),
        ("weights.safetensors' cannot be read: No such file", lambda f: (f / "weights.safetensors").unlink()),
        ("trained in exo/ElbowLift-v9", lambda f: _edit(f, environment="exo/ElbowLift-v9")),
        ("unknown key 'wings'", lambda f: _edit(f, wings=2)),
        ("format = 3", lambda f: _edit(f, format=3)),
        ("policy.json was changed", lambda f: _edit(f, action_mode="rope_tension")),
        ("policy.json was changed", lambda f: _edit(f, env_kwargs={"repetitions": 7})),
        ("policy.json was changed", lambda f: _edit(f, period=0.04)),
        ("policy.json was changed", lambda f: _edit(f, steps=3)),
        ("policy.json was changed", lambda f: _edit(f, sha256=None)),
        ("'title' is missing", lambda f: _edit(f, title=None)),
    ],
)
def test_damage_is_named(said, change, tmp_path, capsys):
    folder, _ = made(tmp_path)
    change(folder)
    assert main(["evaluate", "--policy", str(folder), "--out", str(tmp_path / "out")]) == 2
    errors = capsys.readouterr().err
    assert said in errors and str(folder) in errors and errors.count("\n") == 1


def _cut(path):
    path.write_bytes(path.read_bytes()[:-40])


def _edit(folder, **changes):
    found = json.loads((folder / "policy.json").read_text()) | changes
    (folder / "policy.json").write_text(json.dumps({k: v for k, v in found.items() if v is not None}))


@pytest.mark.parametrize(
    "said, changes",
    [
        ("another control period", {"period": 0.01}),
        ("another drive", {"drive": {}}),
        ("another observ", {"structure": ()}),
    ],
)
def test_another_environment_is_refused_at_the_start(said, changes, tmp_path):
    folder, env = made(tmp_path, **changes)
    env.reset(seed=0)
    with pytest.raises(InputError, match=said):
        LearnedPolicy.load(folder).reset(env)


def test_weights_that_do_not_fit_are_named():
    shape = Architecture(inputs=3, hidden=(2,), activation="tanh", output="tanh", normalised=False)
    arrays = {k: np.ones(s) for k, s in shape.shapes().items()}
    for name, value, said in (
        ("layer.1.bias", None, "lack 'layer.1.bias'"), ("layer.0.weight", np.ones((3, 2)), "(3, 2): expected (2, 3)"),
        ("layer.0.bias", np.array([0.0, np.nan]), "not finite"),
    ):  # fmt: skip
        wrong = {k: v for k, v in (arrays | {name: value}).items() if v is not None}
        with pytest.raises(InputError) as caught:
            Network(shape, wrong)
        assert said in str(caught.value)


def test_unknown_policies_are_named(tmp_path):
    (tmp_path / "a").touch()
    for name, said in (
        ("nobody", "There are: adaptive_gravity"), (str(tmp_path), "no policy.json"),
        (str(tmp_path / "nope"), "there is no such folder"), (str(tmp_path / "a"), "is a file: expected the folder"),
    ):  # fmt: skip
        with pytest.raises(InputError, match=said):
            find_policy(name)
    with pytest.raises(InputError, match="neither"):
        main_export = __import__("agents.commands.training.export", fromlist=["export"]).export
        main_export(tmp_path, tmp_path / "out")


def test_numpy_needs_no_pytorch(tmp_path):
    import subprocess

    folder, _ = made(tmp_path)
    code = (
        "import sys; sys.modules['torch'] = None; from agents.policies.learned import find_policy; import numpy as np;"
        f"print(find_policy({str(folder)!r}).network(np.zeros(12)).shape)"
    )
    said = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert said.stdout.strip() == "(2,)", said.stderr


def test_safetensors_that_are_cut_off_are_named():
    content = to_bytes({"a": np.ones(3)})
    for part in (content[:4], content[:20], content[:-1], b"\xff" * 64, io.BytesIO().getvalue()):
        with pytest.raises(InputError, match="file 'x' holds no whole safetensors"):
            from_bytes(part, "x")


def test_configuration_file_is_what_tests_say(tmp_path):
    assert Config.read(config_file(tmp_path, "sac")).frame_stack == 3
