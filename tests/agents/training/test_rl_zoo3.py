"""The shipped files as rl_zoo3 reads them: what it evaluates in has the settings of what it trains in."""

import importlib

import gymnasium
import numpy as np
import pytest
import yaml

from agents.environment import ENVIRONMENT, make
from agents.training.settings.config import Config
from dms_core.errors import InputError
from dms_core.files.config_files import configs
from exo_env.envs.with_settings import WithSettings
from tests.agents.tiny import content

pytest.importorskip("stable_baselines3")

from stable_baselines3.common.env_util import make_vec_env
from stable_baselines3.common.evaluation import evaluate_policy

SHIPPED = sorted((configs() / "agents").rglob("*.yml"))


def zoo_worlds(section, evaluation, environment=ENVIRONMENT):
    """Worlds as rl_zoo3 2.9 makes them (exp_manager.py: create_envs; utils.py: get_wrapper_class).

    Those for training have the file's env_kwargs, those for evaluation what its command line says, here nothing. Its
    env_wrapper is put around both.
    """
    wrappers = section.get("env_wrapper", [])
    classes = []
    for entry in wrappers if isinstance(wrappers, list) else [wrappers]:
        name, kwargs = next(iter(entry.items())) if isinstance(entry, dict) else (entry, {})
        module, _, kind = name.rpartition(".")
        classes.append((getattr(importlib.import_module(module), kind), kwargs))

    def wrap(env):
        for kind, kwargs in classes:
            env = kind(env, **kwargs)
        return env

    spec = gymnasium.spec(environment)
    kwargs = {} if evaluation else dict(section["env_kwargs"])
    return make_vec_env(lambda **k: spec.make(**k), n_envs=1, seed=0, env_kwargs=kwargs, wrapper_class=wrap)


@pytest.mark.parametrize("path", SHIPPED, ids=lambda p: str(p.relative_to(configs())))
def test_training_and_evaluation_have_the_same_settings(path):
    environment = Config.read(path).environment
    section = yaml.safe_load(path.read_text())[environment]
    training, evaluation = (zoo_worlds(section, which, environment) for which in (False, True))
    ones = [worlds.envs[0].unwrapped for worlds in (training, evaluation)]
    wanted = section["env_kwargs"]
    for one in ones:
        assert {k: one.spec.kwargs[k] for k in wanted} == wanted and one.action_mode == wanted["action_mode"]
    kept = [{k: v for k, v in one.spec.kwargs.items() if k != "render_mode"} for one in ones]
    assert kept[0] == kept[1]
    np.testing.assert_array_equal(training.reset(), evaluation.reset())
    without = zoo_worlds({k: v for k, v in section.items() if k != "env_wrapper"}, True, environment)
    assert without.envs[0].unwrapped.spec.kwargs.keys().isdisjoint(wanted)
    for worlds in (training, evaluation, without):
        worlds.close()


def test_evaluation_of_sb3_counts_the_episodes_of_what_was_made():
    section = {"env_kwargs": {"action_mode": "pid_setpoint", "patient": "stroke_mild", "episode_duration": 0.4}}
    section["env_wrapper"] = {"exo_env.envs.with_settings.WithSettings": section["env_kwargs"]}
    worlds = zoo_worlds(section, True)

    class Full:
        def predict(self, observations, state=None, episode_start=None, deterministic=True):
            return np.array([[0.0, 1.0]]), None

    _, lengths = evaluate_policy(Full(), worlds, n_eval_episodes=2, return_episode_rewards=True, warn=True)
    assert lengths == [20, 20]
    worlds.close()


def test_an_environment_without_an_id_is_refused():
    env = make(ENVIRONMENT).unwrapped
    assert WithSettings(env, load=0.7).reset(seed=0)[1]["load"] == 0.7
    env.spec = None
    with pytest.raises(InputError, match="has no id to be made from"):
        WithSettings(env)


def test_the_wrapper_of_a_file_has_to_say_what_env_kwargs_say():
    name = "exo_env.envs.with_settings.WithSettings"
    settings = content()[ENVIRONMENT]["env_kwargs"]
    assert "env_wrapper" not in Config.of(content(env_wrapper={name: settings}), "ppo").section
    assert Config.of(content(env_wrapper=[{name: settings}]), "ppo").content()[ENVIRONMENT]["env_wrapper"] == {
        name: settings
    }
    with pytest.raises(InputError, match="other settings than env_kwargs"):
        Config.of(content(env_wrapper={name: {}}), "ppo")
    changed = Config.of(content(env_wrapper={name: settings}), "ppo", ["env_kwargs.patient=wide"])
    assert changed.content()[ENVIRONMENT]["env_wrapper"][name]["patient"] == "wide"
