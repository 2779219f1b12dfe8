"""A world put back goes on as the one it was taken of, to the last bit: jumps, reorders, other processes."""

from __future__ import annotations

import pickle
import subprocess
import sys
from dataclasses import FrozenInstanceError, replace
from pathlib import Path

import numpy as np
import pytest

from dms_core.assembly.model import Model
from dms_core.assembly.tables import Work
from dms_core.errors import InputError
from dms_core.model import (
    Constant,
    Gravity,
    Input,
    JointAngle,
    LumpedLoad,
    MuscleSensor,
    Revolute,
    RigidBody,
    Steps,
    System,
)
from dms_core.simulation.dynamics import Simulation, SolverOptions, World
from dms_core.simulation.events import Crossing
from dms_core.simulation.snapshot import GLOBAL_WORK, held_arrays
from tests.dms_core.assembly.specimen import specimen

METHODS = ("bdf2", "sdirk2", "radau5")
LOCAL_WORK = {
    "q_l", "v_l", "a_l", "lam_l", "u_l", "r_l", "Jq", "Jv", "Ja", "phi_l", "phi_t_l", "G", "W", "H", "y_l", "Yq", "Yv",
    "Ya", "Yl", "Yu", "Ju",
}  # fmt: skip


def pendulum(mass: float = 2.0, name: str = "pendulum") -> System:
    """A rod under gravity, a load that jumps by itself and one that is set."""
    return System(
        name,
        bodies=[RigidBody(name="rod", mass=mass, inertia=(0.2, 0.01, 0.2), centre_of_mass=(0.0, -0.5, 0.0))],
        constraints=[Revolute(name="hinge", body_j="rod")],
        forces=[
            Gravity(name="gravity"),
            LumpedLoad(name="gust", body="rod", point=(0.0, -1.0, 0.0), force=(3.0, 0.0, 0.0), input="wind"),
            LumpedLoad(name="push", body="rod", point=(0.0, -1.0, 0.0), force=(1.0, 0.0, 0.0), input="hand"),
        ],
        sensors=[JointAngle(name="angle", joint="hinge")],
        inputs=[
            Input(name="wind", signal=Steps(times=(0.0, 0.3, 0.7), values=(0.0, 1.0, -1.0))),
            Input(name="hand", signal=Constant(value=0.5)),
        ],
    )


@pytest.fixture(scope="module")
def hanging() -> Model:
    return Model(pendulum())


@pytest.fixture(scope="module")
def everything() -> Model:
    return specimen(MuscleSensor(name="muscle", muscle="biceps", components=("tendon_force",)))


def _go_on(world: World, inputs: str, until: float) -> list[bytes]:
    """Bits of a world after each of several stretches with a jump between them, and its counts."""
    bits = []
    for k, t in enumerate(np.linspace(world.time, until, 4)[1:]):
        world.set_input(inputs, 0.4 + k)
        world.advance(float(t))
        bits += [*(x.tobytes() for x in held_arrays(world.state)), world.read().tobytes(), str(world.stats()).encode()]
    return bits


def _world(model: Model, method: str) -> World:
    return World(model, SolverOptions(method=method))  # type: ignore[arg-type]


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("prepare", ["start", "moving", "landed on a jump", "input set", "settled", "reordered"])
def test_going_on_gives_the_same_bits(hanging, method, prepare):
    world = _world(hanging, method)
    if prepare != "start":
        world.advance(0.3 if prepare == "landed on a jump" else 0.4)
    if prepare in ("input set", "settled"):
        world.set_input("hand", -2.0)
    if prepare == "settled":
        world.settle()
    if prepare == "reordered":
        assert world.reorder()
        world.advance(0.45)
    past = world.snapshot()
    first = _go_on(world, "hand", 1.0)
    world.restore(past)
    assert world.snapshot() == past
    assert world.time == past.time
    assert _go_on(world, "hand", 1.0) == first
    other = _world(hanging, method)
    other.advance(0.123)
    other.restore(pickle.loads(pickle.dumps(past)))
    assert _go_on(other, "hand", 1.0) == first


