"""Training configurations: rl_zoo3's format, nothing evaluated, every mistake named."""

import math
import sys
from argparse import Namespace
from pathlib import Path

import pytest
import yaml

from agents.environment import ENVIRONMENT, check_settings
from agents.training.settings.config import Config
from agents.training.settings.rl_zoo_text import read_call, write_call
from dms_core.errors import InputError
from dms_core.files.config_files import configs
from dms_core.files.yaml_text import yaml_of
from tests.agents.tiny import config_file, content

SHIPPED = sorted((configs() / "agents").rglob("*.yml"))


def refused(said, algorithm="ppo", overrides=(), **changes):
    pytest.importorskip("stable_baselines3")
    from agents.training.learners.algorithms import arguments

    with pytest.raises(InputError) as caught:
        arguments(Config.of(content(algorithm, **changes), algorithm, overrides))
    assert said in str(caught.value) and "\n" not in str(caught.value)


@pytest.mark.parametrize("path", SHIPPED, ids=lambda p: str(p.relative_to(configs())))
def test_shipped_files_are_accepted(path):
    pytest.importorskip("sb3_contrib")
    from agents.training.learners.algorithms import arguments

    config = Config.read(path)
    assert set(config.arguments) == set(arguments(config))
    check_settings(config.environment, config.env_kwargs)


def test_there_is_a_file_for_every_algorithm():
    pytest.importorskip("sb3_contrib")
    from agents.training.learners.algorithms import ALGORITHMS

    assert {Config.read(p).training.algorithm for p in SHIPPED} == set(ALGORITHMS)


@pytest.mark.parametrize("path", SHIPPED, ids=lambda p: str(p.relative_to(configs())))
def test_rl_zoo3_reads_the_same_values(path):
    # rl_zoo3 reads by PyYAML, in which 1e-4 is text; the environment's section has to be the same for both readers.
    config = Config.read(path)
    section = yaml.safe_load(path.read_text())[config.environment]
    for key in ("policy_kwargs", "normalize"):
        if isinstance(section.get(key), str):
            section[key] = read_call(section[key])
    del section["env_wrapper"]
    assert section == config.section


@pytest.mark.parametrize("path", SHIPPED, ids=lambda p: str(p.relative_to(configs())))
def test_rl_zoo3_takes_them(path, tmp_path):
    zoo = pytest.importorskip("rl_zoo3.exp_manager")
    import exo_env  # noqa: F401

    config = Config.read(path)
    algorithm = config.training.algorithm
    if algorithm == "dagger":
        pytest.skip("rl_zoo3 has no imitation")
    name = {"recurrent_ppo": "ppo_lstm"}.get(algorithm, algorithm)
    manager = zoo.ExperimentManager(
        Namespace(), name, config.environment, str(tmp_path), config=str(path), verbose=0, device="cpu"
    )
    model, _ = manager.setup_experiment()
    assert model.get_env().num_envs == config.n_envs
    assert model.get_vec_normalize_env() is not None
    model.get_env().close()


def test_what_is_kept_of_a_run_is_read_back(tmp_path):
    first = Config.read(config_file(tmp_path), ["policy_kwargs.net_arch=[4]", "training.eval_every=7", "gamma=9.5e-1"])
    path = tmp_path / "kept.yml"
    path.write_text(yaml.safe_dump(first.content()))
    again = Config.read(path)
    assert again.content() == first.content()
    assert again.arguments["policy_kwargs"] == {"net_arch": [4], "activation_fn": "nn.Tanh"}
    assert again.training.eval_every == 7 and again.training.algorithm == "ppo" and again.normalize == {"gamma": 0.95}


def test_text_of_mappings_goes_there_and_back():
    text = "dict(net_arch=dict(pi=[64, 64], vf=[32]), activation_fn=th.nn.ReLU, log_std_init=-2, ortho_init=False)"
    found = read_call(text)
    assert found["net_arch"] == {"pi": [64, 64], "vf": [32]} and found["log_std_init"] == -2
    assert read_call(write_call(found)) == found


@pytest.mark.parametrize(
    "text",
    ["__import__('os').system('true')", "dict(a=open('x'))", "dict(a=[x for x in (1,)])", "dict(**{'a': 1})", "[1, 2]",
     "dict(a=(lambda: 1)())", "dict(a=1).values()", "dict(", "{1: 2}", "dict(a=f'{1}')"],
)  # fmt: skip
def test_code_is_never_run(text):
    with pytest.raises(InputError, match="dict\\(key=value"):
        read_call(text)


