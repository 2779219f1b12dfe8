"""The command that drives the bare arm: runs A and A2 of the reference, and tables that are wrong."""

import csv

import numpy as np
import pytest

from exo_env.__main__ import main
from exo_env.ecosystem.arm import Arm
from tests.arm26 import REFERENCE

TOLERANCES = {
    "elbow_flexion_rad": 1e-5,
    "elbow_speed_rad_per_s": 1e-4,
    "_activation": 1e-6,
    "_fibre_length_m": 1e-6,
    "_tendon_force_N": 0.05,
    "_muscle_tendon_length_m": 1e-6,
    "_N": 0.1,
    "_Nm": 0.01,
    # Not in the reference's list: an acceleration is the slope of a speed between steps of a millisecond.
    "elbow_acceleration_rad_per_s2": 2e-3,
}
"""By the end of a column's name, as the reference's README asks for; the first that fits counts."""


MUSCLES, FLEXORS = Arm().muscles, ("BIClong", "BICshort", "BRA")


def excitations(path, *, flexors: float, header=("time_s", *MUSCLES), **changes):
    row = {"time_s": 0.0, **{m: flexors if m in FLEXORS else 0.05 for m in MUSCLES}, **changes}
    path.write_text(",".join(header) + "\n" + ",".join(str(row.get(name, 0.1)) for name in header) + "\n")
    return path


def run(folder, table, t_end: float) -> dict[str, np.ndarray]:
    out = folder / "out.csv"
    arguments = ["--excitations", table, "--start-deg", 20, "--start-activation", 0.05, "--t-end", t_end]
    arguments += ["--rtol", 1e-8, "--sample", 0.01, "--out", out]
    assert main(["arm26", *map(str, arguments)]) == 0
    return read(out)


def read(path) -> dict[str, np.ndarray]:
    with path.open(newline="") as file:
        header, *rows = csv.reader(file)
    return dict(zip(header, np.array(rows, float).T, strict=True))


@pytest.mark.parametrize(("name", "flexors", "t_end"), [("A", 0.15, 1.0), ("A2", 0.30, 0.45)])
def test_reference_runs(tmp_path, name, flexors, t_end):
    ours = run(tmp_path, excitations(tmp_path / "in.csv", flexors=flexors), t_end)
    theirs = read(REFERENCE / f"arm26_forward_{name}.csv")
    assert list(ours) == list(theirs)
    for column, values in theirs.items():
        tolerance = next((x for end, x in TOLERANCES.items() if column.endswith(end)), 1e-12)
        np.testing.assert_allclose(ours[column], values, atol=tolerance, rtol=0.0, err_msg=column)


def test_rows_hold_until_the_next(tmp_path):
    lines = ["time_s," + ",".join(MUSCLES), "0" + ",0.05" * 6, "0.1" + ",0.05" * 3 + ",0.4" * 3]
    (tmp_path / "in.csv").write_text("\n".join(lines) + "\n")
    y = run(tmp_path, tmp_path / "in.csv", 0.2)
    before = y["time_s"] <= 0.1
    # Activation starts at the excitation and stays until the jump, then follows within 4 time constants.
    np.testing.assert_allclose(y["BRA_activation"][before], 0.05, atol=1e-9)
    assert y["BRA_activation"][-1] > 0.38
    np.testing.assert_allclose(y["TRIlong_activation"], 0.05, atol=1e-9)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("time_s,TRIlong\n0,0.1\n", "missing columns: BIClong, BICshort, BRA, TRIlat, TRImed"),
        ("time_s,biceps\n0,0.1\n", "unknown column 'biceps'"),
        ("", "missing columns"),
        ("{header}\n", "holds no row"),
        ("{header}\n0,nan,0.1,0.1,0.1,0.1,0.1\n", "line 2, column 'TRIlong': 'nan' is no finite number"),
        ("{header}\n0,0.1,0.1,0.1,0.1,0.1,much\n", "line 2, column 'BRA': 'much' is no finite number"),
        ("{header}\n0,0.1,0.1,0.1,0.1,0.1,1.5\n", "line 2, column 'BRA': 1.5 is not within 0 to 1"),
        ("{header}\n0,0.1,0.1\n", "line 2: 3 cells, but 7 columns"),
        ("{header}\n1{row}\n1{row}\n", "time_s must increase from row to row, but 1 is followed by 1"),
    ],
)
def test_a_wrong_table_is_named(tmp_path, capsys, text, message):
    table, out = tmp_path / "in.csv", tmp_path / "out.csv"
    table.write_text(text.format(header=",".join(("time_s", *MUSCLES)), row=",0.1" * 6))
    assert main(["arm26", "--excitations", str(table), "--t-end", "0.1", "--out", str(out)]) == 2
    error = capsys.readouterr().err
    assert message in error and str(table) in error
    assert not out.exists()


@pytest.mark.parametrize(
    ("option", "value", "message"),
    [
        ("--t-end", "-1", "--t-end -1.0: expected a time above 0 s"),
        ("--sample", "0", "--sample 0.0: expected a time above 0 s"),
        ("--rtol", "0", "rtol: Expected a positive number, got 0.0"),
        ("--start-activation", "0", "a number from 0.01 to 1"),
        ("--start-deg", "400", "--start-deg 400.0: expected an angle"),
    ],
)
def test_an_option_out_of_range_is_named(tmp_path, capsys, option, value, message):
    table = excitations(tmp_path / "in.csv", flexors=0.1)
    options = {"--t-end": "0.1", option: value}
    given = [x for pair in options.items() for x in pair]
    assert main(["arm26", "--excitations", str(table), "--out", str(tmp_path / "out.csv"), *given]) == 2
    assert message in capsys.readouterr().err
    assert not (tmp_path / "out.csv").exists()
