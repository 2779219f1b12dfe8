"""The action that a training begins at."""

import numpy as np
import pytest

pytest.importorskip("sb3_contrib")

from agents.training.learners.algorithms import SQUASHED, arguments, build
from agents.training.settings.config import Config
from agents.training.settings.rl_zoo_text import read_call
from agents.training.worlds import wrapped
from dms_core.errors import InputError
from tests.agents.tiny import SECTIONS, content


@pytest.mark.parametrize("algorithm", ["ppo", "sac", "tqc", "recurrent_ppo"])
def test_an_untrained_policy_acts_where_it_is_told_to_begin(algorithm):
    """Off by a hundredth of what the last layer's own weights say, and with the noise that was asked for."""
    given = SECTIONS[algorithm]["policy_kwargs"]
    kwargs = {**(given if isinstance(given, dict) else read_call(given)), "log_std_init": -2.8}
    config = Config.of(content(algorithm, training={"start": [-0.3, 0.6]}, policy_kwargs=kwargs), algorithm)
    worlds = wrapped(config, 0)
    model = build(config, worlds, 0)
    seen = worlds.reset()
    best = model.predict(seen, deterministic=True)[0]
    assert np.abs(best - (-0.3, 0.6)).max() < 0.03
    drawn = np.stack([model.predict(seen, deterministic=False)[0] for _ in range(400)])
    free = np.arctanh(drawn) if algorithm in SQUASHED else drawn
    # Of 800 draws a deviation is known to 2.5 %; four times that.
    assert free.std(axis=(0, 1)) == pytest.approx(np.exp(-2.8), rel=0.1)
    worlds.close()


@pytest.mark.parametrize("algorithm", ["ppo", "recurrent_ppo"])
def test_weights_that_are_not_small_are_made_so(algorithm):
    given = {**read_call(SECTIONS[algorithm]["policy_kwargs"]), "ortho_init": False}
    config = Config.of(content(algorithm, training={"start": [-0.3, 0.6]}, policy_kwargs=given), algorithm)
    worlds = wrapped(config, 0)
    best = build(config, worlds, 0).predict(worlds.reset(), deterministic=True)[0]
    assert np.abs(best - (-0.3, 0.6)).max() < 0.03
    worlds.close()


@pytest.mark.parametrize("algorithm", SQUASHED)
def test_critics_are_left_as_they_are(algorithm):
    weights = []
    for training in ({}, {"start": [-0.3, 0.6]}):
        config = Config.of(content(algorithm, training=training), algorithm)
        worlds = wrapped(config, 0)
        policy = build(config, worlds, 0).policy
        weights.append({k: v.numpy().copy() for k, v in policy.state_dict().items() if k.startswith("critic")})
        worlds.close()
    assert weights[0] and all(np.array_equal(weights[0][k], weights[1][k]) for k in weights[0])


@pytest.mark.parametrize("algorithm", SQUASHED)
@pytest.mark.parametrize("component", [1.0, -0.99999999])
def test_a_start_that_a_squashed_output_hardly_reaches_is_refused(algorithm, component):
    config = Config.of(content(algorithm, training={"start": [0.0, component]}), algorithm)
    with pytest.raises(InputError, match=rf"start = .*; {algorithm} takes from -0.99 to 0.99"):
        arguments(config)


@pytest.mark.parametrize("algorithm", SQUASHED)
def test_noise_that_would_do_nothing_is_refused(algorithm):
    config = Config.of(content(algorithm, policy_kwargs={"log_std_init": -2.0}), algorithm)
    with pytest.raises(InputError, match="log_std_init does nothing without training.start"):
        arguments(config)
