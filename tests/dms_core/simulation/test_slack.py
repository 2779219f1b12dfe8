"""Ropes of fixed length that go slack: free fall between two swings, an Atwood machine that is stopped, the record."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest

from dms_core.__main__ import main
from dms_core.assembly.model import Model
from dms_core.errors import InputError, ModelError
from dms_core.model import (
    Constant,
    Distance,
    Gravity,
    Input,
    LumpedLoad,
    PathPoint,
    PointMass,
    RopeLength,
    RopeSensor,
    Steps,
    System,
)
from dms_core.simulation.dynamics import SolverOptions, World, new_simulation, simulate
from dms_core.simulation.events import Crossing

G, LENGTH = 9.81, 0.75
WEIGHT = Gravity(name="weight", acceleration=(0.0, -G, 0.0))


def swing(position, velocity=(0.0, 0.0, 0.0), **rope) -> System:
    """A mass on a rope from the origin."""
    path = (PathPoint(point=(0.0, 0.0, 0.0)), PathPoint(body="mass", point=(0.0, 0.0, 0.0)))
    return System(
        "swing", bodies=[PointMass(name="mass", mass=2.0, position=position, velocity=velocity)],
        constraints=[RopeLength(name="rope", path=path, **({"unilateral": True} | rope))], forces=[WEIGHT],
        sensors=[RopeSensor(name="cell", rope="rope", components=("length", "tension"))],
    )  # fmt: skip


def test_released_above_its_anchor_a_mass_falls_freely_and_swings_on_with_what_the_impact_leaves():
    """Fall until x^2 + y^2 = L^2 again, at y = -y0; the speed along the rope is lost, and energy is kept from there."""
    y0 = 0.45
    x0 = math.sqrt(LENGTH**2 - y0**2)
    run = simulate(swing((x0, y0, 0.0)), 0.8, SolverOptions(rtol=1e-8)).check()
    taut = math.sqrt(4.0 * y0 / G)
    t = np.linspace(0.0, 0.8, 401)
    at, y = run.at(t), run.sensors(t)
    x, h = at.coordinate("mass.x"), at.coordinate("mass.y")
    before, behind = t < taut, t > taut
    assert np.abs(x[before] - x0).max() < 1e-9 and np.abs(h[before] - (y0 - 0.5 * G * t[before] ** 2)).max() < 1e-7
    assert np.all(y["cell.tension"][before] == 0.0) and np.all(y["cell.tension"][behind] > 0.0)
    assert np.abs(np.hypot(x, h)[behind] - LENGTH).max() < 1e-7
    # The time of the impact stands twice in the record, to the digits of the run.
    twice = run.t[1:][np.diff(run.t) == 0.0]
    assert twice[-1] == pytest.approx(taut, rel=1e-8)
    along = G * taut * x0 / LENGTH
    speed2 = at.rate("mass.x")[behind] ** 2 + at.rate("mass.y")[behind] ** 2
    assert speed2 == pytest.approx(along**2 + 2.0 * G * (-y0 - h[behind]), rel=1e-6)
    assert run.flags == () and run.stats.largest_phi < 1e-9


def test_it_goes_slack_where_the_swing_is_too_slow():
    """From below with v0^2 between 2 g L and 5 g L the tension is 0 at cos a = (2 g L - v0^2) / (3 g L) from below."""
    v0 = math.sqrt(3.5 * G * LENGTH)
    run = simulate(swing((0.0, -LENGTH, 0.0), (v0, 0.0, 0.0)), 1.0, SolverOptions(rtol=1e-8)).check()
    first = run.t[1:][np.diff(run.t) == 0.0][0]
    at = run.at([first])
    cosine = -at.coordinate("mass.y")[0] / LENGTH
    assert cosine == pytest.approx((2.0 * G * LENGTH - v0**2) / (3.0 * G * LENGTH), abs=1e-5)
    # The tension falls to 0 without a jump, and a parabola follows.
    y = run.sensors([first - 1e-3, first + 1e-3])["cell.tension"]
    assert 0.0 < y[0] < 1.0 and y[1] == 0.0
    vx, vy = at.rate("mass.x")[0], at.rate("mass.y")[0]
    later = run.at([first + 0.1])
    assert later.coordinate("mass.x")[0] - at.coordinate("mass.x")[0] == pytest.approx(0.1 * vx, abs=1e-8)
    assert later.coordinate("mass.y")[0] - at.coordinate("mass.y")[0] == pytest.approx(0.1 * vy - 0.005 * G, abs=1e-7)


def test_between_the_long_steps_of_radau_it_is_as_good_as_on_them():
    """Some sixty steps, ten times as long as a cubic is good for: length, and tension m (v^2 - g h) / L."""
    y0 = 0.45
    x0 = math.sqrt(LENGTH**2 - y0**2)
    run = simulate(swing((x0, y0, 0.0)), 0.8, SolverOptions(rtol=1e-9, method="radau5")).check()
    assert len(run.t) < 100
    taut, t = math.sqrt(4.0 * y0 / G), np.linspace(0.0, 0.8, 401)
    at, tension = run.at(t), run.sensors(t)["cell.tension"]
    x, h = at.coordinate("mass.x"), at.coordinate("mass.y")
    before, behind = t < taut, t > taut
    assert np.abs(h[before] - (y0 - 0.5 * G * t[before] ** 2)).max() < 1e-12
    assert np.all(tension[before] == 0.0) and np.abs(at.a[before] - [0.0, -G, 0.0]).max() < 1e-12
    # A cubic errs by 1.7e-8 m, and linear multipliers by 1e-2 N.
    assert np.abs(np.hypot(x, h)[behind] - LENGTH).max() < 1e-9
    speed2 = at.rate("mass.x") ** 2 + at.rate("mass.y") ** 2
    assert tension[behind] == pytest.approx((2.0 * (speed2 - G * h) / LENGTH)[behind], abs=1e-7)
    # At the event itself the values are those before it.
    event = run.t[1:][np.diff(run.t) == 0.0][-1]
    assert run.sensors([event])["cell.tension"][0] == 0.0


def test_a_bilateral_rope_pushes_and_is_flagged():
    run = simulate(swing((0.6, 0.45, 0.0), unilateral=False), 1.0, SolverOptions(rtol=1e-6)).check()
    assert [f.element for f in run.flags] == ["rope"] and run.flags[0].worst < -5.0
    assert "its tension was negative, where a real rope would be slack" in run.message


def atwood(push: Input) -> System:
    """1 kg and 2 kg over two points; the second is stopped for a while by a push upwards."""
    path = (
        PathPoint(body="a", point=(0.0, 0.0, 0.0)), PathPoint(point=(0.0, 0.0, 0.0)), PathPoint(point=(1.0, 0.0, 0.0)),
        PathPoint(body="b", point=(0.0, 0.0, 0.0)),
    )  # fmt: skip
    bodies = [PointMass(name="a", mass=1.0, position=(0.0, -2.0, 0.0)),
              PointMass(name="b", mass=2.0, position=(1.0, -1.0, 0.0))]  # fmt: skip
    load = LumpedLoad(name="load", body="b", force=(0.0, 1.0, 0.0), input="push")
    return System(
        "atwood", bodies=bodies, constraints=[RopeLength(name="rope", path=path, unilateral=True)],
        forces=[WEIGHT, load], inputs=[push], sensors=[RopeSensor(name="cell", rope="rope", components=("tension",))],
    )  # fmt: skip


def test_an_atwood_machine_is_stopped_and_taken_up_again():
    """a = g / 3, then b is held back by 100 N for 20 ms: both fly until the rope is taut, and an impact joins them."""
    push = Input(name="push", signal=Steps(times=(0.0, 0.3, 0.32), values=(0.0, 100.0, 0.0)))
    run = simulate(atwood(push), 1.0, SolverOptions(rtol=1e-8)).check()
    v = 0.3 * G / 3.0
    at = run.at([0.3, 0.32])
    assert at.rate("a.y")[0] == pytest.approx(v, rel=1e-6) and at.rate("b.y")[0] == pytest.approx(-v, rel=1e-6)
    tension = run.sensors([0.15, 0.31])["cell"]
    assert tension[0] == pytest.approx(4.0 / 3.0 * G, rel=1e-6) and tension[1] == 0.0
    # Behind 0.32 both fall freely; the sum of both heights says how long the path is.
    va, vb = v - 0.02 * G, -v + 0.02 * (50.0 - G)
    assert at.rate("a.y")[1] == pytest.approx(va, rel=1e-6) and at.rate("b.y")[1] == pytest.approx(vb, rel=1e-6)
    slack = 0.02 * v - 0.5 * G * 0.02**2 - 0.02 * v + 0.5 * (50.0 - G) * 0.02**2
    # -(a + b) grows by slack again: slack + (va + vb) t - g t^2 = 0.
    t = ((va + vb) + math.sqrt((va + vb) ** 2 + 4.0 * G * slack)) / (2.0 * G)
    twice = run.t[1:][np.diff(run.t) == 0.0]
    assert twice[-1] == pytest.approx(0.32 + t, rel=1e-7)
    # The impact's impulse P pulls both up: va + P / 1 and vb + P / 2 with a sum of 0.
    ua, ub = va - G * t, vb - G * t
    impulse = -(ua + ub) / 1.5
    behind = run.own_steps()
    k = int(np.flatnonzero(run.t == twice[-1])[-1])
    assert impulse > 0.0
    assert behind.v[k, 1] == pytest.approx(ua + impulse, rel=1e-6)
    assert behind.v[k, 4] == pytest.approx(ub + 0.5 * impulse, rel=1e-6)
    assert run.sensors([0.99])["cell"][0] == pytest.approx(4.0 / 3.0 * G, rel=1e-6)


def test_two_ropes_of_which_one_is_let_go_at_a_jump_of_an_input():
    """A mass on two ropes of different anchors is pushed aside; each phase has the ropes that pull."""
    one = (PathPoint(point=(0.0, 0.0, 0.0)), PathPoint(body="mass", point=(0.0, 0.0, 0.0)))
    other = (PathPoint(point=(0.4, 0.0, 0.0)), PathPoint(body="mass", point=(0.0, 0.0, 0.0)))
    mass = PointMass(name="mass", mass=1.0, position=(0.2, -0.6, 0.0))
    push = LumpedLoad(name="load", body="mass", force=(1.0, 0.0, 0.0), input="push")
    system = System(
        "two", bodies=[mass], forces=[WEIGHT, push],
        inputs=[Input(name="push", signal=Steps(times=(0.0, 0.1), values=(0.0, 12.0)))],
        constraints=[RopeLength(name="one", path=one, unilateral=True),
                     RopeLength(name="other", path=other, unilateral=True)],
        sensors=[RopeSensor(name="a", rope="one", components=("length", "tension")),
                 RopeSensor(name="b", rope="other", components=("length", "tension"))],
    )  # fmt: skip
    run = simulate(system, 1.5, SolverOptions(rtol=1e-7)).check()
    y = run.sensors(run.t)
    longest = math.hypot(0.2, 0.6)
    for name in ("a", "b"):
        assert y[f"{name}.tension"].min() > -1e-3 and y[f"{name}.length"].max() < longest + 1e-7
        # What is slack pulls nothing, and what pulls is taut.
        assert np.all((y[f"{name}.tension"] < 1e-3) | (y[f"{name}.length"] > longest - 1e-7))
    # Pushed away from the first anchor it swings on that rope alone.
    assert np.all(y["a.tension"] > 0.0) and np.all(y["b.tension"][run.t < 0.1] > 0.0)
    assert np.all(y["b.tension"][run.t > 0.1] == 0.0)


def test_without_slackness_it_is_the_run_of_a_bilateral_rope():
    options = SolverOptions(rtol=1e-7, fixed_step=1e-3)
    one = simulate(swing((0.6, -0.45, 0.0)), 1.0, options).check()
    other = simulate(swing((0.6, -0.45, 0.0), unilateral=False), 1.0, options).check()
    np.testing.assert_allclose(one.q[-1], other.q[-1], atol=1e-9)


def test_a_world_that_is_advanced_by_hand_is_refused():
    with pytest.raises(ModelError, match="rope_length 'rope': unilateral = true: its phases are solved by `simulate`"):
        World(Model(swing((0.6, -0.45, 0.0))))


def test_events_of_the_user_are_refused():
    with pytest.raises(InputError, match="stop_at: Expected no event in a run with ropes that may go slack"):
        new_simulation(swing((0.6, -0.45, 0.0))).advance(1.0, stop_at=[Crossing("cell.length")])


def test_a_rope_that_is_slack_at_the_start_is_refused():
    with pytest.raises(ModelError, match="rope_length 'rope': length = 0.76 m: Expected at most 0.75 m"):
        simulate(swing((0.6, -0.45, 0.0), length=0.76), 1.0)


def test_the_length_may_be_an_input_and_joints_may_be_in_between():
    """A mass on a rod and a rope whose length shrinks: taut from the start, it lifts the rod."""
    path = (PathPoint(point=(0.0, 1.0, 0.0)), PathPoint(body="mass", point=(0.0, 0.0, 0.0)))
    mass = PointMass(name="mass", mass=1.0, position=(0.8, 0.0, 0.0))
    constraints = [
        Distance(name="rod", body_j="mass"), RopeLength(name="rope", path=path, input="psi", unilateral=True)
    ]  # fmt: skip
    start = math.hypot(0.8, 1.0)
    system = System(
        "lift", bodies=[mass], constraints=constraints, forces=[WEIGHT],
        inputs=[Input(name="psi", signal=Constant(value=start))],
    )  # fmt: skip
    run = simulate(system, 0.5, SolverOptions(rtol=1e-7)).check()
    assert np.abs(np.hypot(run.q[:, 0], run.q[:, 1] - 1.0) - start).max() < 1e-9


def test_the_command_line_solves_phases_and_says_what_pushes(tmp_path, capsys):
    model = tmp_path / "swing.yaml"
    for unilateral, said in (("true", False), ("false", True)):
        model.write_text(
            "bodies: [{kind: point_mass, name: mass, mass: 2.0, position: [0.6, 0.45, 0.0]}]\n"
            "forces: [{kind: gravity, name: weight}]\n"
            "constraints: [{kind: rope_length, name: rope, unilateral: " + unilateral + ", path: "
            "[{point: [0, 0, 0]}, {body: mass, point: [0, 0, 0]}]}]\n"
        )
        out, stats = tmp_path / f"{unilateral}.csv", tmp_path / f"{unilateral}.json"
        assert main(["run", str(model), "--t-end", "1.0", "--out", str(out), "--stats", str(stats)]) == 0
        printed = capsys.readouterr().out
        assert ("its tension was negative, where a real rope would be slack" in printed) == said
        assert bool(json.loads(stats.read_text())["flags"]) == said
        assert out.read_text().count("\n") > 20
