"""Tables as inputs: values from files by column, and every way in which a file can be wrong."""

from __future__ import annotations

import numpy as np
import pytest

from dms_core import Model, SolverOptions, simulate
from dms_core.errors import InputError, ModelError
from dms_core.model import Input, PointMass, Samples, SecondOrder, System, Table
from dms_core.model_files.model_file import dump, load

GOOD = "time_s,force_N,angle_deg\n0.0,1.0,0.0\n0.5,3.0,90.0\n1.0,2.0,180.0\n"


@pytest.fixture
def table(tmp_path):
    def write(text: str = GOOD):
        path = tmp_path / "load.csv"
        path.write_text(text)
        return path

    return write


def value(signal, t: float) -> float:
    """Value of a signal from its pieces."""
    pieces = signal.pieces()
    k = max(int(np.searchsorted(pieces.t, t, side="right")) - 1, 0)
    return float(np.polynomial.Polynomial(pieces.c[k])(t - pieces.t[k]))


class TestValues:
    def test_straight_lines_between_rows_and_constant_outside(self, table):
        signal = Table(file=str(table()), column="force_N")
        assert [value(signal, t) for t in (-1.0, 0.25, 0.75, 1.0, 9.0)] == pytest.approx([1.0, 2.0, 2.5, 2.0, 2.0])

    def test_units_are_turned_into_those_of_si(self, table):
        signal = Table(file=str(table()), column="angle_deg", unit="deg")
        assert value(signal, 0.5) == pytest.approx(0.5 * np.pi)

    def test_times_in_milliseconds(self, table):
        path = table("t_ms,x\n0,0\n500,1\n")
        assert value(Table(file=str(path), column="x", time="t_ms", time_unit="ms"), 0.25) == pytest.approx(0.5)

    @pytest.mark.parametrize("separator", [";", "\t"])
    def test_other_separators_and_blank_lines(self, table, separator):
        path = table(GOOD.replace(",", separator).replace("0.5", "\n0.5"))
        assert value(Table(file=str(path), column="force_N"), 0.5) == pytest.approx(3.0)

    def test_other_columns_may_hold_anything(self, table):
        path = table("time_s,x,note\n0,1,start\n1,2,\n")
        assert value(Table(file=str(path), column="x"), 1.0) == pytest.approx(2.0)

    @pytest.mark.parametrize(("interpolation", "order"), [("cubic", 4), ("quintic", 6)])
    def test_splines_are_of_their_order(self, interpolation, order):
        errors = []
        for n in (21, 41):
            t = np.linspace(0.0, 2.0, n)
            signal = Samples(times=tuple(t), values=tuple(np.sin(3.0 * t)), interpolation=interpolation)
            at = np.linspace(0.6, 1.4, 33)
            errors.append(max(abs(value(signal, x) - np.sin(3.0 * x)) for x in at))
        assert np.log2(errors[0] / errors[1]) == pytest.approx(order, abs=0.7)

    def test_a_run_follows_the_table(self, table):
        """xdot-dot = u over a ramp of 2 N in half a second: v = t + 2 t^2, x = t^2 / 2 + 2 t^3 / 3."""
        system = System(
            "pushed", bodies=[PointMass(name="idle", mass=1.0)],
            forces=[SecondOrder(name="cart", input="push")],
            inputs=[Input(name="push", signal=Table(file=str(table()), column="force_N"))],
        )  # fmt: skip
        run = simulate(Model(system), 0.5, SolverOptions(rtol=1e-7)).check()
        t = 0.5
        # A polynomial of degree 3 at rtol 1e-7.
        assert run.at(t).coordinate("cart.x")[0] == pytest.approx(t**2 / 2.0 + 4.0 * t**3 / 6.0, rel=1e-4)


class TestModelFiles:
    TEXT = """
name: pushed
bodies:
  - {kind: point_mass, name: idle, mass: 1.0}
forces:
  - {kind: second_order, name: cart, input: push}
inputs:
  - {name: push, signal: {kind: table, file: load.csv, column: force_N}}
"""

    def test_a_file_name_counts_from_the_model_file(self, table, tmp_path, monkeypatch):
        table()
        model = tmp_path / "model.yaml"
        model.write_text(self.TEXT)
        (tmp_path / "elsewhere").mkdir()
        monkeypatch.chdir(tmp_path / "elsewhere")
        signal = load(model).inputs[0].signal
        assert value(signal, 0.5) == pytest.approx(3.0)
        # What is dumped is found again from any folder.
        again = tmp_path / "elsewhere" / "again.yaml"
        again.write_text(dump(load(model)))
        assert load(again).inputs[0].signal == signal

    def test_an_error_names_file_line_and_element(self, table, tmp_path):
        table(GOOD.replace("3.0", ""))
        model = tmp_path / "model.yaml"
        model.write_text(self.TEXT)
        with pytest.raises(ModelError) as error:
            load(model)
        said = str(error.value)
        assert f"{model}, line 8: input 'push': signal" in said
        assert "line 3, column 'force_N': the cell is empty. Expected a number; fill the gap" in said


