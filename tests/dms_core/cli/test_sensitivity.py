"""The command `sensitivity`, and a world that is linearised directly."""

from __future__ import annotations

import json

import numpy as np
import pytest

from dms_core import Model, SolverOptions, World
from dms_core.analyses.linearise import linearise
from dms_core.command_line import USER_MISTAKE
from dms_core.errors import InputError
from dms_core.files.config_files import config_file
from dms_core.model_files.model_file import load
from dms_core.sensitivity.nodes import Number
from dms_core.sensitivity.record import RecordedWorld
from dms_core.sensitivity.run import Output, Sensitivity
from tests.dms_core.analyses.mechanisms import double_pendulum
from tests.dms_core.cli.tables import read

PENDULUM = config_file("models/pendulum.yaml")


def test_table_and_numbers(command, tmp_path):
    out, stats = tmp_path / "s.csv", tmp_path / "s.json"
    done = command(
        "sensitivity", PENDULUM, "--time", 0.2, "--of", "swing.angle", "--integral-of", "swing.angle", "--by",
        "rod.mass", "hinge.point_i.0", "--out", out, "--stats", stats,
    )  # fmt: skip
    assert done.status == 0, done.err
    assert "d swing.angle / d rod.mass = " in done.out
    found = json.loads(stats.read_text())
    assert found["by"] == ["rod.mass", "hinge.point_i.0"] and found["of"] == ["swing.angle", "integral of swing.angle"]
    table = read(out)
    assert list(table["of"]) == found["of"]
    np.testing.assert_allclose(table["hinge.point_i.0"], np.array(found["derivative"])[:, 1], rtol=1e-9)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--of", "swing.angel", "--by", "rod.mass"], "'swing.angel' is no output of system"),
        (
            ["--of", "swing.angle", "--by", "rods.mass"],
            "'rods.mass' is neither a state, an input nor a declared",
        ),
        (["--of", "swing.angle", "--by", "rod.weight"], "'weight' does not exist"),
        (["--by", "rod.mass"], "--of: Expected at least one sensor or state"),
    ],
)
def test_what_is_not_there_is_named(command, tmp_path, arguments, message):
    done = command("sensitivity", PENDULUM, "--time", 0.1, *arguments, "--out", tmp_path / "s.csv")
    assert done.status == USER_MISTAKE and message in done.err
    assert not (tmp_path / "s.csv").exists()


def test_a_world_is_linearised_directly():
    model = Model(double_pendulum(1.0, (0.3, 0.1)))
    world, other = World(model), World(model)
    world.advance(0.1)
    other.advance(0.1)
    other.settle()
    np.testing.assert_array_equal(linearise(world).A, linearise(model, other.operating_point(behind=True)).A)
    with pytest.raises(InputError, match="Expected an operating point with a model, or a world alone"):
        linearise(model)
    with pytest.raises(InputError, match="Expected a world alone"):
        linearise(world, other.operating_point())


def test_command_and_call_agree(command, tmp_path):
    out = tmp_path / "s.csv"
    assert command("sensitivity", PENDULUM, "--time", 0.2, "--of", "swing.angle", "--by", "rod.mass", "--out", out,
                   "--method", "sdirk2").status == 0  # fmt: skip
    world = RecordedWorld(load(PENDULUM), SolverOptions(method="sdirk2"))
    world.advance(0.2)
    found = Sensitivity(world, [Output("swing.angle")], [Number("rod", "mass")]).forward()
    np.testing.assert_allclose(read(out)["rod.mass"], found[:, 0], rtol=1e-8, atol=1e-12)
