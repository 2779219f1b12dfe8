"""arm26 (Holzbaur et al. 2005) with the whole core, against OpenSim 4.6; tolerances are those of reference/README.md.

The arm hangs from a welded shoulder, the elbow is free. Tables: tests/reference, with sources and licence.
"""

from __future__ import annotations

import numpy as np
import pytest

from dms_core.assembly.model import Model
from dms_core.model import (
    Constant,
    Fixed,
    Gravity,
    Harmonic,
    Input,
    JointAngle,
    JointReaction,
    LumpedLoad,
    MuscleSensor,
    PathPoint,
    PointMass,
    PositionDriver,
    Revolute,
    RopeSensor,
    Steps,
    System,
)
from dms_core.model.constraints import LineGuide
from dms_core.model.geometry.frames import unit
from dms_core.results import Trajectory
from dms_core.simulation.dynamics import SolverOptions, simulate
from tests.arm26 import MUSCLES, arm, muscle, subject, table

FOREARM, HUMERUS = "r_ulna_radius_hand", "r_humerus"


def columns(name: str) -> dict[str, np.ndarray]:
    """A reference table by column."""
    rows = table(name)
    return {key: np.array([row[key] for row in rows]) for key in rows[0]}


def _arm(flexion_deg: float, *forces, sensors=(), inputs=()) -> System:
    """Torso and humerus welded to the ground, the forearm on its hinge."""
    joint = subject()["joints"]["r_elbow"]
    posed = arm(flexion_deg)
    return System(
        "arm26",
        bodies=posed.bodies,
        constraints=[
            Fixed(name="offset", body_j="base"),
            Fixed(name="r_shoulder", body_i="base", body_j=HUMERUS),
            Revolute(
                name="r_elbow",
                body_i=HUMERUS,
                body_j=FOREARM,
                point_i=tuple(joint["point_i"]),
                point_j=tuple(joint["point_j"]),
                axis_i=tuple(joint["axis_i"]),
            ),
        ],
        forces=[Gravity(name="gravity", acceleration=tuple(subject()["gravity"])), *forces],
        sensors=[JointAngle(name="elbow", joint="r_elbow"), *sensors],
        inputs=inputs,
    )


def forward_model(flexors: float) -> Model:
    """Runs A (0.15) and A2 (0.30)."""
    level = {name: (0.05 if name.startswith("TRI") else flexors) for name in MUSCLES}
    components = ("activation", "fibre_length", "tendon_force")
    muscles = [muscle(name, excitation=f"{name}_u", start_activation=0.05) for name in MUSCLES]
    sensors = [MuscleSensor(name=name + "_sensor", muscle=name, components=components) for name in MUSCLES]
    reaction = JointReaction(name="reaction", constraint="r_elbow", body=FOREARM)
    inputs = [Input(name=f"{name}_u", signal=Constant(value=level[name])) for name in MUSCLES]
    return Model(_arm(20.0, *muscles, sensors=[*sensors, reaction], inputs=inputs))


OPTIONS = SolverOptions(rtol=1e-8)
"""Errors of the run below every tolerance of the tables, in some 5000 steps."""


@pytest.fixture(scope="module", params=["A", "A2"])
def forward(request) -> tuple[dict, Trajectory]:
    """Reference columns and our run."""
    rows = columns(f"arm26_forward_{request.param}")
    return rows, simulate(forward_model({"A": 0.15, "A2": 0.30}[request.param]), rows["time_s"][-1], OPTIONS).check()


def test_model_has_one_freedom_and_no_redundancy(forward):
    model = forward[1].model
    assert model.degrees_of_freedom == 1
    assert model.redundant_rows == []


def test_forward_motion(forward):
    rows, run = forward
    y = run.sensors(rows["time_s"])
    assert np.ptp(rows["elbow_flexion_rad"]) > 0.2
    np.testing.assert_allclose(y["elbow.angle"], rows["elbow_flexion_rad"], atol=1e-5)
    np.testing.assert_allclose(y["elbow.rate"], rows["elbow_speed_rad_per_s"], atol=1e-4)


@pytest.mark.parametrize(
    ("component", "column", "atol"),
    [
        ("activation", "activation", 1e-6),
        ("fibre_length", "fibre_length_m", 1e-6),
        ("tendon_force", "tendon_force_N", 0.05),
    ],
)
def test_forward_muscles(forward, component, column, atol):
    rows, run = forward
    y = run.sensors(rows["time_s"])
    for name in MUSCLES:
        np.testing.assert_allclose(y[f"{name}_sensor.{component}"], rows[f"{name}_{column}"], atol=atol, err_msg=name)


def test_forward_reactions(forward):
    """Force and moment of the upper arm on the forearm at the elbow, from the multipliers."""
    rows, run = forward
    y = run.sensors(rows["time_s"])
    for c in "xyz":
        wanted = rows[f"elbow_reaction_on_forearm_F{c}_N"], rows[f"elbow_reaction_on_forearm_M{c}_Nm"]
        np.testing.assert_allclose(y[f"reaction.F{c}"], wanted[0], atol=0.1)
        np.testing.assert_allclose(y[f"reaction.M{c}"], wanted[1], atol=0.01)