class TestWrongTables:
    @pytest.mark.parametrize(
        ("text", "keys", "said"),
        [
            (GOOD.replace("3.0", "three"), {}, "line 3, column 'force_N': Expected a number with a decimal point"),
            (GOOD.replace("3.0", "nan"), {}, "line 3, column 'force_N': Expected a finite number, got nan"),
            (GOOD.replace("0.5,3.0,90.0", "0.5"), {}, "line 3, column 'force_N': the cell is empty"),
            (GOOD.replace("0.5", "1.5"), {}, "line 4: the time in 'time_s' falls: 1 s behind 1.5 s"),
            (GOOD.replace("0.5", "0.0"), {}, "line 3: the time in 'time_s' stands twice: 0 s behind 0 s"),
            (GOOD, {"column": "torque_Nm"}, "column 'torque_Nm' does not exist. There are: angle_deg, force_N, time_s"),
            (GOOD, {"time": "t"}, "column 't' does not exist"),
            (GOOD, {"column": "angle_deg"}, "column 'angle_deg' seems to be in deg, and models count in SI units"),
            (GOOD, {"column": "angle_deg", "unit": "rad"}, "seems to be in deg, but unit: rad is declared"),
            (GOOD, {"unit": "furlong"}, "unit 'furlong' is not known. Allowed: "),
            (GOOD.replace("angle_deg", "force_N"), {}, "column 'force_N' stands 2 times; expected it once"),
            ("", {}, "is empty. Expected a line of column names"),
            ("time_s,force_N\n", {}, "has column names but no rows"),
            (GOOD, {"interpolation": "quintic"}, "Expected at least 6 rows for interpolation 'quintic', got 3"),
            (GOOD, {"cutoff": 1.0}, "Expected at least 16 rows to filter, got 3"),
        ],
    )
    def test_what_is_wrong_is_named(self, table, text, keys, said):
        path = table(text)
        with pytest.raises(InputError) as error:
            Table(**{"file": str(path), "column": "force_N"} | keys)
        assert said in str(error.value)
        assert "load.csv" in str(error.value)

    def test_a_hole_in_time_is_refused_unless_it_is_allowed(self, table):
        rows = "".join(f"{t:.2f},{t}\n" for t in [*np.arange(0.0, 1.0, 0.1), *np.arange(3.0, 4.0, 0.1)])
        path = table("time_s,x\n" + rows)
        with pytest.raises(InputError, match=r"line 12: nothing is known from 0.9 to 3 s, while rows are usually"):
            Table(file=str(path), column="x")
        assert value(Table(file=str(path), column="x", longest_gap=2.1), 2.0) == pytest.approx(2.0)
        with pytest.raises(InputError, match="while longest_gap is 2 s"):
            Table(file=str(path), column="x", longest_gap=2.0)

    def test_a_filter_needs_even_times_and_a_cut_off_below_what_they_hold(self, table):
        uneven = "".join(f"{t},{t}\n" for t in [*np.arange(20) * 0.1, 1.95])
        with pytest.raises(InputError, match="Expected evenly spaced times to filter, got intervals from 0.05 to 0.1"):
            Table(file=str(table("time_s,x\n" + uneven)), column="x", cutoff=1.0)
        even = "".join(f"{0.1 * k:.1f},{k}\n" for k in range(20))
        with pytest.raises(InputError, match="Expected a cutoff above 0 and below 4.5 Hz .* apart, got 6 Hz"):
            Table(file=str(table("time_s,x\n" + even)), column="x", cutoff=6.0)

    def test_a_missing_file_is_named(self, tmp_path):
        with pytest.raises(InputError, match="file '.*nothing.csv' cannot be read"):
            Table(file=str(tmp_path / "nothing.csv"), column="x")


def test_a_sample_interval_that_needs_more_memory_than_there_is():
    run = simulate(System("idle", bodies=[PointMass(name="idle", mass=1.0)]), 1.0)
    with pytest.raises(InputError, match=r"sample: 1e-13 s: 1e\+13 rows of 10 numbers take .* GiB of memory are free"):
        run.grid(1e-13)
