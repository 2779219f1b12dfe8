"""From an encoder alone: angle, rate and an unknown force of a slider-crank and a four-bar."""

from __future__ import annotations

import numpy as np
import pytest

from dms_core import Model, SolverOptions, simulate
from dms_core.estimation import Channel, EstimatedInput, FilterSettings
from dms_core.estimation.filter.forms import filter_of
from dms_core.estimation.measurement import Measurements
from dms_core.estimation.record import Estimate, estimate
from dms_core.estimation.settings import InitialDeviations
from dms_core.model import Harmonic, Input, System
from tests.dms_core.estimation.systems import driven_four_bar, slider_crank

PERIOD, NOISE, FREQUENCY = 0.01, 0.5e-3, 0.5
"""Period of an encoder [s], its noise [rad], and how fast the force changes [Hz]."""


def with_course(system: System, size: float) -> System:
    """The same system, whose input is size sin(2 pi FREQUENCY t)."""
    (old,) = system.inputs
    return System(
        system.name, bodies=system.own("bodies"), constraints=system.own("constraints"), forces=system.own("forces"),
        sensors=system.own("sensors"),
        inputs=[Input(name=old.name, signal=Harmonic(amplitude=size, frequency=FREQUENCY))],
    )  # fmt: skip


CASES = {
    "slider-crank": (slider_crank, "encoder", "force", 5.0),
    "four-bar": (driven_four_bar, "crank_angle", "torque", 0.3),
}


def estimated(case: str, form: str, seconds: float = 1.5, smooth: bool = False) -> tuple[Estimate, np.ndarray, dict]:
    system, encoder, name, size = CASES[case]
    truth = simulate(with_course(system(), size), seconds, SolverOptions(rtol=1e-8))
    t = np.arange(0.0, seconds + 1e-9, PERIOD)
    true = truth.at(t).sensors()
    y = true[f"{encoder}.angle"] + NOISE * np.random.default_rng(7).normal(size=len(t))
    settings = FilterSettings(
        period=PERIOD, steps=2, form=form, channels={f"{encoder}.angle": Channel(deviation=NOISE)},
        inputs={name: EstimatedInput(deviation=size, walk=size)},
        initial=InitialDeviations(position=0.01, velocity=0.5),
    )  # fmt: skip
    kalman = filter_of(Model(system()), settings)
    found = estimate(kalman, Measurements(t, (f"{encoder}.angle",), y[:, None], {}), smooth=smooth)
    return found, size * np.sin(2.0 * np.pi * FREQUENCY * t), true


def rms(x: np.ndarray) -> float:
    return float(np.sqrt(np.mean(x**2)))


@pytest.mark.parametrize("form", ["extended", "iterated", "unscented"])
@pytest.mark.parametrize("case", CASES)
def test_angle_rate_and_force_from_an_encoder(case, form):
    found, force, true = estimated(case, form, 0.8 if form == "unscented" else 1.5)
    encoder, name, size = CASES[case][1:]
    late = found.t > 0.3
    table = found.columns()
    assert not found.diverged
    # Better than the readings and their difference quotient (0.07 rad/s); the force follows a few periods behind.
    assert rms((table[f"{encoder}.angle_rad"] - true[f"{encoder}.angle"])[late]) < NOISE
    assert rms((table[f"{encoder}.rate_rad_per_s"] - true[f"{encoder}.rate"])[late]) < 0.05
    assert rms((table[f"input.{name}"] - force)[late]) < 0.15 * size
    # The walk wanders more than this sine does: the error is no larger than is said.
    error = (table[f"input.{name}"] - force)[late] / table[f"deviation.input.{name}"][late]
    assert 0.2 < rms(error) < 1.0


@pytest.mark.parametrize("case", CASES)
def test_a_smoother_lowers_the_error_of_the_force(case):
    filtered, force, _ = estimated(case, "extended")
    smooth, _, _ = estimated(case, "extended", smooth=True)
    name = CASES[case][2]
    middle = (filtered.t > 0.3) & (filtered.t < 1.2)
    errors = [rms((x.rest(f"input.{name}")[0] - force)[middle]) for x in (filtered, smooth)]
    # It does not lag, and noise is averaged over both sides: half of the variance at the least.
    assert errors[1] < 0.71 * errors[0]


def test_states_stay_on_the_constraints():
    found, _, _ = estimated("four-bar", "extended", 0.5)
    model = found.kalman.model
    for belief in found.beliefs[::7]:
        phi, phi_v, _, _ = model.constraint_jacobian(belief.q, belief.v)
        # A projection ends at 1e-13 of the coordinates' size; rows that depend on others are as far off.
        assert np.abs(phi).max() < 1e-11
        assert np.abs(phi_v).max() < 1e-10
