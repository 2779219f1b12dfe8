"""Events: runs that end where a sensor passes a value."""

from __future__ import annotations

import math

import numpy as np
import pytest

from dms_core.__main__ import main
from dms_core.assembly.model import Model
from dms_core.errors import InputError
from dms_core.model import Gravity, Input, Point, PointMass, SpringDamper, System
from dms_core.simulation.dynamics import Simulation, SolverOptions, World
from dms_core.simulation.events import Crossing


def oscillator() -> Model:
    """A mass on a spring about the origin along x: x = cos t."""
    mass = PointMass(name="mass", mass=1.0, position=(1.0, 0.0, 0.0))
    spring = SpringDamper(name="spring", body_j="mass", point_i=(-2.0, 0.0, 0.0), stiffness=1.0, free_length=2.0)
    return Model(System("oscillator", bodies=[mass], forces=[spring], sensors=[Point(name="at", body="mass")]))


X = "at.position.x"


@pytest.mark.parametrize(
    ("crossing", "times"),
    [
        (Crossing(X, -1), [0.5, 2.5, 4.5]),
        (Crossing(X, 1), [1.5, 3.5]),
        (Crossing(X, 0), [0.5, 1.5, 2.5]),
        (Crossing(X, -1, 0.5), [1.0 / 3.0, 7.0 / 3.0]),
        (Crossing("at.velocity.x", 1), [1.0, 3.0]),
    ],
)
@pytest.mark.parametrize("method", ["bdf2", "sdirk2"])
def test_a_run_ends_on_each_crossing(crossing, times, method):
    world = World(oscillator(), SolverOptions(rtol=1e-8, method=method))
    found = []
    for _ in times:
        assert world.advance(20.0, stop_at=crossing).name == "SUCCESS"
        assert world.crossing == crossing
        found.append(world.time)
    # Times in units of pi; the run itself errs by some 1e-6 in phase.
    assert np.array(found) / math.pi == pytest.approx(times, abs=1e-5)


def test_the_first_of_several_crossings_ends_the_step():
    """Steps are long, so that both lie within one: the later one comes in the next call."""
    fall = PointMass(name="stone", mass=1.0, position=(0.0, 1.0, 0.0))
    forces = [Gravity(name="weight", acceleration=(0.0, -2.0, 0.0))]
    model = Model(System("fall", bodies=[fall], forces=forces, sensors=[Point(name="at", body="stone")]))
    world = World(model, SolverOptions(rtol=1e-6, h_max=10.0))
    crossings = [Crossing("at.position.y", -1, value) for value in (0.49, 0.51)]
    for drop, wanted in ((0.49, crossings[1]), (0.51, crossings[0])):
        assert world.advance(5.0, stop_at=crossings).name == "SUCCESS"
        assert world.crossing == wanted
        assert world.time == pytest.approx(math.sqrt(drop), rel=1e-8)
    assert world.advance(5.0, stop_at=crossings).name == "SUCCESS"
    assert world.crossing is None and world.time == 5.0


def test_the_record_of_a_run_goes_through_its_events():
    simulation = Simulation(oscillator(), SolverOptions(rtol=1e-7))
    events = []
    while simulation.time < 10.0:
        simulation.advance(10.0, stop_at=Crossing(X, 0))
        events.append(simulation.time)
    run = simulation.trajectory()
    assert np.all(np.diff(run.t) >= 0.0) and run.t[0] == 0.0 and run.t[-1] == 10.0
    assert set(events) <= set(run.t.tolist())
    t = np.linspace(0.0, 10.0, 301)
    assert np.abs(run.at(t).coordinate("mass.x") - np.cos(t)).max() < 1e-4


def test_a_time_without_an_event_is_reached():
    world = World(oscillator(), SolverOptions(rtol=1e-6))
    assert world.advance(1.0, stop_at=Crossing(X)).name == "SUCCESS"
    assert world.time == 1.0 and world.crossing is None
    assert world.advance(2.0).name == "SUCCESS" and world.crossing is None


def test_a_jump_of_an_input_counts_where_the_sensor_stands_behind_it():
    """An acceleration that jumps through its value passes it at the end of the step behind the jump."""
    from dms_core.model import LumpedLoad, Steps

    mass = PointMass(name="mass", mass=1.0)
    push = LumpedLoad(name="push", body="mass", force=(1.0, 0.0, 0.0), input="u")
    signal = Steps(times=(0.0, 0.5), values=(1.0, -1.0))
    model = Model(
        System("x", bodies=[mass], forces=[push], inputs=[Input(name="u", signal=signal)],
               sensors=[Point(name="at", body="mass")])
    )  # fmt: skip
    world = World(model)
    world.advance(1.0, stop_at=Crossing("at.acceleration.x"))
    assert 0.5 <= world.time < 0.6


def test_the_command_line_stops_at_a_touch_down(tmp_path, capsys):
    """A ball that falls by 0.5 m: sqrt(2 h / g)."""
    model, out = tmp_path / "ball.yaml", tmp_path / "ball.csv"
    model.write_text(
        "bodies: [{kind: point_mass, name: ball, mass: 1.0, position: [0.0, 0.5, 0.0]}]\n"
        "forces:\n  - {kind: gravity, name: weight}\n"
        "  - {kind: sphere_contact, name: touch, body_j: ball, stiffness: 1e6, restitution: 0.8}\n"
        "sensors: [{kind: contact_sensor, name: sense, contact: touch}]\n"
    )
    command = ["run", str(model), "--t-end", "2", "--out", str(out)]
    assert main([*command, "--stop-at", "sense.gap"]) == 0
    assert "The run ended where 'sense.gap' passed 0." in capsys.readouterr().out
    last = float(out.read_text().splitlines()[-1].split(",")[0])
    assert last == pytest.approx(math.sqrt(2.0 * 0.5 / 9.80665), rel=1e-6)
    assert main([*command, "--overwrite", "--stop-at", "sense.gep"]) == 2
    assert "stop_at: sensor component 'sense.gep' does not exist" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("crossing", "complaint"),
    [
        (Crossing("at.x"), r"stop_at: sensor component 'at.x' does not exist. Declared: at.acceleration.x"),
        (Crossing(X, 2), "way: Expected -1, 0 or 1, got 2"),  # type: ignore[arg-type]
        (Crossing(X, 1, math.nan), "value: Expected a finite number, got nan"),
    ],
)
def test_wrong_events_are_refused(crossing, complaint):
    with pytest.raises(InputError, match=complaint):
        World(oscillator()).advance(1.0, stop_at=crossing)
