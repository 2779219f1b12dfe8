"""Measurement files: what is read, and what is refused by name, line and unit."""

from __future__ import annotations

import math

import numpy as np
import pytest

from dms_core import Model, SolverOptions, simulate
from dms_core.errors import InputError
from dms_core.estimation import Bias, Channel, EstimatedInput, FilterSettings
from dms_core.estimation.filter.kalman import KalmanFilter
from dms_core.estimation.measurement import Measurements, read_measurements
from dms_core.estimation.record import estimate, events
from tests.dms_core.estimation.systems import driven_four_bar, masses


@pytest.fixture(scope="module")
def four_bar() -> Model:
    return Model(driven_four_bar())


@pytest.fixture(scope="module")
def pair() -> Model:
    return Model(masses())


def written(tmp_path, text: str, name: str = "record.csv"):
    path = tmp_path / name
    path.write_text(text, encoding="utf-8")
    return path


class TestReading:
    @pytest.mark.parametrize(
        ("column", "value"),
        [("crank_angle.angle", 0.5), ("crank_angle.angle_rad", 0.5), ("crank_angle.angle_deg", math.radians(0.5)),
         ("crank_angle.rate_rad_per_s", 0.5), ("crank_angle.rate_deg_per_s", math.radians(0.5))],
    )  # fmt: skip
    def test_a_column_in_any_unit_of_the_kind(self, tmp_path, four_bar, column, value):
        read = read_measurements(written(tmp_path, f"time_s,{column}\n0,0.5\n"), four_bar)
        assert read.channels == (column.replace("_rad_per_s", "").replace("_deg_per_s", "").removesuffix("_rad")
                                 .removesuffix("_deg"),)  # fmt: skip
        assert read.y[0, 0] == pytest.approx(value, rel=1e-15)

    def test_empty_cells_are_missing_and_inputs_are_known(self, tmp_path, four_bar):
        text = "time;crank_angle.angle;rocker_angle.angle;torque\n0;0.8;;1\n0.01;nan;2;\n"
        read = read_measurements(written(tmp_path, text), four_bar)
        assert read.channels == ("crank_angle.angle", "rocker_angle.angle")
        np.testing.assert_array_equal(read.y, [[0.8, np.nan], [np.nan, 2.0]])
        np.testing.assert_array_equal(read.inputs["torque"], [1.0, np.nan])

    @pytest.mark.parametrize(("header", "value"), [("inDegrees=yes", math.radians(30.0)), ("inDegrees=no", 30.0)])
    def test_a_storage_of_opensim(self, tmp_path, four_bar, header, value):
        text = f"Coordinates\nversion=1\nnRows=1\n{header}\n\nendheader\ntime\tcrank_angle.angle\n0.0\t30\n"
        read = read_measurements(written(tmp_path, text, "record.sto"), four_bar)
        assert read.y[0, 0] == pytest.approx(value, rel=1e-15)