@pytest.mark.parametrize("reordered", [False, True])
@pytest.mark.parametrize("method", METHODS)
def test_muscles_controllers_and_welds_go_on_alike(everything, method, reordered):
    world = _world(everything, method)
    world.advance(0.02)
    if reordered:
        assert world.reorder()
        world.advance(0.03)
    past = world.snapshot()
    first = _go_on(world, "command", 0.05)
    other = _world(everything, method)
    other.restore(past)
    assert _go_on(other, "command", 0.05) == first


def test_back_to_before_a_reorder(hanging):
    world = _world(hanging, "bdf2")
    world.advance(0.2)
    past = world.snapshot()
    first = _go_on(world, "hand", 0.5)
    world.reorder()
    world.advance(0.6)
    world.restore(past)
    assert world.tables is hanging.tables
    assert _go_on(world, "hand", 0.5) == first


@pytest.mark.parametrize("method", METHODS)
def test_rewound_to_a_mark_before_a_reorder(hanging, method):
    """As `restore`, in the same world; what had been recorded until then stays."""
    world = Simulation(hanging, SolverOptions(method=method))
    world.advance(0.2)
    past, recorded = world.mark(), world.record()
    first = _go_on(world, "hand", 0.5)
    assert world.reorder()
    world.advance(0.6)
    world.rewind(past)
    assert world.tables is hanging.tables
    np.testing.assert_array_equal(world.record(), recorded)
    assert _go_on(world, "hand", 0.5) == first


def test_arrays_stay_where_they_are(hanging):
    """Compiled code that holds the addresses of a world goes on to see it."""
    world = _world(hanging, "sdirk2")
    past, packed, q = world.snapshot(), world.packed, world.state.q
    world.advance(0.1)
    world.restore(past)
    assert world.packed is packed
    assert world.state.q is q


def test_worlds_of_one_model_do_not_share_what_a_snapshot_restores(hanging):
    one, other = _world(hanging, "bdf2"), _world(hanging, "bdf2")
    before = [x.tobytes() for x in held_arrays(other.state)]
    for array in held_arrays(one.state):
        array[...] = 1
    assert [x.tobytes() for x in held_arrays(other.state)] == before


def test_another_process_goes_on_alike(hanging, tmp_path):
    world = _world(hanging, "bdf2")
    world.advance(0.4)
    path = tmp_path / "world.pickle"
    path.write_bytes(pickle.dumps(world.snapshot()))
    code = (
        "import pickle, sys; from pathlib import Path; from tests.dms_core.simulation import test_snapshot as t\n"
        "world = t._world(t.Model(t.pendulum()), 'bdf2')\n"
        "world.restore(pickle.loads(Path(sys.argv[1]).read_bytes())); world.advance(1.0)\n"
        "print(world.state.q.tobytes().hex())"
    )
    root = Path(__file__).parents[3]
    done = subprocess.run([sys.executable, "-c", code, str(path)], cwd=root, capture_output=True, text=True, check=True)
    world.advance(1.0)
    assert done.stdout.strip() == world.state.q.tobytes().hex()


def test_a_snapshot_cannot_be_changed(hanging):
    world = _world(hanging, "bdf2")
    past = world.snapshot()
    with pytest.raises(FrozenInstanceError):
        past.time = 3.0
    world.advance(0.1)
    assert world.snapshot() != past
    assert past == _world(hanging, "bdf2").snapshot()


def test_another_model_is_refused_by_name(hanging, everything):
    past = _world(hanging, "bdf2").snapshot()
    with pytest.raises(InputError, match="system 'pendulum' at t = 0 s cannot be restored in .* system 'specimen'"):
        _world(everything, "bdf2").restore(past)
    heavier = Model(pendulum(2.5, name="heavier"))
    with pytest.raises(InputError, match=r"system 'pendulum' .* system 'heavier' whose numbers .* differ"):
        _world(heavier, "bdf2").restore(past)


def test_another_method_is_refused(hanging):
    past = _world(hanging, "bdf2").snapshot()
    with pytest.raises(InputError, match="was taken with method = 'bdf2'; this world has method = 'sdirk2'"):
        _world(hanging, "sdirk2").restore(past)


def test_numbers_written_in_place_make_another_model():
    model = Model(pendulum())
    world = _world(model, "bdf2")
    past = world.snapshot()
    model.numbers[0][0] *= 1.1
    with pytest.raises(InputError, match="whose numbers .* differ"):
        world.restore(past)


