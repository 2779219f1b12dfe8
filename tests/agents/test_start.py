"""The action that a training begins at."""

import numpy as np
import pytest

pytest.importorskip("sb3_contrib")

from agents.algorithms import arguments, build
from agents.call_text import read_call
from agents.config import Config
from agents.train import wrapped
from dms_core.errors import InputError
from tests.agents.tiny import SECTIONS, content


@pytest.mark.parametrize("algorithm", ["ppo", "sac", "tqc", "recurrent_ppo"])
def test_an_untrained_policy_acts_where_it_is_told_to_begin(algorithm):
    """Off by a hundredth of what the last layer's own weights say, and with the noise that was asked for."""
    given = SECTIONS[algorithm]["policy_kwargs"]
    kwargs = {**(given if isinstance(given, dict) else read_call(given)), "log_std_init": -2.8}
    config = Config.of(content(algorithm, training={"start": [-0.3, 0.9]}, policy_kwargs=kwargs), algorithm)
    worlds = wrapped(config, 0)
    model = build(config, worlds, 0)
    seen = worlds.reset()
    best = model.predict(seen, deterministic=True)[0]
    assert np.abs(best - (-0.3, 0.9)).max() < 0.03
    drawn = np.stack([model.predict(seen, deterministic=False)[0] for _ in range(400)])
    # Of 800 draws a deviation is known to 2.5 %; four times that.
    free = np.arctanh(np.clip(drawn, -0.999999, 0.999999)) if algorithm in ("sac", "tqc") else drawn
    assert free[..., 0].std() == pytest.approx(np.exp(-2.8), rel=0.1)
    worlds.close()


def test_a_start_that_a_squashed_output_cannot_reach_is_refused():
    config = Config.of(content("sac", training={"start": [0.0, 1.0]}), "sac")
    with pytest.raises(InputError, match="actions of sac never reach -1 or 1"):
        arguments(config)