def test_reactions_at_the_start(forward):
    """All of the start but its assembly is closed form: no error of a run is in it."""
    rows, run = forward
    y = {name: values[0] for name, values in run.sensors().items()}
    for c in "xyz":
        np.testing.assert_allclose(y[f"reaction.F{c}"], rows[f"elbow_reaction_on_forearm_F{c}_N"][0], atol=1e-5)
        np.testing.assert_allclose(y[f"reaction.M{c}"], rows[f"elbow_reaction_on_forearm_M{c}_Nm"][0], atol=1e-6)
    np.testing.assert_allclose(y["elbow.acceleration"], rows["elbow_acceleration_rad_per_s2"][0], atol=1e-5)


@pytest.mark.parametrize("row", range(0, 14, 3))
def test_elbow_inertia_and_gravity(row):
    """I thetaddot = Q_gravity + M: two accelerations at rest give both, by the constraint forces of 18 rows."""
    rows = table("arm26_elbow_inertia_gravity")[row]
    axis, moment = unit(subject()["joints"]["r_elbow"]["axis_i"], "axis"), 2.5

    def acceleration(*forces) -> float:
        return simulate(_arm(rows["elbow_flexion_deg"], *forces), 1e-6).sensors()["elbow.acceleration"][0]

    load = LumpedLoad(name="load", body=FOREARM, moment=tuple(moment * axis))
    free, loaded = acceleration(), acceleration(load)
    inertia = moment / (loaded - free)
    # README: 1e-10; the table has 12 digits.
    np.testing.assert_allclose(inertia, rows["generalised_inertia_kg_m2"], rtol=1e-9)
    np.testing.assert_allclose(free * inertia, rows["gravity_generalised_force_Nm"], atol=1e-9)


BETWEEN = (PathPoint(point=(0.0, 0.0, 0.0)), PathPoint(body="end", point=(0.0, 0.0, 0.0)))


def _single(length: Constant | Harmonic, excitation, dynamics: bool) -> Model:
    """BIClong alone between the ground and a point whose distance from it is imposed."""
    first = excitation.values[0] if isinstance(excitation, Steps) else excitation.value
    start = length.value if isinstance(length, Constant) else length.offset
    facts = muscle("BIClong", path=BETWEEN, start_activation=first, activation_dynamics=dynamics)
    parts = ("fibre_length", "fibre_velocity", "tendon_force", "activation")
    return Model(
        System(
            "single muscle",
            bodies=[PointMass(name="end", mass=1.0, position=(start, 0.0, 0.0))],
            constraints=[
                LineGuide(name="guide", body_j="end", axis_i=(1.0, 0.0, 0.0)),
                PositionDriver(name="driver", body_j="end", axis_i=(1.0, 0.0, 0.0), input="length"),
            ],
            forces=[facts],
            sensors=[
                MuscleSensor(name="muscle", muscle="BIClong", components=parts),
                RopeSensor(name="tape", path=BETWEEN, components=("length",)),
            ],
            inputs=[Input(name="length", signal=length), Input(name="command", signal=excitation)],
        )
    )


JUMPS = Steps(times=(0.0, 0.05, 0.30), values=(0.05, 1.0, 0.05))
SINGLE = {
    "isometric_excitation_step_BIClong": (Constant(value=0.388), JUMPS, True),
    "isometric_activation_step_BIClong": (Constant(value=0.388), JUMPS, False),
    "imposed_sine_length_BIClong": (
        Harmonic(amplitude=0.017355, frequency=2.5, offset=0.393785), Constant(value=0.4), False,
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", sorted(SINGLE))
def test_single_muscle(name):
    rows = columns(name)
    run = simulate(_single(*SINGLE[name]), rows["time_s"][-1], SolverOptions(rtol=1e-9)).check()
    # Where a time appears twice, the first row is before the jump and the second behind it.
    behind = np.append(np.diff(rows["time_s"]) == 0.0, False)
    at = np.where(np.roll(behind, 1), np.nextafter(rows["time_s"], 1.0), rows["time_s"])
    y = run.sensors(at)
    np.testing.assert_allclose(y["tape"], rows["muscle_tendon_length_m"], atol=1e-11)
    np.testing.assert_allclose(y["muscle.fibre_length"], rows["fibre_length_m"], atol=1e-7)
    np.testing.assert_allclose(y["muscle.tendon_force"], rows["tendon_force_N"], atol=0.02)
    np.testing.assert_allclose(y["muscle.activation"], rows["activation"], atol=1e-6)


def test_default_tolerance_is_enough_for_a_figure():
    """What a user gets without choosing options; 4e-5 rad and 0.03 N were seen."""
    rows = columns("arm26_forward_A")
    run = simulate(forward_model(0.15), rows["time_s"][-1]).check()
    y = run.sensors(rows["time_s"])
    assert np.abs(y["elbow.angle"] - rows["elbow_flexion_rad"]).max() < 1e-4
    assert np.abs(y["BIClong_sensor.tendon_force"] - rows["BIClong_tendon_force_N"]).max() < 0.1
    assert run.stats.steps < 1000
