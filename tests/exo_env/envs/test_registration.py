"""What Gymnasium passes, the environment takes: registrations of one's own, and the ways to make one."""

import warnings

import gymnasium
import numpy as np
import pytest
from gymnasium.envs.registration import WrapperSpec
from gymnasium.utils.env_checker import check_env
from gymnasium.wrappers import RescaleObservation, TimeAwareObservation

from exo_env.envs.elbow_lift import ElbowLiftEnv, ElbowLiftVectorEnv

PLACES = {"classes": (ElbowLiftEnv, ElbowLiftVectorEnv)}
PLACES["words"] = tuple(f"exo_env.envs.elbow_lift:{kind.__name__}" for kind in PLACES["classes"])


class Passing(gymnasium.Wrapper):
    """A wrapper that does nothing."""


@pytest.fixture
def registered():
    """Register an environment of ours under an id of one's own, for a test."""
    name = "mine/Lift-v3"

    def register(places="classes", **spec):
        single, vector = PLACES[places]
        gymnasium.register(id=name, entry_point=single, vector_entry_point=vector, **spec)
        return name

    yield register
    gymnasium.registry.pop(name, None)


def ends(made, most=40):
    """Number of steps after which time ends an episode."""
    made.reset(seed=0)
    action = np.zeros(made.action_space.shape, np.float32)
    for k in range(1, most):
        if np.all(made.step(action)[3]):
            made.close()
            return k
    raise AssertionError(f"no end in {most} steps")


@pytest.mark.parametrize("places", list(PLACES))
@pytest.mark.parametrize("mode", [None, "vector_entry_point", "sync", "async"])
def test_a_registration_with_everything(registered, places, mode):
    name = registered(
        places, max_episode_steps=6, reward_threshold=300.0, order_enforce=True, nondeterministic=False,
        disable_env_checker=False, kwargs={"load": 1.0, "control_rate": 25.0},
    )  # fmt: skip
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert ends(gymnasium.make(name)) == 6
        assert ends(gymnasium.make(name, max_episode_steps=4)) == 4
        assert ends(gymnasium.make(name, max_episode_steps=-1, episode_duration=0.4)) == 10
        assert ends(gymnasium.make_vec(name, num_envs=2, vectorization_mode=mode)) == 6
        assert ends(gymnasium.make_vec(name, num_envs=2, vectorization_mode=mode, max_episode_steps=4)) == 4
        assert ends(gymnasium.make_vec(name, 2, mode, load=2.0, episode_duration=0.2)) == 5
        made = gymnasium.make_vec(name, num_envs=3, vectorization_mode=mode, load=2.0)
    assert made.spec.kwargs["load"] == 2.0 and made.spec.kwargs["control_rate"] == 25.0
    again = gymnasium.make_vec(made.spec)
    assert again.num_envs == 3 and ends(again) == 6
    made.close()


@pytest.mark.parametrize("mode", ["sync", "async"])
def test_wrappers_and_settings_of_gymnasiums_vectors(registered, mode):
    name = registered(max_episode_steps=5, additional_wrappers=(WrapperSpec("Passing", f"{__name__}:Passing", {}),))
    made = gymnasium.make_vec(
        name, num_envs=2, vectorization_mode=mode, wrappers=(TimeAwareObservation,),
        vector_kwargs={"autoreset_mode": gymnasium.vector.AutoresetMode.SAME_STEP},
    )  # fmt: skip
    assert made.single_observation_space.shape == (13,)
    assert ends(made) == 5


@pytest.mark.parametrize("given", [{"wrappers": (Passing,)}, {"vector_kwargs": {"copy": False}}])
def test_what_gymnasium_itself_refuses_for_a_batch(given):
    with pytest.raises(gymnasium.error.Error):
        gymnasium.make_vec("exo/ElbowLift-v2", **given)


def test_modes_of_a_batch_by_keyword():
    made = gymnasium.make_vec("exo/ElbowLift-v2", 2, autoreset_mode="SameStep", threads=1, max_episode_steps=3)
    assert made.metadata["autoreset_mode"] is gymnasium.vector.AutoresetMode.SAME_STEP
    assert ends(made) == 3


@pytest.mark.parametrize("mode", list(ElbowLiftEnv.drives))
def test_the_checkers_are_silent(registered, mode):
    name = registered(max_episode_steps=20, kwargs={"action_mode": mode})
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        env = gymnasium.make(name, disable_env_checker=False, render_mode="rgb_array")
        check_env(env.unwrapped)
        assert ends(env) == 20


def test_a_wrapper_made_from_a_spec():
    env = RescaleObservation(gymnasium.make("exo/ElbowLift-v2", load=1.0), np.float32(-1.0), np.float32(1.0))
    again = gymnasium.make(env.spec)
    np.testing.assert_array_equal(again.reset(seed=0)[0], env.reset(seed=0)[0])


def test_attributes_and_calls_of_all_worlds():
    made = gymnasium.make_vec("exo/ElbowLift-v2", num_envs=3, threads=1)
    made.reset(seed=7)
    worlds = made.unwrapped
    assert worlds.get_attr("action_mode") == ("rope_tension",) * 3
    assert worlds.call("summary") == tuple(env.summary() for env in worlds.envs)
    assert worlds.call("readings")[1]["time"] == 0.0
    assert worlds.np_random_seed == (7, 8, 9) and worlds.np_random == tuple(env.np_random for env in worlds.envs)
    worlds.set_attr("note", ["a", "b", "c"])
    worlds.set_attr("mark", 3)
    assert worlds.get_attr("note") == ("a", "b", "c") and worlds.get_attr("mark") == (3, 3, 3)
    with pytest.raises(ValueError, match=r"set_attr\('note'\): 2 values for 3 worlds"):
        worlds.set_attr("note", ["a", "b"])
    with pytest.raises(ValueError, match="'load' cannot be set from outside"):
        worlds.set_attr("load", 2.0)
    with pytest.raises(AttributeError):
        worlds.get_attr("wings")
    made.close()
