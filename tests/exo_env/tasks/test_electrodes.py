"""What electrodes show of activations."""

import numpy as np
import pytest

from dms_core.errors import InputError
from exo_env.envs.hidden_intent import HiddenIntentEnv
from exo_env.patient.distributions import Draws
from exo_env.tasks.observation.electrodes import FAULTS, Electrodes, electrode_draws, put_envelopes

ACTIVATIONS = np.array([0.6, 0.3, 0.0])


def drawn(gains=(1.0, 1.0, 1.0), new=(1.0, 1.0, 1.0), **faults):
    found = {"crosstalk": 0.0, "dropped": 99.0, "drop_begin": 0.0, "drop_length": 1.0, "renewed": 2.0} | faults
    return np.array([*(found[name] for name in FAULTS._fields), *gains, *new])


def shown(numbers, part=0.4):
    out = np.empty(3)
    put_envelopes(ACTIVATIONS, numbers, part, out)
    return out


def test_faultless_electrodes_show_activations():
    np.testing.assert_array_equal(shown(drawn()), ACTIVATIONS)


def test_gains_and_crosstalk():
    np.testing.assert_allclose(shown(drawn(gains=(0.5, 2.0, 1.0))), [0.3, 0.6, 0.0])
    # A fifth of the mean of the two others.
    np.testing.assert_allclose(shown(drawn(crosstalk=0.2)), [0.48 + 0.03, 0.24 + 0.06, 0.09])


def test_a_channel_drops_out_for_a_while():
    faults = drawn(dropped=1.7, drop_begin=0.3, drop_length=0.2)
    assert shown(faults, 0.29)[1] == 0.3 and shown(faults, 0.3)[1] == 0.0 and shown(faults, 0.51)[1] == 0.3
    assert shown(faults, 0.3)[0] == 0.6


def test_electrodes_put_on_anew_have_other_gains():
    faults = drawn(new=(2.0, 2.0, 2.0), renewed=0.5)
    np.testing.assert_allclose(shown(faults, 0.49), ACTIVATIONS)
    np.testing.assert_allclose(shown(faults, 0.5), 2.0 * ACTIVATIONS)


def test_what_is_drawn():
    muscles = ("a", "b", "c")
    draws = Draws({f"task.{k}": d for k, d in electrode_draws(muscles, {"uniform": [0.0, 10.0]}).items()})
    many = np.array([draws.sample(np.uint64(k)) for k in range(4000)])
    assert many.shape[1] == len(FAULTS) + 2 * len(muscles)
    gains = many[:, len(FAULTS) :]
    # A normal distribution cut off at -2.3 and 3.3 deviations has 0.97 of its deviation, here within 1 %.
    assert 0.285 < gains.std() < 0.3 and abs(gains.mean() - 1.0) < 0.02
    assert abs((many[:, FAULTS.dropped] < 3.0).mean() - 0.2) < 4.0 * np.sqrt(0.2 * 0.8 / 4000)
    assert abs((many[:, FAULTS.renewed] < 1.0).mean() - 0.1) < 4.0 * np.sqrt(0.1 * 0.9 / 4000)


def test_electrodes_may_be_worse():
    muscles, never = ("a", "b"), {"uniform": [1.0, 2.0]}
    worse = electrode_draws(muscles, never, Electrodes(gain_deviation=0.6, crosstalk=0.5, dropping=0.5))
    draws = Draws({f"task.{k}": d for k, d in worse.items()})
    many = np.array([draws.sample(np.uint64(k)) for k in range(4000)])
    # Cut off at -1.2 and 1.7 deviations a normal distribution has 0.72 of its deviation.
    assert 0.41 < many[:, len(FAULTS) :].std() < 0.45
    assert 0.49 < many[:, FAULTS.crosstalk].max() <= 0.5
    assert abs((many[:, FAULTS.dropped] < 2.0).mean() - 0.5) < 4.0 * np.sqrt(0.25 / 4000)
    assert electrode_draws(muscles, never) == electrode_draws(muscles, never, Electrodes())


@pytest.mark.parametrize(
    ("electrodes", "said"),
    [
        (3, "electrodes = 3: expected a mapping with some of crosstalk, dropping, gain_deviation"),
        ({"gain": 0.5}, "gain"),
        ({"crosstalk": 1.5}, "crosstalk"),
        ({"dropping": 0.0}, "dropping"),
        ({"gain_deviation": float("nan")}, "gain_deviation"),
    ],
)
def test_impossible_electrodes(electrodes, said):
    with pytest.raises(InputError, match=said):
        HiddenIntentEnv(electrodes=electrodes)


def test_the_environment_takes_them():
    env = HiddenIntentEnv(electrodes={"gain_deviation": 0.9})
    assert env.task.electrodes == Electrodes(gain_deviation=0.9)
    assert env.task.draws()["emg.crosstalk"] == HiddenIntentEnv().task.draws()["emg.crosstalk"]
    assert env.task.draws() != HiddenIntentEnv().task.draws()
