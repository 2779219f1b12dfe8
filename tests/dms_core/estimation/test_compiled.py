"""The compiled filter is the filter: the same means, covariances and NIS, in every form, and many of them at once."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.special import erfcx

from dms_core import Model
from dms_core.errors import InputError, SimulationError
from dms_core.estimation import Bias, Channel, EstimatedInput, FilterBatch, FilterSettings, KalmanFilter
from dms_core.estimation.compiled.filter import CompiledFilter
from dms_core.estimation.filter.cut import cut_moments
from dms_core.estimation.filter.forms import CompiledKalmanFilter, filter_of
from dms_core.estimation.filter.unscented import UnscentedFilter
from dms_core.model_files.model_file import load
from tests.dms_core.estimation.systems import driven_four_bar, masses, slider_crank
from tests.dms_core.estimation.test_observability import two_muscles

CASES = {
    "masses": (
        masses, {"at1.position.x": (0.01, 2.0), "at0.velocity.x": (0.05, 0.0)}, "force",
        {"m1.mass": 0.2, "spring0.stiffness": 4.0}, {"force": [0.0, 0.15]},
    ),
    "four-bar": (
        driven_four_bar, {"crank_angle.angle": (1e-3, 0.8), "crank_angle.acceleration": (0.5, 0.0)}, "torque",
        {"friction.damping": 0.01}, {"torque": [-0.01, 0.02]},
    ),
    "slider-crank": (
        slider_crank, {"encoder.angle": (1e-3, 0.7), "piston_at.acceleration.x": (0.2, 0.0)}, "force",
        {"piston.mass": 0.05}, {"force": [None, 0.02]},
    ),
    "muscles": (
        two_muscles, {"angle.angle": (1e-3, 0.0)}, "drive of one", {"one.max_isometric_force": 5.0},
        {"drive of one": [0.0, 1.0], "one.activation": [0.01, 1.0]},
    ),
}  # fmt: skip
"""System, channels with their deviation and what they show, the unknown input, constants, bounds."""
DIGITS = 1e-10
"""Agreement over deviations: both are the same formulas with the same derivatives, summed in another order."""
DIGITS_BY_CONSTANTS = 1e-8
"""With constants: in Python a sensor's derivative by one is a central difference of settled readings, good to 1e-9, and
an iterated correction amplifies that a few times."""
FORMS = {
    "extended": {}, "iterated": {"form": "iterated"}, "bounds": {"bounds": True}, "constants": {"constants": True},
    "all": {"form": "iterated", "bounds": True, "constants": True},
}  # fmt: skip


def settings_of(case: str, form: str = "extended", bounds: bool = False, constants: bool = False) -> FilterSettings:
    """Settings of a case, with noise of the motion, a bias, and what is asked for."""
    _, channels, unknown, numbers, limits = CASES[case]
    names = list(channels)
    biased = {names[0]: Channel(deviation=channels[names[0]][0], bias=Bias(deviation=0.01, walk=0.001))}
    return FilterSettings(
        period=0.002, steps=2, channels={**{n: Channel(deviation=d) for n, (d, _) in channels.items()}, **biased},
        inputs={unknown: EstimatedInput(deviation=0.2, time_constant=0.2)}, noise={"rate": 0.01, "acceleration": 0.3},
        initial={"position": 0.01, "velocity": 0.1, "state": 0.01}, form=form, bounds=limits if bounds else {},
        constants={name: {"deviation": x, "walk": 0.1 * x} for name, x in numbers.items()} if constants else {},
    )  # fmt: skip


def readings_of(case: str, rng: np.random.Generator, k: int) -> dict[str, float]:
    """Noisy readings, some of them missing."""
    channels = CASES[case][1]
    found = {n: value + deviation * rng.normal() for n, (deviation, value) in channels.items()}
    if k % 7 == 3:
        found[list(channels)[-1]] = float("nan")
    return found


def assert_same(found, belief, nis, expected_nis, digits):
    """Means and covariances agree, over deviations."""
    size = np.sqrt(np.diag(belief.P))
    assert found.chart.names == belief.chart.names
    np.testing.assert_allclose(found.mean / size, belief.mean / size, rtol=0.0, atol=digits)
    np.testing.assert_allclose(found.P / np.outer(size, size), belief.P / np.outer(size, size), rtol=0.0, atol=digits)
    assert nis == pytest.approx(expected_nis, rel=100.0 * digits, abs=100.0 * digits)


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("case", CASES)
def test_it_is_the_filter_in_python(case, form):
    """Alone, and as the filter of a record, which begins each event with the belief of the one before."""
    made, settings = CASES[case][0], settings_of(case, **FORMS[form])
    kalman, alone, of_record = (
        kind(Model(made()), settings) for kind in (KalmanFilter, CompiledFilter, CompiledKalmanFilter)
    )
    digits = DIGITS_BY_CONSTANTS if settings.constants else DIGITS
    rng, belief = np.random.default_rng(3), kalman.start()
    for k in range(25):
        readings, before = readings_of(case, rng, k), belief
        if k:
            predicted = kalman.predict(before, 0.002 * k)
            other = of_record.predict(before, 0.002 * k)
            belief = predicted.belief
            size = np.sqrt(np.outer(np.diag(before.P), np.diag(belief.P)))
            np.testing.assert_allclose(other.joint / size, predicted.joint / size, rtol=0.0, atol=digits)
            alone.step(readings)
        else:
            alone.correct(readings)
        correction, other = kalman.correct(belief, readings), of_record.correct(belief, readings)
        assert_same(other.belief, correction.belief, other.nis, correction.nis, digits)
        np.testing.assert_allclose(other.residual, correction.residual, rtol=0.0, atol=1e-9)
        belief = correction.belief
        assert_same(alone.belief(), belief, alone.nis[0], correction.nis, 10.0 * digits)


def test_states_stay_on_the_constraints():
    model = Model(driven_four_bar())
    quick = CompiledFilter(model, FilterSettings(channels={"crank_angle.angle": {"deviation": 0.001}}))
    for _ in range(20):
        quick.step({"crank_angle.angle": 0.9})
    found = quick.belief()
    phi, phi_v, _, _ = model.constraint_jacobian(found.q, found.v)
    assert np.abs(phi).max() < 1e-10
    assert np.abs(phi_v).max() < 1e-10


@pytest.mark.parametrize(
    "changes, message",
    [
        ({"form": "unscented"}, "does not have form 'unscented'"),
        ({"constants": {"pin.point_i.0": {"deviation": 0.01}}}, "does not have a constant that moves a constraint"),
    ],
)
def test_what_compiled_steps_do_not_have_is_refused(changes, message):
    with pytest.raises(InputError, match=message):
        CompiledFilter(
            Model(slider_crank()), FilterSettings(channels={"encoder.angle": {"deviation": 0.01}}, **changes)
        )


def test_what_it_cannot_follow_is_said_and_the_belief_stays():
    quick = CompiledFilter(
        Model(driven_four_bar()), FilterSettings(channels={"rocker_angle.angle": {"deviation": 1e-6}})
    )
    before = quick.belief()
    with pytest.raises(SimulationError, match="compiled filter"):
        for _ in range(5):
            before = quick.belief()
            quick.step({"rocker_angle.angle": 0.2})
    np.testing.assert_array_equal(quick.belief().q, before.q)


def test_readings_of_nobody_are_refused():
    """A sensor that is no channel tells nothing; a name that no sensor has is a mistake, in Python alike."""
    quick = CompiledFilter(
        Model(driven_four_bar()), FilterSettings(channels={"crank_angle.angle": {"deviation": 0.01}})
    )
    start = quick.belief()
    for take in (quick.step, quick.correct, lambda y: quick.kalman.correct(start, y)):
        with pytest.raises(InputError, match=r"no sensor 'crank_angle.angel'. The channels are: crank_angle.angle"):
            take({"crank_angle.angel": 0.9})
    quick.correct({"rocker_angle.angle": 0.2, "crank_angle.angle": np.inf})
    assert np.array_equal(quick.belief().mean, start.mean) and quick.nis == (0.0, 0)


class TestBatch:
    """Many filters of one model in one compiled call."""

    SETTINGS = settings_of("muscles", bounds=True, constants=True)

    @staticmethod
    def started(quick: CompiledFilter, k: int) -> None:
        """Begin with a start of its own."""
        belief = quick.kalman.start()
        moved = quick.kalman.moved(belief, belief.mean + 0.02 * (k + 1) * (np.arange(len(belief.P)) == 0))
        quick.begin(quick.kalman.here(moved))

    @pytest.mark.parametrize("threads", [1, 2, 3])
    def test_each_is_the_single_filter_to_the_last_bit(self, threads):
        model = Model(two_muscles())
        batch = FilterBatch(model, self.SETTINGS, 5, threads)
        single = [CompiledFilter(Model(two_muscles(), like=model), self.SETTINGS) for _ in range(5)]
        rng, names = np.random.default_rng(2), batch.names
        for k in range(5):
            self.started(batch.filters[k], k)
            self.started(single[k], k)
        for _ in range(12):
            y = 0.01 * rng.normal(size=(5, len(names)))
            y[3, 0] = np.nan
            batch.step(y)
            for k, quick in enumerate(single):
                quick.step(dict(zip(names, y[k], strict=True)))
        for one, other in zip(batch.filters, single, strict=True):
            np.testing.assert_array_equal(one.belief().mean, other.belief().mean)
            np.testing.assert_array_equal(one.belief().P, other.belief().P)
            assert one.nis == other.nis
        means = [x.belief().mean[0] for x in batch.filters]
        assert len(set(means)) == 5
        batch.close()

    def test_those_that_cannot_go_on_are_left_where_they_were(self):
        settings = FilterSettings(channels={"rocker_angle.angle": {"deviation": 1e-6}})
        batch = FilterBatch(Model(driven_four_bar()), settings, 3, 2)
        y = np.array([[0.2], [np.nan], [0.2]])
        with pytest.raises(SimulationError, match="filter 0: compiled filter.* filter 2: compiled filter"):
            for _ in range(5):
                before = [x.belief() for x in batch.filters]
                batch.step(y)
        for k in (0, 2):
            np.testing.assert_array_equal(batch.filters[k].belief().q, before[k].q)
        assert batch.filters[1].belief().t > before[1].t
        batch.close()

    def test_readings_of_another_shape_are_refused(self):
        batch = FilterBatch(Model(masses()), FilterSettings(channels={"at0.position.x": {"deviation": 1.0}}), 2, 1)
        with pytest.raises(InputError, match="Expected readings of shape"):
            batch.step(np.zeros((3, 1)))
        with pytest.raises(InputError, match="Expected readings as an array of numbers"):
            batch.step({"at0.position.x": 0.0})
        for given, said in (((0,), "size = 0"), ((2.5,), "size = 2.5"), ((2, 0), "threads = 0")):
            with pytest.raises(InputError, match=f"{said}: Expected a whole number of at least 1"):
                FilterBatch(Model(masses()), batch.filters[0].kalman.settings, *given)

    def test_what_is_no_finite_number_is_missing(self):
        settings = FilterSettings(channels={"at0.position.x": {"deviation": 1.0}})
        batch = FilterBatch(Model(masses()), settings, 4, 1)
        batch.step(np.array([[np.nan], [np.inf], [-np.inf], [0.1]]))
        means = [x.belief().mean for x in batch.filters]
        assert np.array_equal(means[1], means[0]) and np.array_equal(means[2], means[0])
        assert not np.array_equal(means[3], means[0])


def test_records_are_filtered_by_compiled_steps_where_they_can():
    """Of a model file, alone and as the command takes it."""
    model = load("configs/estimation/forearm.yaml")
    settings = FilterSettings.from_file("configs/estimation/forearm_filter.yaml")
    assert type(filter_of(Model(model), settings)) is CompiledKalmanFilter
    unscented = FilterSettings(**{**dict(settings), "form": "unscented"})
    assert type(filter_of(Model(model), unscented)) is UnscentedFilter
    moved = FilterSettings(channels={"encoder.angle": {"deviation": 1}}, constants={"pin.point_i.0": {"deviation": 1}})
    assert type(filter_of(Model(slider_crank()), moved)) is KalmanFilter
    alone = CompiledFilter(Model(model), settings)
    alone.step({"goniometer.angle": 1.2, "extensor force.activation": 0.1})
    assert alone.nis[1] == 2


def test_virtual_sensors_are_those_of_the_readout():
    """What channels should show, with the covariance of it, a channel without readings among them."""
    settings = settings_of("four-bar")
    quick, names = CompiledFilter(Model(driven_four_bar()), settings), list(settings.channels)
    for k in range(5):
        quick.step({names[0]: readings_of("four-bar", np.random.default_rng(k), k)[names[0]]})
    y, cov = quick.shown()
    kalman, belief = quick.kalman, quick.belief()
    expected, C = kalman.expected(belief, names)
    np.testing.assert_allclose(y, expected, rtol=1e-9)
    np.testing.assert_allclose(cov, C @ belief.P @ C.T, rtol=1e-7)


@pytest.mark.parametrize("z", [3.5, 8.0, 20.0, 29.0])
def test_what_is_left_in_the_tail_is_told_to_the_last_digits(z):
    """Mean and variance of a normal distribution below -z, by the hazard in its scaled form."""
    mean, variance = cut_moments(-np.inf, -z)
    hazard = np.sqrt(2.0 / np.pi) / erfcx(z / np.sqrt(2.0))
    assert mean == pytest.approx(-hazard, rel=1e-14)
    # The reference itself loses z^2 digits of the variance.
    assert variance == pytest.approx(1.0 - hazard * (hazard - z), rel=1e-14 * z**4)
    low, spread = cut_moments(z, np.inf)
    assert (low, spread) == (-mean, variance)
