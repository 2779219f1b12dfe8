"""Welded bodies are left out of a step: the motion and all multipliers are those of a model that solves everything."""

from __future__ import annotations

import math
from typing import ClassVar

import numpy as np
import pytest

from dms_core import Model, Simulation, SolverOptions, World, simulate
from dms_core.assembly.pattern.elimination import Welds
from dms_core.model import (
    Constant,
    Fixed,
    Gravity,
    Input,
    JointReaction,
    LumpedLoad,
    MinimumJerk,
    PositionDriver,
    Revolute,
    RigidBody,
    Steps,
    System,
)
from dms_core.model.element import Constraint
from exo_env.ecosystem.arm import Arm
from exo_env.ecosystem.ecosystem import Ecosystem

G = 9.81
OPTIONS = SolverOptions(rtol=1e-7)


def nothing_welded(layout, active, jacobian) -> Welds:
    """Stands in for find_welds: all coordinates and rows are solved for."""
    none = np.zeros(0, int)
    return Welds(np.arange(layout.n_q).astype(np.int32), active.astype(np.int32), none, none, np.zeros((0, 0)))


def solved_whole(system: System) -> Model:
    """The reference: a model without welds."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("dms_core.assembly.model.find_welds", nothing_welded)
        return Model(system)


def ecosystem() -> System:
    """A short lift: torso, humerus and upper link are welded, and muscles, ropes and a revolute pull on them."""
    start, end = math.radians(40.0), math.radians(60.0)
    return Ecosystem().system(
        start,
        MinimumJerk(times=(0.0, 0.4), values=(start, end)),
        {m: Steps(times=(0.0, 0.1), values=(0.01, 0.3)) for m in Arm().muscles},
    )


def arm(*sensors, extra=(), inputs=(), bend: float = 0.7) -> System:
    """Torso on the ground, humerus on the torso, and a forearm that swings on it; bodies and joints are askew."""
    bodies = [
        RigidBody(name="torso", mass=30.0, inertia=(1.0, 1.2, 0.4, 0.1, 0.0, 0.05), position=(0.0, 0.3, 0.1)),
        RigidBody(
            name="humerus",
            mass=2.0,
            inertia=(0.02, 0.01, 0.02),
            position=(0.1, 0.1, 0.2),
            orientation=(0.9, 0.2, 0.1, 0.3),
        ),
        RigidBody(
            name="forearm",
            mass=1.5,
            inertia=(0.02, 0.002, 0.02),
            position=(0.1 + 0.15 * math.sin(bend), -0.1 - 0.15 * math.cos(bend), 0.2),
            orientation=(math.cos(0.5 * bend), 0.0, 0.0, math.sin(0.5 * bend)),
        ),
    ]
    joints = [
        Fixed(name="seat", body_j="torso"),
        Fixed(name="shoulder", body_i="torso", body_j="humerus"),
        Revolute(name="elbow", body_i="forearm", body_j="humerus", point_i=(0.0, 0.15, 0.0)),
    ]
    return System(
        "arm",
        bodies=bodies,
        constraints=[*joints, *(x for x in extra if hasattr(x, "rows"))],
        forces=[Gravity(name="gravity", acceleration=(0.0, -G, 0.0)), *(x for x in extra if not hasattr(x, "rows"))],
        sensors=sensors,
        inputs=inputs,
    )


def test_what_is_welded():
    model = Model(ecosystem())
    # Torso, humerus and upper link: seven coordinates each, held by a unit norm and a fixed joint of six rows.
    assert len(model.welds.coordinates) == len(model.welds.rows) == 21
    names = {model.layout.names[k].partition(".")[0] for k in model.welds.coordinates}
    assert len(names) == 3 and {"torso", "humerus"} <= names
    assert len(model.tables.values.free) == model.n_q - 21
    assert len(model.tables.values.active) == len(model.active_rows) - 21


def blow(k: int) -> tuple:
    """A load on a welded body and one on the moving one, which jump."""
    body = ("humerus", "forearm")[k]
    return LumpedLoad(name=f"blow{k}", body=body, point=(0.02, 0.05, 0.1), force=(30.0, -20.0, 10.0), input="size")


def beaten(*more) -> System:
    """The arm under blows that jump."""
    size = Input(name="size", signal=Steps(times=(0.0, 0.05, 0.2), values=(0.0, 1.0, -0.5)))
    return arm(extra=(blow(0), blow(1), *more), inputs=(size,))


CASES = {
    "ecosystem": ecosystem,
    "arm": beaten,
    # Held twice: six rows are redundant, and multipliers those of least norm.
    "braced arm": lambda: beaten(Fixed(name="brace", body_j="humerus")),
}


@pytest.mark.parametrize("method", ["bdf2", "sdirk2", "radau5"])
@pytest.mark.parametrize("case", CASES)
def test_the_run_is_that_of_the_whole_system(case, method):
    # Radau IIA takes steps of its own in both runs. They part by what its long steps lose at kinks of the muscles'
    # curves, and by the cubics of first order between them: 2e-6 of the scales is found, 5e-6 in forces.
    rtol, error = (1e-9, 1e-5) if method == "radau5" else (1e-6, 1e-8)
    system, options = CASES[case](), SolverOptions(rtol=rtol, method=method)
    model, whole = Model(system), solved_whole(system)
    assert len(model.welds.rows) and not len(whole.welds.rows)
    one, other = (simulate(m, 0.25, options).check() for m in (model, whole))
    # What does not move does not move at all.
    assert np.ptp(one.q[:, model.welds.coordinates], axis=0).max() == 0.0
    assert np.abs(one.v[:, model.welds.coordinates]).max() == 0.0
    times = np.linspace(0.0, 0.25, 51)
    one, other = one.at(times), other.at(times)
    by_q, by_v = np.array([(c.scale, c.rate_scale) for c in model.layout.coordinates]).T
    # Both leave up to 5e-9 of the scales to Newton's method (0.05 of a tenth of rtol); 1e-9 is found, also in forces.
    np.testing.assert_allclose(one.q / by_q, other.q / by_q, atol=error)
    np.testing.assert_allclose(one.v / by_v, other.v / by_v, atol=error)
    assert np.ptp(other.q / by_q, axis=0).max() > 1e-2, "nothing moved"
    welded, size = model.welds.rows, np.abs(other.lam).max()
    assert np.abs(other.lam[:, welded]).max() > 100.0, "nothing pulls on the welds"
    np.testing.assert_allclose(one.lam, other.lam, atol=error * size)


def reactions(frame: str) -> list[JointReaction]:
    return [
        JointReaction(name="at_seat", constraint="seat", body="torso", point=(0.1, -0.2, 0.3), frame="ground"),
        JointReaction(name="at_shoulder", constraint="shoulder", body="humerus", frame=frame),
    ]


def test_a_hanging_arm_weighs_on_its_welds():
    """At rest: force = weight of what hangs below, moment about the point = lever x weight."""
    system = arm(*reactions("ground"), bend=0.0)
    run = simulate(system, 0.1, OPTIONS).check()
    bodies = {b.name: (np.array(b.position), b.mass) for b in system.bodies}
    point = bodies["torso"][0] + np.array([0.1, -0.2, 0.3])
    weights = [(r, np.array([0.0, -m * G, 0.0])) for r, m in bodies.values()]
    force = -sum(w for _, w in weights)
    moment = -sum(np.cross(r - point, w) for r, w in weights)
    world = World(system, OPTIONS)
    world.advance(0.1)
    found = run.sensors([0.05, 0.1])
    # Rounding of forces and moments of 300 N and Nm.
    for k, axis in enumerate("xyz"):
        np.testing.assert_allclose(found[f"at_seat.F{axis}"], force[k], atol=1e-10)
        np.testing.assert_allclose(found[f"at_seat.M{axis}"], moment[k], atol=1e-10)
    np.testing.assert_allclose(found["at_shoulder.Fy"], 3.5 * G, atol=1e-10)
    read = dict(zip([name for name, _ in world.model.layout.outputs], world.read(), strict=True))
    assert read == pytest.approx({name: values[-1] for name, values in found.items()}, abs=1e-10)


def test_reactions_at_welds_of_a_swinging_arm():
    """Those of the whole system: through a trajectory on both sides of a jump, and through a world."""
    size = Input(name="size", signal=Steps(times=(0.0, 0.1), values=(0.0, 1.0)))
    system = arm(*reactions("humerus"), extra=(blow(0), blow(1)), inputs=(size,))
    model, whole = Model(system), solved_whole(system)
    options = SolverOptions(rtol=1e-7, fixed_step=1e-3)
    one, other = (simulate(m, 0.2, options).check() for m in (model, whole))
    mine, theirs = one.sensors(), other.sensors()
    before, behind = np.flatnonzero(one.t == 0.1)
    for name, values in theirs.items():
        # Newton's method ends at 5e-10 of the scales, and 1e-12 is found; a blow of 37 N changes every component.
        np.testing.assert_allclose(mine[name], values, atol=1e-9, err_msg=name)
        assert abs(values[behind] - values[before]) > 1.0, name
    worlds = [World(m, options) for m in (model, whole)]
    for world in worlds:
        world.settle()
    for t in (0.0, 0.05, 0.1, 0.2):
        for world in worlds:
            world.advance(t)
        np.testing.assert_allclose(worlds[0].read(), worlds[1].read(), atol=1e-9)


@pytest.mark.filterwarnings("ignore:.*drive more than the joints leave free")
@pytest.mark.parametrize("what", ["driven", "all fixed", "none fixed"])
def test_nothing_is_welded(what):
    height = Input(name="height", signal=Constant(value=0.3))
    driver = PositionDriver(name="lift", body_j="torso", axis_i=(0.0, 1.0, 0.0), input="height")
    free = RigidBody(name="block", mass=1.0, inertia=(0.1, 0.1, 0.1))
    system = {
        "driven": lambda: arm(extra=(driver,), inputs=(height,)),
        "all fixed": lambda: System("block", bodies=[free], constraints=[Fixed(name="weld", body_j="block")],
                                    forces=[Gravity(name="gravity")]),
        "none fixed": lambda: System("block", bodies=[free], constraints=[Revolute(name="hinge", body_j="block")],
                                     forces=[Gravity(name="gravity")]),
    }[what]()  # fmt: skip
    model = Model(system)
    assert not len(model.welds.rows) and not len(model.welds.coordinates)
    np.testing.assert_array_equal(model.welds.free, np.arange(model.n_q))
    np.testing.assert_array_equal(model.welds.solved, model.active_rows)
    run = Simulation(model, OPTIONS)
    run.advance(0.05)
    assert run.trajectory().check().stats.steps > 0


class _Glue(Constraint):
    """A weld that is written outside the package: it knows nothing of Fixed but its kernel."""

    kind: ClassVar[str] = "glue_of_a_test"
    kernel: ClassVar = Fixed.kernel
    body: str
    known: bool = True

    def rows(self) -> tuple[str, ...]:
        return ("x", "y", "z", "a", "b", "c")

    def welded(self) -> tuple[str, ...]:
        return ("ground", self.body) if self.known else ()

    def place(self, system):
        return Fixed(name=self.name, body_j=self.body).place(system)


@pytest.mark.parametrize("known", [True, False])
def test_a_weld_of_ones_own_is_left_out_if_it_says_so(known):
    bodies = [RigidBody(name=name, mass=1.0, inertia=(0.1, 0.1, 0.1)) for name in ("base", "rod")]
    joints = [_Glue(name="glue", body="base", known=known), Revolute(name="hinge", body_i="base", body_j="rod")]
    model = Model(System("glued", bodies=bodies, constraints=joints))
    assert len(model.welds.coordinates) == (7 if known else 0)
    assert model.degrees_of_freedom == 1