@pytest.mark.parametrize(
    "said, changes",
    [
        ("ppo: unknown key 'learning_rat'. Allowed: batch_size", {"learning_rat": 1e-3}),
        ("ppo: n_steps = 1.5: expected a whole number", {"n_steps": 1.5}),
        ("ppo: gamma = True: expected a number", {"gamma": True}),
        ("ppo: learning_rate = 'slow': expected a number or text like lin_3e-4", {"learning_rate": "slow"}),
        ("ppo: clip_range = 'lin_-1'", {"clip_range": "lin_-1"}),
        ("ppo: policy_kwargs: unknown key 'width'", {"policy_kwargs": "dict(width=3)"}),
        (
            "ppo: policy_kwargs: net_arch = 'big': expected a list of a whole number",
            {"policy_kwargs": {"net_arch": "big"}},
        ),
        ("activation_fn = 'os.system': expected one of elu", {"policy_kwargs": "dict(activation_fn=os.system)"}),
        ("policy = 'CnnPolicy'; ppo takes MlpPolicy", {"policy": "CnnPolicy"}),
        ("n_envs = 0: expected a whole number from 1", {"n_envs": 0}),
        ("n_timesteps = '1e6'", {"n_timesteps": "1e6"}),
        ("n_timesteps = inf: expected a whole number from 1", {"n_timesteps": math.inf}),
        ("n_envs = nan: expected a whole number from 1", {"n_envs": math.nan}),
        ("normalize: unknown key 'norm'", {"normalize": {"norm": True}}),
        ("normalize: clip_obs = -1: expected a positive number", {"normalize": {"clip_obs": -1}}),
        ("env_kwargs = 3: expected a mapping", {"env_kwargs": 3}),
        ("env_wrapper = 'a.b': expected none, or exo_env.envs", {"env_wrapper": "a.b"}),
        ("ppo: gamma = 1.5: expected a number from 0 to 1", {"gamma": 1.5}),
        ("ppo: gae_lambda = -0.1: expected a number from 0 to 1", {"gae_lambda": -0.1}),
        ("ppo: gamma = nan: expected a number from 0 to 1", {"gamma": float("nan")}),
        ("ppo: learning_rate = -1: expected a positive number", {"learning_rate": -1}),
        ("ppo: learning_rate = 'lin_0.0': expected a positive number", {"learning_rate": "lin_0.0"}),
        ("ppo: learning_rate = 'lin_1.2.3': expected a number or text like lin_3e-4", {"learning_rate": "lin_1.2.3"}),
        ("ppo: clip_range = 0: expected a positive number", {"clip_range": 0}),
    ],
)
def test_mistakes_are_named(said, changes):
    refused(said, **changes)


@pytest.mark.parametrize(
    "key", ["n_timesteps", "n_envs", "env_kwargs", "normalize", "policy", "frame_stack", "n_steps"]
)
def test_every_key_is_among_those_allowed(key):
    refused(f" {key},", overrides=["n_timestep=3"])


@pytest.mark.parametrize("gamma", [0, 0.0, 1, 1.0])
def test_ends_of_a_range_belong_to_it(gamma):
    pytest.importorskip("stable_baselines3")
    from agents.training.learners.algorithms import arguments

    assert arguments(Config.of(content(gamma=gamma), "ppo"))["gamma"] == gamma


@pytest.mark.parametrize(
    "said, override",
    [
        ("--set n_steps: expected key=value", "n_steps"),
        ("--set n_steps.a=1: 'n_steps' is not a mapping", "n_steps.a=1"),
        ("--set n_steps: value '[1' is not valid YAML", "n_steps=[1"),
        ("unknown key 'eval'", "training.eval=1"),
        ("unknown algorithm 'dqn'. There are: dagger, ppo, recurrent_ppo, sac, tqc", "training.algorithm=dqn"),
    ],
)
def test_mistakes_of_overrides_are_named(said, override):
    refused(said, overrides=[override])


@pytest.mark.parametrize("value", [".inf", "-.inf", ".nan", "1e400", "1e31", "'1'", "true", "9" * 300, "[1]", "{a: 1}"])
@pytest.mark.parametrize(
    "key",
    ["n_timesteps", "n_envs", "frame_stack", "n_steps", "batch_size", "n_epochs", "gamma", "gae_lambda",
     "learning_rate", "clip_range", "ent_coef", "vf_coef", "max_grad_norm", "target_kl", "policy_kwargs.log_std_init",
     "policy_kwargs.net_arch", "normalize.clip_obs", "normalize.epsilon", "training.eval_every", "training.save_every",
     "training.eval_patients", "training.eval_seed", "training.threads", "training.hold"],
)  # fmt: skip
def test_numbers_that_are_none_are_refused_by_key(key, value):
    if key.startswith("normalize") and not set(value) - set("1e319"):
        pytest.skip("a limit that is never reached")
    if (key, value) == ("policy_kwargs.net_arch", "[1]"):
        pytest.skip("a network of one unit")
    refused(f"{key.rpartition('.')[2]}", overrides=[f"{key}={value}"], normalize={"norm_obs": True})