REFUSED = {
    "sensor that the model lacks": ("time_s,wrist.angle\n0,1\n", "'wrist.angle' belongs to no sensor.*crank_angle.ang"),
    "other unit": (
        "time_s,crank_angle.angle_Nm\n0,1\n",
        "another unit than sensor 'crank_angle.angle', which is in rad",
    ),
    "backwards": ("time_s,crank_angle.angle\n0,1\n0.2,1\n0.1,1\n", "line 4: the time runs backwards: 0.1 s behind 0.2"),
    "standing": ("time_s,crank_angle.angle\n0,1\n0,1\n", "line 3: the time stands still"),
    "before the model begins": ("time_s,crank_angle.angle\n-1,1\n", "line 2, column 'time_s': Expected a time of at"),
    "no time": ("crank_angle.angle\n1\n", "Expected one column of times"),
    "time missing": ("time_s,crank_angle.angle\n,1\n", "line 2, column 'time_s'"),
    "two columns": ("time_s,crank_angle.angle,crank_angle.angle_deg\n0,1,1\n", "all tell 'crank_angle.angle'"),
    "one column twice": ("time_s,crank_angle.angle,crank_angle.angle\n0,1,1\n", "'crank_angle.angle' stands 2 times"),
    "words": ("time_s,crank_angle.angle\n0,fast\n", "line 2, column 'crank_angle.angle': Expected a number, or an em"),
    "infinite": ("time_s,crank_angle.angle\n0,inf\n", "Expected a number"),
    "empty": ("", "empty"),
    "no rows": ("time_s,crank_angle.angle\n", "no rows"),
    "missing channel": ("time_s,rocker_angle.angle\n0,1\n", "no column tells sensor 'crank_angle.angle'"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_is_refused(tmp_path, four_bar, case):
    text, said = REFUSED[case]
    with pytest.raises(InputError, match=said):
        read_measurements(written(tmp_path, text), four_bar, ("crank_angle.angle",))


def test_quotes_about_cells_are_no_part_of_them(tmp_path, four_bar):
    read = read_measurements(written(tmp_path, '"time_s","crank_angle.angle"\n"0","0.5"\n'), four_bar)
    assert read.channels == ("crank_angle.angle",)
    assert read.y[0, 0] == 0.5


def test_a_storage_without_its_header_is_refused(tmp_path, four_bar):
    with pytest.raises(InputError, match="endheader"):
        read_measurements(written(tmp_path, "time\tcrank_angle.angle\n0\t1\n", "record.sto"), four_bar)


def test_arrays_that_run_backwards_are_refused():
    with pytest.raises(InputError, match=r"backwards.*0\.1 s behind 0\.2 s in row 3"):
        Measurements(np.array([0.0, 0.2, 0.1]), ("a",), np.zeros((3, 1)), {})


class TestTimes:
    def test_delayed_readings_tell_of_before_and_gaps_are_filled(self, pair):
        channels = {"at0.position.x": Channel(deviation=0.01, delay=0.02), "at1.position.x": Channel(deviation=0.01)}
        kalman = KalmanFilter(pair, FilterSettings(channels=channels, period=0.025))
        y = np.array([[1.0, 2.0], [np.nan, 2.1], [1.2, np.nan]])
        found = events(Measurements(np.array([0.01, 0.05, 0.12]), tuple(channels), y, {}), kalman)
        # 0.01 - 0.02 is before the start.
        np.testing.assert_allclose([e.t for e in found], [0.01, 0.03, 0.05, 0.075, 0.1])
        assert [list(e.readings) for e in found] == [["at1.position.x"], [], ["at1.position.x"], [], ["at0.position.x"]]

    def test_a_hole_that_no_memory_holds_is_refused(self, pair):
        kalman = KalmanFilter(pair, FilterSettings(channels={"at0.position.x": {"deviation": 0.01}}))
        record = Measurements(np.array([0.0, 1e9]), ("at0.position.x",), np.ones((2, 1)), {})
        with pytest.raises(InputError, match=r"from 0 to 1e\+09 s nothing is told.*at most 1,000,000 periods"):
            events(record, kalman)

    def test_a_delay_that_is_told_costs_nothing(self, pair):
        """A sine by a sensor that is late by 30 ms is as good as by one that is not, and late where it is not told."""
        t = 0.01 * np.arange(150)
        errors = []
        for delay, told in ((0.0, 0.0), (0.03, 0.03), (0.03, 0.0)):
            course = 2.0 + 0.1 * np.sin(8.0 * (t - delay))
            settings = FilterSettings(
                channels={"at1.position.x": Channel(deviation=0.001, delay=told)},
                inputs={"force": EstimatedInput(deviation=5.0, walk=20.0)},
            )
            found = estimate(KalmanFilter(pair, settings), Measurements(t, ("at1.position.x",), course[:, None], {}))
            late = found.t > 0.5
            x = found.columns()["at1.position.x_m"][late]
            errors.append(np.sqrt(np.mean((x - 2.0 - 0.1 * np.sin(8.0 * found.t[late])) ** 2)))
        assert errors[1] < 1.2 * errors[0]
        assert errors[2] > 10.0 * errors[1]

    def test_a_bias_is_told_by_another_sensor(self, pair):
        rng, t = np.random.default_rng(8), 0.01 * np.arange(150)
        channels = {"at0.position.x": Channel(deviation=0.002, bias=Bias(deviation=0.1)),
                    "at1.position.x": Channel(deviation=0.002)}  # fmt: skip
        y = np.array([1.07, 2.0]) + 0.002 * rng.normal(size=(150, 2))
        found = estimate(KalmanFilter(pair, FilterSettings(channels=channels)), Measurements(t, tuple(channels), y, {}))
        bias, deviation = found.rest("bias.at0.position.x")
        assert bias[-1] == pytest.approx(0.07, abs=3.0 * deviation[-1])
        assert deviation[-1] < 0.003

    def test_a_quantum_counts_as_noise(self):
        assert Channel(deviation=0.3, quantum=1.2).variance == pytest.approx(0.09 + 0.12)


def test_each_row_is_read_with_the_input_that_was_known_then():
    """A constant moment that ends with the record: accelerations are those that it gave, not those without it."""
    t = 0.01 * np.arange(11)
    truth = simulate(driven_four_bar(0.05), 0.1, SolverOptions(rtol=1e-7)).at(t).sensors()
    known = np.where(t < 0.095, 0.05, 0.0)
    settings = FilterSettings(channels={"crank_angle.angle": {"deviation": 0.01}}, initial={"position": 1e-4})
    kalman = KalmanFilter(Model(driven_four_bar()), settings)
    y = truth["crank_angle.angle"][:, None]
    record = Measurements(t, ("crank_angle.angle",), y, {"torque": known})
    found = estimate(kalman, record).columns()["crank_angle.acceleration_rad_per_s2"]
    size = np.abs(truth["crank_angle.acceleration"]).max()
    np.testing.assert_allclose(found, truth["crank_angle.acceleration"], atol=0.05 * size)
    assert estimate(kalman, record).columns()["crank_angle.acceleration_rad_per_s2"] == pytest.approx(found), "no leak"
