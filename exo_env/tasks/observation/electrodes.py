"""Surface electromyography as a worn device gets it: gain errors, crosstalk, drop-outs, electrodes put on anew.

    emg_i = g_i ((1 - x) a_i + x mean of the others' a)       0 while the channel has dropped out

with the activations a. Gains g_i are unknown to the device, since a maximum contraction cannot be asked of a weak arm;
from the time at which electrodes are put on anew there are others. All are drawn for an episode. Noise and delay are
the channel's (tasks/observation/noise.py).

Gains spread by 30 %: maximum voluntary amplitudes of one muscle vary by about that between sessions and electrode
places (assumed, after the coefficients of variation in Burden 2010, J. Electromyogr. Kinesiol. 20:1023-1035). Crosstalk
of up to a fifth, drop-outs in a fifth of the episodes and how often electrodes are put on anew are assumed.
"""

from __future__ import annotations

from collections.abc import Sequence

from pydantic import Field

from dms_core.compiled.jit import compiled
from exo_env.patient.distributions import Distribution, distribution
from exo_env.places import places
from exo_env.settings import Settings

FAULTS = places(("crosstalk", "dropped", "drop_begin", "drop_length", "renewed"))
"""Places of the first numbers: part of the others' signal; number of the channel that drops out, from 0 on; when, as a
part of the episode, and how long; and when electrodes are put on anew, above 1 for never. Then come the gains."""


class Electrodes(Settings):
    """How much may be wrong with the electrodes."""

    gain_deviation: float = Field(default=0.3, gt=0.0, le=1.0, description="standard deviation of the gains [-]")
    crosstalk: float = Field(default=0.2, ge=0.0, le=1.0, description="most of the others' signal in one [-]")
    dropping: float = Field(default=0.2, gt=0.0, le=1.0, description="share of episodes in which a channel drops out")


def electrode_draws(
    muscles: Sequence[str], renewed: object, electrodes: Electrodes | None = None
) -> dict[str, Distribution]:
    """Distributions of what is drawn for an episode.

    Args:
        muscles: names of the channels.
        renewed: distribution of the part of the episode after which electrodes are put on anew.
        electrodes: how much may be wrong with them.
    """
    n, wrong = len(muscles), electrodes or Electrodes()
    gain = {"normal": {"mean": 1.0, "deviation": wrong.gain_deviation, "low": 0.3, "high": 2.0}}
    spreads = {
        "crosstalk": {"uniform": [0.0, wrong.crosstalk]},
        "dropped": {"uniform": [0.0, n / wrong.dropping]},
        "drop_begin": {"uniform": [0.0, 1.0]},
        "drop_length": {"uniform": [0.05, 0.3]},
        "renewed": renewed,
    }
    gains = {f"gain.{m}": gain for m in muscles} | {f"new_gain.{m}": gain for m in muscles}
    return {f"emg.{name}": distribution(spread) for name, spread in (spreads | gains).items()}


@compiled
def put_envelopes(activations, drawn, part, out):
    """Fill what each channel shows.

    Args:
        activations: of the muscles [-], shape (m,).
        drawn: numbers of `electrode_draws`, shape (5 + 2 m,).
        part: part of the episode that is over, from 0 to 1.
        out: filled [-], shape (m,).
    """
    m, total, x = activations.shape[0], 0.0, drawn[FAULTS.crosstalk]
    gains = len(FAULTS) + (m if part >= drawn[FAULTS.renewed] else 0)
    begin = drawn[FAULTS.drop_begin]
    lost = begin <= part < begin + drawn[FAULTS.drop_length]
    for i in range(m):
        total += activations[i]
    for i in range(m):
        others = (total - activations[i]) / max(m - 1, 1)
        out[i] = drawn[gains + i] * ((1.0 - x) * activations[i] + x * others)
        if lost and int(drawn[FAULTS.dropped]) == i:
            out[i] = 0.0
