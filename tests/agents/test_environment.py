"""Environments by id: an older version is taken as the newest, and every environment that is registered is made."""

import gymnasium
import numpy as np
import pytest
from gymnasium.envs.registration import register

from agents.environment import ENVIRONMENT, check_settings, environment_id, make, make_vector
from agents.policies.learned import find_policy
from agents.training.settings.config import Config
from dms_core.errors import InputError
from exo_env.envs import lookup
from tests.agents.other_environments import LIFT
from tests.agents.tiny import content

NEXT = "exo/ElbowLift-v9"


@pytest.fixture
def newer(monkeypatch):
    """The environment under its next version, as the only one."""
    lookup._say_once.cache_clear()
    register(
        id=NEXT, entry_point=LIFT.entry_point, vector_entry_point=LIFT.vector_entry_point, disable_env_checker=True
    )
    monkeypatch.delitem(gymnasium.registry, ENVIRONMENT)
    monkeypatch.setattr("agents.training.settings.config_file.ENVIRONMENT", NEXT)
    yield
    del gymnasium.registry[NEXT]
    lookup._say_once.cache_clear()


def test_the_default_is_registered():
    assert environment_id(ENVIRONMENT) == environment_id(f"exo_env:{ENVIRONMENT}") == ENVIRONMENT


def test_an_older_version_is_taken_as_the_newest_with_one_sentence(newer, capsys):
    assert environment_id(ENVIRONMENT) == environment_id(ENVIRONMENT) == NEXT
    assert capsys.readouterr().err == f"note: {ENVIRONMENT} is now {NEXT}, which is used in its place.\n"


def test_configurations_and_policies_of_an_older_version_are_taken(newer):
    config = Config.of(content(), "ppo")
    assert config.environment == NEXT and list(config.content()) == [NEXT, "training"]
    assert find_policy("learned").description.environment.startswith("exo/ElbowLift-v")


def test_a_section_of_the_very_version_comes_first(newer):
    both = {**content(n_envs=1), **{NEXT: content(n_envs=7)[ENVIRONMENT]}}
    assert Config.of(both, "ppo").n_envs == 7


@pytest.mark.parametrize(
    "name, said",
    [
        ("exo/ElbowLift-v77", "environment 'exo/ElbowLift-v77' is not registered. There are: exo/ElbowLift-v"),
        ("exo/Nothing-v0", "is not registered"),
        ("no such id", "is not registered"),
        ("nowhere_at_all:x/Y-v0", "module 'nowhere_at_all' cannot be imported"),
    ],
)
def test_what_is_not_there_is_named(name, said):
    with pytest.raises(InputError, match=said):
        environment_id(name)


def test_settings_of_the_registration_are_kept_and_replaced():
    for settings, load in (({}, 0.6), ({"load": 1.1}, 1.1)):
        env = make("tests/Light-v2", **settings)
        assert env.reset(seed=0)[1]["load"] == load
        worlds = make_vector("tests/Light-v2", 2, **settings)
        assert worlds.reset(seed=0)[1]["load"].tolist() == [load, load]
        worlds.close()
    # Versions of others are theirs: only one that is gone is replaced.
    assert environment_id("tests/Light-v1") == "tests/Light-v2"
    with pytest.raises(InputError, match="setting 'wings' is unknown"):
        check_settings("tests/Light-v2", {"wings": 2})


def test_a_batch_needs_a_vector_environment():
    with pytest.raises(InputError, match="'tests/NoReference-v0' has no vector environment"):
        make_vector("tests/NoReference-v0", 2)


def test_worlds_for_sb3_are_those_of_the_id():
    pytest.importorskip("stable_baselines3")
    from agents.environment import make_sb3_worlds

    worlds = make_sb3_worlds("tests/Light-v2", 2, episode_duration=0.2)
    single = make("tests/Light-v2", episode_duration=0.2)
    worlds.seed(3)
    np.testing.assert_array_equal(worlds.reset()[0], single.reset(seed=3)[0])
    for _ in range(10):
        _, _, over, infos = worlds.step(np.zeros((2, 2)))
    assert over.all() and all("terminal_observation" in info for info in infos)
    worlds.close()


def test_several_sections_are_chosen_by_the_id():
    section = content(n_envs=1)[ENVIRONMENT]
    both = {"tests/Light-v2": {**section, "n_envs": 5}, "tests/NoReference-v0": section, "atari": {}}
    with pytest.raises(InputError, match="say which with --env"):
        Config.of(both, "ppo")
    config = Config.of(both, "ppo", environment="tests/Light-v2")
    assert (config.environment, config.n_envs) == ("tests/Light-v2", 5)
    assert Config.of({"tests/Light-v2": section}, "ppo").environment == "tests/Light-v2"
    # No file brings about that a module is imported.
    with pytest.raises(InputError, match="the configuration is for this:that/It-v0"):
        Config.of({"this:that/It-v0": section}, "ppo")
