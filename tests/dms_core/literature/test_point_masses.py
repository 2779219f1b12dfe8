"""Closed forms of point masses: pendulum (IFToMM A01), Atwood machines, spring and mass.

Values and definitions: tests/reference/dae. The Atwood machine with a massive pulley is that of test_drum_rope.py.
"""

from __future__ import annotations

import json

import numpy as np
import pytest

from dms_core.model import (
    Distance,
    Gravity,
    Harmonic,
    Input,
    LineGuide,
    LumpedLoad,
    PathPoint,
    PlaneGuide,
    PointMass,
    RopeLength,
    RopeSensor,
    SecondOrder,
    SpringDamper,
    System,
)
from dms_core.results import Trajectory
from dms_core.simulation.dynamics import SolverOptions, simulate
from tests.arm26 import REFERENCE

TIGHT = SolverOptions(rtol=1e-8)
DOWN = Gravity(name="gravity", acceleration=(0.0, -9.81, 0.0))


def _problem(name: str) -> dict:
    return json.loads((REFERENCE / "dae" / f"{name}.json").read_text())


PENDULUM_ROWS = np.array(_problem("iftomm_A01_simple_pendulum")["reference"]["iftomm_rows"])
"""t, x, y, vx, vy."""


def pendulum() -> System:
    """1 kg on a massless rod of 1 m, from the horizontal."""
    return System(
        "pendulum",
        bodies=[PointMass(name="bob", mass=1.0, position=(-1.0, 0.0, 0.0))],
        constraints=[Distance(name="rod", body_j="bob"), PlaneGuide(name="plane", body_j="bob", normal_i=(0, 0, 1))],
        forces=[DOWN],
    )


class TestSimplePendulum:
    """1 kg on a massless rod of 1 m, released from the horizontal, 10 s."""

    @pytest.fixture(scope="class")
    @classmethod
    def run(cls) -> Trajectory:
        return simulate(pendulum(), 10.0, TIGHT).check()

    def test_positions_and_velocities(self, run):
        rows = PENDULUM_ROWS
        states = run.at(rows[:, 0])
        # The benchmark suggests 1e-4 m at a tolerance of 1e-6.
        np.testing.assert_allclose(states.q[:, :2], rows[:, 1:3], atol=4e-5)
        np.testing.assert_allclose(states.v[:, :2], rows[:, 3:5], atol=2e-4)

    def test_energy_and_rod_force(self, run):
        energy = 0.5 * (run.v**2).sum(axis=1) + 9.81 * run.q[:, 1]
        assert np.abs(energy).max() < 5e-5  # the benchmark's own target [J]
        # Tension 3 m g cos(theta), which is the rod's multiplier; multipliers err most, by 1e-5 of 29 N.
        np.testing.assert_allclose(run.lam[:, 0], -3.0 * 9.81 * run.q[:, 1], atol=5e-4)


def _rope(*points) -> tuple[PathPoint, ...]:
    return tuple(PathPoint(body=body, point=point) for body, point in points)


def _vertical(*bodies: PointMass) -> list[LineGuide]:
    return [LineGuide(name=f"rail of {b.name}", body_j=b.name, axis_i=(0, 1, 0), point_i=b.position) for b in bodies]


def _atwood(bodies, path) -> System:
    rope = RopeLength(name="rope", path=path)
    sensor = RopeSensor(name="cell", rope="rope", components=("tension",))
    return System("atwood", bodies=bodies, constraints=[*_vertical(*bodies), rope], forces=[DOWN], sensors=[sensor])


def _assert_uniform(run: Trajectory, name: str, acceleration: float, tension: float) -> None:
    """Uniform acceleration from rest: BDF2 and its start are exact for parabolas, but for Newton's tolerance."""
    y = run.own_steps().coordinate(f"{name}.y")
    np.testing.assert_allclose(y - y[0], 0.5 * acceleration * run.t**2, atol=1e-7)
    np.testing.assert_allclose(run.sensors()["cell"], tension, atol=1e-6)


ATWOOD = _problem("atwood_pulley")["reference"]


def over_a_pulley() -> System:
    """2 kg and 3 kg."""
    light, heavy = (
        PointMass(name=n, mass=m, position=(x, -1.0, 0.0)) for n, m, x in (("m1", 2.0, 0.0), ("m2", 3.0, 0.2))
    )
    path = _rope(("m1", (0, 0, 0)), ("ground", (0, 0, 0)), ("ground", (0.2, 0, 0)), ("m2", (0, 0, 0)))
    return _atwood((light, heavy), path)


def test_atwood_with_a_massless_pulley():
    facts, run = ATWOOD["b_massless"], simulate(over_a_pulley(), 0.5).check()
    _assert_uniform(run, "m2", -facts["acceleration"], facts["tension"])
    _assert_uniform(run, "m1", facts["acceleration"], facts["tension"])


def over_a_movable_pulley() -> System:
    """The rope runs from the ground down to the load and up again, then over a fixed pulley to the free end."""
    load, free = (
        PointMass(name="load", mass=3.0, position=(0, -1.0, 0)),
        PointMass(name="free", mass=1.0, position=(0.3, -1.0, 0)),
    )
    path = _rope(
        ("ground", (0, 0, 0)), ("load", (0, 0, 0)), ("ground", (0, 0, 0)), ("ground", (0.3, 0, 0)), ("free", (0, 0, 0))
    )
    return _atwood((load, free), path)