def test_a_simulation_records_from_the_restored_time_on(hanging):
    options = SolverOptions(rtol=1e-6)
    simulation = Simulation(hanging, options)
    simulation.advance(0.5)
    past = simulation.snapshot()
    simulation.set_input("hand", 4.0)
    simulation.advance(1.0)
    whole = simulation.trajectory()
    simulation.restore(past)
    simulation.set_input("hand", 4.0)
    simulation.advance(1.0)
    again = simulation.trajectory()
    behind = whole.t > 0.5
    np.testing.assert_array_equal(again.q[again.t > 0.5], whole.q[behind])
    assert again.t[0] == 0.5
    np.testing.assert_array_equal(again.sensors()["angle.angle"][-1], whole.sensors()["angle.angle"][-1])


def test_every_array_of_a_world_is_held_or_local(hanging):
    assert set(Work._fields) == LOCAL_WORK | set(GLOBAL_WORK)
    state = _world(hanging, "radau5").state
    held = {id(x) for x in held_arrays(state)}
    left_out = {name for name, x in zip(state._fields, state, strict=True) if id(x) not in held}
    # `parts` are addresses of machine code, the same for all worlds of a process.
    assert left_out <= {"w", "signals", "parts", "radau"}
    assert {id(x) for x in state.radau.values} <= held


@pytest.mark.parametrize("reordered", [False, True])
@pytest.mark.parametrize("method", ["bdf2", "radau5"])
@pytest.mark.parametrize(
    ("damaged", "complaint"),
    [
        (lambda s: replace(s, arrays=s.arrays[:-1]), r"at t = 0.1 s is damaged: expected \d+ arrays, got \d+"),
        (
            lambda s: replace(s, arrays=(*s.arrays[:1], s.arrays[1][:8], *s.arrays[2:])),
            r"damaged: expected \d+ bytes of 'w.v', got 8",
        ),
        (lambda s: replace(s, orders=None), "damaged: expected orders of elimination, got NoneType"),
    ],
)
def test_a_damaged_snapshot_is_refused_before_anything_is_written(hanging, damaged, complaint, method, reordered):
    world = _world(hanging, method)
    world.advance(0.1)
    past = world.snapshot()
    world.advance(0.2)
    assert not reordered or world.reorder()
    # A pivot is known and the factors are in use: what a change of the order forgets.
    world.advance(0.21)
    before = [x.tobytes() for x in held_arrays(world.state)]
    with pytest.raises(InputError, match=complaint):
        world.restore(damaged(past))
    assert [x.tobytes() for x in held_arrays(world.state)] == before


@pytest.mark.parametrize("method", METHODS)
def test_a_world_that_stands_on_an_event_does_so_when_it_is_put_back(hanging, method):
    """It passes the same value again only after it has left it, as the world it was taken of."""
    event, options = Crossing("angle.angle", way=0, value=0.02), SolverOptions(rtol=1e-6, method=method)
    world = World(hanging, options)
    world.advance(0.7, stop_at=event)
    assert world.crossing == event
    past = pickle.loads(pickle.dumps(world.snapshot()))
    assert past == world.snapshot() and past.ending.crossing == event
    here = world.mark()
    world.advance(2.0, stop_at=event)
    wanted = world.time, world.crossing, world.state.q.tobytes()
    assert world.time > 0.0 and wanted[0] > past.time
    other = World(hanging, options)
    other.restore(past)
    assert (other.crossing, other.crossed_at, other.message) == (event, past.time, past_message(event))
    other.advance(2.0, stop_at=event)
    assert (other.time, other.crossing, other.state.q.tobytes()) == wanted
    world.rewind(here)
    assert world.crossing == event
    world.advance(2.0, stop_at=event)
    assert (world.time, world.crossing, world.state.q.tobytes()) == wanted


def past_message(event: Crossing) -> str:
    return f"The run ended where '{event.sensor}' passed {event.value:g}."


def test_a_world_that_was_put_back_stands_on_no_event_of_its_own(hanging):
    """The event of the world that is overwritten is gone with it."""
    event = Crossing("angle.angle", way=0, value=0.02)
    world = World(hanging)
    start = world.snapshot()
    world.advance(0.7, stop_at=event)
    assert world.crossing == event
    world.restore(start)
    assert world.crossing is None and world.crossed_at == -np.inf