@pytest.mark.parametrize(
    ("said", "override"),
    [
        ("n_timesteps = inf: expected a whole number from 1 to 1e+12", "n_timesteps=1e400"),
        ("n_envs = nan: expected a whole number from 1 to 10000", "n_envs=.nan"),
        ("ppo: n_steps = 0: expected numbers from 1 to 1e+09", "n_steps=0"),
        ("net_arch = [0]: expected numbers from 1 to 10000", "policy_kwargs.net_arch=[0]"),
        ("ppo: max_grad_norm = inf: expected numbers from -1e+30 to 1e+30", "max_grad_norm=.inf"),
        ("normalize: clip_obs = inf: expected a positive number", "normalize.clip_obs=.inf"),
        ("Training: eval_every = inf: Expected a finite number", "training.eval_every=.inf"),
        ("Training: traces.0 = nan: Expected a finite number", "training.traces=[.nan]"),
        ("the key 'a' stands twice", "policy_kwargs=dict(a=1, a=2)"),
        ("is not plain", "policy_kwargs=dict(a=1j)"),
        ("--set gamma: value '&a [*a]'", "gamma=&a [*a]"),
    ],
)
def test_what_is_allowed_is_said(said, override):
    refused(said, overrides=[override], normalize={"norm_obs": True})


@pytest.mark.parametrize(
    ("said", "changes"),
    [
        ("sac: ent_coef = 'auto_x': expected a number or auto", {"ent_coef": "auto_x"}),
        ("sac: target_entropy = '1': expected a number or auto", {"target_entropy": "1"}),
        ("sac: buffer_size = 0: expected numbers from 1 to 1e+09", {"buffer_size": 0}),
    ],
)
def test_texts_in_place_of_numbers_are_checked(said, changes):
    refused(said, "sac", **changes)


def test_a_key_is_set_once():
    refused("--set gamma=0.9: 'gamma' stands 2 times; expected once", overrides=["gamma=0.9", "gamma=0.8"])


@pytest.mark.parametrize("text", ["1e5", "010", "1:30", "1_000", "yes", "0o10", "2020-01-01"])
def test_a_file_holds_what_rl_zoo3_reads_alike(text, tmp_path):
    path = config_file(tmp_path)
    path.write_text(path.read_text().replace("n_timesteps: 128", f"n_timesteps: {text}"))
    with pytest.raises(InputError, match=f"ppo.yml', line [0-9]+, column 16: {text} is .* in YAML 1.1.* in YAML 1.2"):
        Config.read(path)


def test_a_value_of_set_is_read_as_yaml_1_2_and_kept_for_both(tmp_path):
    used = Config.read(config_file(tmp_path), ["n_timesteps=1e5", "n_steps=010", "env_kwargs.patient='1e5'"])
    assert (used.n_timesteps, used.arguments["n_steps"]) == (100_000, 10)
    kept = tmp_path / "kept.yml"
    kept.write_text(yaml_of(used.content()))
    assert Config.read(kept).content() == used.content()
    assert yaml.safe_load(kept.read_text())[ENVIRONMENT]["env_kwargs"]["patient"] == "1e5"


@pytest.mark.parametrize(
    "text", ["(" * 1500, "dict(a=" + "-" * 1500 + "1)", "dict(a=" + "[" * 150, "dict(a='" + "x" * 9000]
)
def test_hostile_text_of_a_call_is_refused_briefly(text):
    with pytest.raises(InputError, match="expected dict") as caught:
        read_call(text)
    assert len(str(caught.value)) < 400


def test_another_environment_is_refused(tmp_path):
    path = tmp_path / "ppo.yml"
    path.write_text("exo/ElbowLift-v7: {n_timesteps: 10}\n")
    with pytest.raises(
        InputError, match="ppo.yml: the configuration is for exo/ElbowLift-v7; here there is exo/ElbowL"
    ):
        Config.read(path)


def test_nothing_heavy_is_imported_by_the_command_line():
    import subprocess

    heavy = ("torch", "ray", "matplotlib", "onnx", "scipy.stats", "scipy.signal")
    code = f"import sys, agents.__main__; print([m for m in {heavy} if m in sys.modules])"
    said = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=Path(__file__).parents[3])
    assert said.stdout.strip() == "[]", said.stderr


@pytest.mark.parametrize(
    ("device", "there", "said"),
    [
        ("cuda", 0, "training.device = 'cuda': PyTorch sees 0 CUDA devices"),
        ("cuda:1", 1, "training.device = 'cuda:1': PyTorch sees 1 CUDA devices"),
        ("cuda:0", 1, None),
        ("cpu", 0, None),
        ("auto", 0, None),
    ],
)
def test_a_device_that_is_not_there_is_refused_before_training(monkeypatch, device, there, said):
    torch = pytest.importorskip("torch")
    from agents.training.usable import checked_config

    monkeypatch.setattr(torch.cuda, "device_count", lambda: there)
    path = SHIPPED[0]
    if said is None:
        assert checked_config(path, (f"training.device={device}",)).training.device == device
    else:
        with pytest.raises(InputError, match=said):
            checked_config(path, (f"training.device={device}",))
