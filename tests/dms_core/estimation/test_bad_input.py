"""What a filter refuses, what it says where it diverges, and that a table of it stays finite."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from dms_core import Model, SolverOptions, simulate
from dms_core.errors import InputError, ModelError, SimulationError
from dms_core.estimation import FilterSettings
from dms_core.estimation.filter.gaussian import truncated
from dms_core.estimation.filter.kalman import KalmanFilter
from dms_core.estimation.measurement import Measurements
from dms_core.estimation.record import estimate
from dms_core.estimation.settings import checked_covariance
from dms_core.files.config_files import config_file
from dms_core.model import Constant, Input, LineGuide, LumpedLoad, Point, PointMass, PositionDriver, System
from dms_core.model_files.model_file import load
from tests.dms_core.estimation.systems import driven_four_bar, masses

CHANNEL = {"at1.position.x": {"deviation": 0.01}}


@pytest.fixture(scope="module")
def model() -> Model:
    return Model(masses())


REFUSED = {
    "no channel": ({"channels": {}}, "channels"),
    "unknown sensor": ({"channels": {"wrist": {"deviation": 1.0}}}, "no sensor 'wrist'.*at0.position.x"),
    "no noise": ({"channels": {"at1.position.x": {"deviation": 0.0}}}, r"deviation = 0.*Expected a number above 0"),
    "negative delay": ({"channels": {"at1.position.x": {"deviation": 1.0, "delay": -1.0}}}, "delay.*at least 0"),
    "unknown input": ({"inputs": {"moment": {"deviation": 1.0, "walk": 1.0}}}, "'moment' is no input.*force"),
    "walk and time constant": ({"inputs": {"force": {"deviation": 1.0}}}, "either time_constant or walk"),
    "unknown constant": ({"constants": {"m0.weight": {"deviation": 1.0}}}, "'weight' does not exist.*mass"),
    "no constant": ({"constants": {"m0": {"deviation": 1.0}}}, "Expected '<element>.<key>'"),
    "no element": ({"constants": {"m9.mass": {"deviation": 1.0}}}, "m9"),
    "unknown coordinate": ({"noise": {"coordinates": {"m9.x": 1.0}}}, r"noise.coordinates.*'m9.x'.*m0.x"),
    "unknown start": ({"initial": {"coordinates": {"m0.x": 1.0}}}, r"initial.coordinates.*'m0.x'.*q.m0.x"),
    "bound of a position": ({"bounds": {"m0.x": [0.0, 1.0]}}, "bounds: 'm0.x' is no state of first order"),
    "bounds the wrong way": ({"bounds": {"force": [1.0, 0.0]}}, "least value below the largest"),
    "period": ({"period": 0.0}, "period = 0.*above 0"),
    "unknown key": ({"speed": 1.0}, "unknown key 'speed'"),
    "not positive": ({"initial": {"covariance": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, -1, 0], [0, 0, 0, 1]]}},
                     r"initial.covariance.*positive definite.*'v.m0.x' \(variance -1\)"),
    "correlated beyond 1": ({"initial": {"covariance": [[1, 2, 0, 0], [2, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]}},
                            r"'q.m1.x'.*correlations below 1"),
    "not symmetric": ({"initial": {"covariance": [[1, 0.5, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]}},
                      r"symmetric.*0.5 between 'q.m0.x' and 'q.m1.x'"),
    "too small": ({"initial": {"covariance": [[1.0]]}}, "Expected 4 x 4 numbers"),
}  # fmt: skip


@pytest.mark.parametrize("case", REFUSED)
def test_what_is_refused(model, case):
    changes, said = REFUSED[case]
    with pytest.raises((InputError, ModelError), match=said):
        KalmanFilter(model, FilterSettings(**{"channels": CHANNEL, **changes})).start()


def test_an_input_of_a_constraint_is_refused():
    system = System(
        "shaken", bodies=[PointMass(name="m", mass=1.0)],
        constraints=[LineGuide(name="track", body_j="m", axis_i=(1.0, 0.0, 0.0)),
                     PositionDriver(name="shaker", body_j="m", axis_i=(1.0, 0.0, 0.0), input="u")],
        sensors=[Point(name="at", body="m")], inputs=[Input(name="u", signal=Constant(value=0.0))],
    )  # fmt: skip
    settings = FilterSettings(channels={"at.position.x": {"deviation": 1.0}}, inputs={"u": {"deviation": 1, "walk": 1}})
    with pytest.raises(InputError, match="moves position_driver 'shaker'"):
        KalmanFilter(Model(system), settings)


def test_a_mechanism_whose_freedoms_are_all_driven_is_refused():
    model = Model(load(config_file("models/four_bar.yaml")))
    with pytest.raises(InputError, match="has nothing to estimate: drivers move all its freedoms"):
        KalmanFilter(model, FilterSettings(channels={"crank_angle.angle": {"deviation": 1.0}})).start()


def test_a_matrix_that_is_not_finite_is_refused():
    with pytest.raises(InputError, match="'a' and 'b'"):
        checked_covariance("P", ("a", "b"), np.array([[1.0, np.nan], [np.nan, 1.0]]))


def test_a_known_input_that_is_estimated_too_is_refused(model):
    settings = FilterSettings(channels=CHANNEL, inputs={"force": {"deviation": 1.0, "walk": 1.0}})
    record = Measurements(np.zeros(1), ("at1.position.x",), np.full((1, 1), 2.0), {"force": np.zeros(1)})
    with pytest.raises(InputError, match="'force' is estimated, but the measurements tell it"):
        estimate(KalmanFilter(model, settings), record)


def test_a_record_without_readings_is_refused(model):
    record = Measurements(np.zeros(1), ("at1.position.x",), np.full((1, 1), np.nan), {})
    with pytest.raises(InputError, match="no reading of at1.position.x"):
        estimate(KalmanFilter(model, FilterSettings(channels=CHANNEL)), record)


class TestDivergence:
    def test_it_is_said_and_the_filter_goes_on_with_finite_numbers(self):
        """Readings that no position of the mechanism shows, in the middle of a good record."""
        model = Model(driven_four_bar())
        settings = FilterSettings(channels={"rocker_angle.angle": {"deviation": 0.001}})
        kalman, t = KalmanFilter(model, settings), 0.01 * np.arange(60)
        angle = simulate(driven_four_bar(), 0.6, SolverOptions(rtol=1e-7)).at(t).sensors()["rocker_angle.angle"]
        y = angle[:, None].copy()
        y[20:30] += 2.0
        found = estimate(kalman, Measurements(t, ("rocker_angle.angle",), y, {}))
        assert found.diverged
        assert 0.19 < found.diverged[0].t < 0.31
        assert "resumed from its state at" in found.diverged[0].sentence
        assert all(np.isfinite(x).all() for x in found.columns().values())
        # It has come back to the readings, to the error of steps of 10 ms.
        assert found.columns()["rocker_angle.angle_rad"][-1] == pytest.approx(angle[-1], abs=0.03)

    def test_readings_that_leave_the_model_for_good_are_told(self, model):
        settings = FilterSettings(channels={"at1.position.x": {"deviation": 1e-3}}, initial={"position": 1e-3})
        kalman, t = KalmanFilter(model, settings), 0.01 * np.arange(40)
        y = 2.0 + np.where(t > 0.1, 1.0, 0.0) * np.sin(40.0 * t)
        found = estimate(kalman, Measurements(t, ("at1.position.x",), y[:, None], {}))
        assert "20 corrections in a row" in found.diverged[0].why

    def test_no_reading_that_can_be_told_is_an_error(self):
        """The rocker is never where the record says; between the readings the filter only predicts."""
        settings = FilterSettings(channels={"rocker_angle.angle": {"deviation": 1e-6}}, period=0.01)
        t = 0.05 * np.arange(4)
        record = Measurements(t, ("rocker_angle.angle",), np.full((4, 1), 0.2), {})
        with pytest.raises(SimulationError, match="diverged at every reading"):
            estimate(KalmanFilter(Model(driven_four_bar()), settings), record)


class TestBounds:
    def test_a_normal_distribution_cut_at_its_mean_is_half_normal(self):
        """Mean sqrt(2 / pi), variance 1 - 2 / pi."""
        dx, P = truncated(np.diag([1.0, 2.0]), 0, 0.0, 0.0, np.inf)
        np.testing.assert_allclose(dx, [np.sqrt(2.0 / np.pi), 0.0], rtol=1e-12)
        np.testing.assert_allclose(P, np.diag([1.0 - 2.0 / np.pi, 2.0]), rtol=1e-12)

    @pytest.mark.parametrize(("mean", "low", "high"), [(-3.0, 0.0, 1.0), (5.0, 0.0, 1.0), (-60.0, 0.0, np.inf)])
    def test_what_lies_far_outside_comes_inside(self, mean, low, high):
        P = np.array([[1.0, 0.6], [0.6, 1.0]])
        dx, cut = truncated(P, 0, mean, low, high)
        assert low <= mean + dx[0] <= high
        assert dx[1] == pytest.approx(0.6 * dx[0])
        assert np.linalg.eigvalsh(cut)[0] > 0.0

    def test_samples_say_the_same(self):
        x = np.random.default_rng(4).multivariate_normal([-0.4, 1.0], [[1.0, 0.6], [0.6, 1.0]], 400_000)
        kept = x[(x[:, 0] > 0.0) & (x[:, 0] < 0.9)]
        dx, P = truncated(np.array([[1.0, 0.6], [0.6, 1.0]]), 0, -0.4, 0.0, 0.9)
        # The mean of 100000 samples errs by 0.003.
        np.testing.assert_allclose([-0.4, 1.0] + dx, kept.mean(axis=0), atol=0.01)
        np.testing.assert_allclose(P, np.cov(kept.T), atol=0.01)

    def test_a_force_stays_above_its_bound(self, model):
        settings = FilterSettings(
            channels=CHANNEL, inputs={"force": {"deviation": 3.0, "walk": 10.0}}, bounds={"force": [0.0, None]}
        )
        y = 2.0 + 0.1 * np.sin(6.0 * 0.01 * np.arange(100))
        record = Measurements(0.01 * np.arange(100), ("at1.position.x",), y[:, None], {})
        force = estimate(KalmanFilter(model, settings), record).rest("input.force")[0]
        assert force.min() >= 0.0
        assert force.max() > 1.0

    def test_a_cut_that_moves_another_input_out_of_its_bounds_is_followed(self):
        """Two forces on one mass, of which a sensor tells the sum: their errors have a correlation near -1."""
        both = System(
            "both", bodies=[PointMass(name="m", mass=1.0)],
            constraints=[LineGuide(name="track", body_j="m", axis_i=(1.0, 0.0, 0.0))],
            forces=[LumpedLoad(name=f"push{k}", body="m", force=(1.0, 0.0, 0.0), input=f"f{k}") for k in "ab"],
            sensors=[Point(name="at", body="m")],
            inputs=[Input(name=f"f{k}", signal=Constant(value=0.0)) for k in "ab"],
        )  # fmt: skip
        settings = FilterSettings(
            channels={"at.position.x": {"deviation": 1.0}},
            inputs={f"f{k}": {"deviation": 1.0, "walk": 1.0} for k in "ab"},
            bounds={f"f{k}": [0.0, None] for k in "ab"},
        )
        kalman = KalmanFilter(Model(both), settings)
        start = kalman.start()
        P = 0.01 * np.eye(4)
        P[2, 3] = P[3, 2] = -0.009
        outside = replace(start, rest=np.array([0.001, -0.05]), P=P)
        cut = kalman.within_bounds(outside)
        assert cut.rest.min() >= 0.0
        # Two passes of truncation, each a closed form of one normal distribution.
        np.testing.assert_allclose(cut.rest, [0.018, 0.026], atol=1e-3)