def test_atwood_with_a_movable_pulley():
    facts, run = ATWOOD["c_movable"], simulate(over_a_movable_pulley(), 0.5).check()
    _assert_uniform(run, "free", -facts["acceleration_m_down"], facts["tension"])
    _assert_uniform(run, "load", facts["acceleration_M_up"], facts["tension"])


SPRING = _problem("spring_mass")
RESONANT = Input(name="drive", signal=Harmonic(amplitude=4.0, frequency=5.0 / (2.0 * np.pi), phase=np.pi / 2))


def oscillator(damping: float, x: float, v: float, driven: bool) -> System:
    """2 kg on 50 N/m along x; x is the way from the rest position, 1 m from the wall."""
    force = LumpedLoad(name="force", body="mass", force=(1.0, 0.0, 0.0), input="drive")
    spring = SpringDamper(name="spring", body_j="mass", stiffness=50.0, damping=damping, free_length=1.0)
    return System(
        "spring and mass",
        bodies=[PointMass(name="mass", mass=2.0, position=(1.0 + x, 0.0, 0.0), velocity=(v, 0.0, 0.0))],
        constraints=[LineGuide(name="rail", body_j="mass", axis_i=(1, 0, 0))],
        forces=[spring, force] if driven else [spring],
        inputs=[RESONANT],
    )


CASES = {"free": (0.0, False), "under": (2.0, False), "critical": (20.0, False), "over": (60.0, False),
         "resonance": (1.0, True), "undamped_resonance": (0.0, True)}  # fmt: skip


def oscillating(case: str) -> tuple[System, np.ndarray]:
    """A case, and its t, x (and v)."""
    damping, driven = CASES[case]
    x, v = (0.0, 0.0) if driven else (0.1, 0.3)
    return oscillator(damping, x, v, driven), np.array(SPRING["reference"][case])


@pytest.mark.filterwarnings("ignore:.*read by no element")
@pytest.mark.parametrize("case", CASES)
def test_spring_and_mass(case):
    system, rows = oscillating(case)
    states = simulate(system, rows[-1, 0], TIGHT).check().at(rows[:, 0])
    # A second-order method at rtol = 1e-8: 4e-6 m of phase error were seen; the undamped resonance grows without end.
    scale = max(1.0, np.abs(rows[:, 1]).max())
    np.testing.assert_allclose(states.coordinate("mass.x") - 1.0, rows[:, 1], atol=1e-5 * scale)
    if rows.shape[1] > 2:
        np.testing.assert_allclose(states.rate("mass.x"), rows[:, 2], atol=5e-5 * scale)


@pytest.mark.filterwarnings("ignore:.*read by no element")
@pytest.mark.parametrize("case", ["under", "resonance"])
def test_generic_second_order_element_is_the_same_oscillator(case):
    damping, driven = CASES[case]
    rows = np.array(SPRING["reference"][case])
    x, v = (0.0, 0.0) if driven else (0.1, 0.3)
    element = SecondOrder(name="mass", mass=2.0, damping=damping, stiffness=50.0, start=x, start_rate=v,
                          input="drive" if driven else None)  # fmt: skip
    run = simulate(System("ode", forces=[element], inputs=[RESONANT]), rows[-1, 0], TIGHT).check()
    np.testing.assert_allclose(run.at(rows[:, 0]).coordinate("mass.x"), rows[:, 1], atol=1e-5)


def test_hanging_mass_released_from_the_unstressed_length():
    facts = SPRING["reference"]["hanging"]
    system = System(
        "hanging",
        bodies=[PointMass(name="mass", mass=2.0, position=(0.0, -1.0, 0.0))],
        constraints=[LineGuide(name="rail", body_j="mass", axis_i=(0, 1, 0))],
        forces=[DOWN, SpringDamper(name="spring", body_j="mass", stiffness=50.0)],
    )
    run = simulate(system, 2.0 * facts["period"], TIGHT).check()
    drop = -1.0 - run.q[:, 1]
    np.testing.assert_allclose(drop, facts["static_sag"] * (1.0 - np.cos(5.0 * run.t)), atol=1e-5)
    np.testing.assert_allclose(drop.max(), facts["max_drop"], atol=1e-5)


def test_two_mass_chain_swings_in_its_modes():
    """Each mode alone, M^-1 K from the definition: the frequencies of the file, and no energy in the other mode."""
    K, M = np.array([[300.0, -200.0], [-200.0, 200.0]]), np.diag([1.0, 2.0])
    squares, modes = np.linalg.eig(np.linalg.solve(M, K))
    order = np.argsort(squares)
    np.testing.assert_allclose(np.sqrt(squares[order]), SPRING["reference"]["chain_eigenfrequencies_rad_s"], rtol=1e-12)
    for k in order:
        start, omega = 0.05 * modes[:, k], np.sqrt(squares[k])
        masses = [PointMass(name=f"m{i}", mass=M[i, i], position=(1.0 + i + start[i], 0.0, 0.0)) for i in range(2)]
        springs = [
            SpringDamper(name="k1", body_j="m0", stiffness=100.0, free_length=1.0),
            SpringDamper(name="k2", body_i="m0", body_j="m1", stiffness=200.0, free_length=1.0),
        ]
        rails = [LineGuide(name=f"rail{i}", body_j=f"m{i}", axis_i=(1, 0, 0)) for i in range(2)]
        run = simulate(System("chain", bodies=masses, constraints=rails, forces=springs), 2.0, TIGHT).check()
        x = run.q[:, [0, 3]] - [1.0, 2.0]
        np.testing.assert_allclose(x, np.cos(omega * run.t)[:, None] * start, atol=1e-5)
