"""Andrews' squeezing mechanism in both published forms, as seven bodies in space with ten hinges about z.

IFToMM benchmark A03, and the Test Set for IVP Solvers (Hairer and Wanner, Solving ODEs II). Definitions and
values: tests/reference/dae. A planar loop in space: 57 rows of rank 48, one freedom.
"""

from __future__ import annotations

import json
from functools import cache

import numpy as np
import pytest

from dms_core.assembly.model import Model
from dms_core.model import JointAngle, JointReaction, LumpedLoad, Point, Revolute, RigidBody, SpringDamper, System
from dms_core.model.geometry.frames import quaternion
from dms_core.simulation.dynamics import SolverOptions, simulate
from tests.arm26 import REFERENCE

JOINTS = (
    ("ground", "K1", "O"), ("K1", "K2", "F"), ("K2", "K3", "E"), ("K2", "K4", "E"), ("K2", "K6", "E"),
    ("ground", "K3", "B"), ("K4", "K5", "G"), ("K6", "K7", "H"), ("ground", "K5", "A"), ("ground", "K7", "A"),
)  # fmt: skip
LENGTH = 0.1
"""Absolute tolerances are a tenth of the relative one: lengths are near 0.01 m, nominal sizes of 1 m are coarse."""


def _options(rtol: float) -> SolverOptions:
    return SolverOptions(rtol=rtol, atol=LENGTH * rtol)


@cache
def problem(name: str) -> dict:
    return json.loads((REFERENCE / "dae" / f"{name}.json").read_text())


def _start(facts: dict) -> dict[str, tuple[float, float]]:
    """Points at the start, from all digits of the angles where the file has them: points carry twelve decimals."""
    points = {**facts["ground_points"], **facts["initial_points"]}
    if "q" not in facts["initial"]:
        return points
    beta, _, gamma, _, delta, _, epsilon = facts["initial"]["q"]
    way = {"F": ("O", "rr", beta), "E": ("B", "ss", gamma - np.pi / 2), "G": ("A", "zt", delta),
           "H": ("A", "u", epsilon - np.pi / 2)}  # fmt: skip
    for name, (origin, length, angle) in way.items():
        x, y = points[origin]
        r = facts["parameters"][length]
        points[name] = (x + r * np.cos(angle), y + r * np.sin(angle))
    return points


@cache
def andrews(name: str) -> Model:
    """The mechanism at the start of that file."""
    facts = problem(name)["definition"]
    points = {k: np.array([*xy, 0.0]) for k, xy in _start(facts).items()}
    bodies = {}
    for body in facts["bodies"]:
        way = points[body["x_axis_to"]] - points[body["origin"]]
        key = body["name"].split("(")[1][:2]
        bodies[key] = RigidBody(
            name=key,
            mass=body["mass"],
            inertia=(body["inertia_com"],) * 3,  # only the third matters
            centre_of_mass=(*body["com_xy"], 0.0),
            position=tuple(points[body["origin"]]),
            orientation=tuple(quaternion((0, 0, 1), float(np.arctan2(way[1], way[0])))),
        )
    system = System("posed", bodies=bodies.values())
    at = lambda body, point: tuple(system.start_point("ground", points[point], body))  # noqa: E731
    spring = facts["spring"]
    return Model(
        System(
            name,
            bodies=bodies.values(),
            constraints=[
                Revolute(name=f"{p}.{i}.{j}", body_i=i, body_j=j, point_i=at(i, p), point_j=at(j, p))
                for i, j, p in JOINTS
            ],
            forces=[
                LumpedLoad(name="motor", body="K1", moment=(0.0, 0.0, 0.033)),
                SpringDamper(
                    name="spring",
                    body_j="K3",
                    point_i=tuple(points["C"]),
                    point_j=(0.018, 0.02, 0.0),
                    stiffness=spring["stiffness"],
                    free_length=spring["rest_length"],
                ),
            ],
            sensors=[
                JointAngle(name="beta", joint="O.ground.K1"),
                JointAngle(name="gamma", joint="B.ground.K3"),
                JointAngle(name="delta", joint="A.ground.K5"),
                JointAngle(name="epsilon", joint="A.ground.K7"),
                Point(name="F", body="K1", point=(0.007, 0.0, 0.0)),
                JointReaction(name="E", constraint="E.K2.K3", body="K3"),
            ],
        )
    )


def test_redundant_rows_of_the_planar_loops():
    model = andrews("iftomm_A03_andrews")
    assert model.degrees_of_freedom == 1
    assert len(model.redundant_rows) == 9
    assert all(row.split(".")[-1] in ("z", "tilt_f", "tilt_g") for row in model.redundant_rows)
    # The initial points carry 12 decimals.
    assert model.start.moved < 1e-9


def test_iftomm_form():
    """41 times over 0.05 s, more than five turns of the crank."""
    rows = np.array(problem("iftomm_A03_andrews")["reference"]["rows"])
    run = simulate(andrews("iftomm_A03_andrews"), 0.05, _options(1e-7)).check()
    beta = np.unwrap(run.sensors(np.linspace(0.0, 0.05, 2001))["beta.angle"])
    np.testing.assert_allclose(beta[::50], rows[:, 1], atol=3e-5)
    assert beta[-1] > 33.0
    y = run.sensors(rows[:, 0])
    np.testing.assert_allclose(y["beta.rate"], rows[:, 2], atol=1e-2)
    for k, axis in enumerate("xy"):
        np.testing.assert_allclose(y[f"F.position.{axis}"], rows[:, 3 + k], atol=2e-7)
        np.testing.assert_allclose(y[f"F.velocity.{axis}"], rows[:, 5 + k], atol=2e-4)


def test_index_3_form_of_the_test_set():
    """All angles, rates and accelerations at 0.03 s, and the two multipliers that are the force at E."""
    y_ref = np.array(problem("ivp_andrews_index3")["reference"]["recomputed_y"])
    run = simulate(andrews("ivp_andrews_index3"), 0.03, _options(1e-9)).check()
    y = {name: values[0] for name, values in run.sensors([0.03]).items()}
    turn = 2.0 * np.pi
    # Our angles are those of the bodies' x axes: gamma - 90 degrees, epsilon - 90 degrees.
    for name, k, offset in (("beta", 0, 0.0), ("gamma", 2, -turn / 4), ("delta", 4, 0.0), ("epsilon", 6, -turn / 4)):
        error = (y[f"{name}.angle"] - y_ref[k] - offset + turn / 2) % turn - turn / 2
        assert abs(error) < 1e-6, name
        # Of rates near 1e3 1/s and accelerations near 5e5 1/s^2.
        np.testing.assert_allclose(y[f"{name}.rate"], y_ref[7 + k], atol=2e-4)
        np.testing.assert_allclose(y[f"{name}.acceleration"], y_ref[14 + k], atol=1.0)
    np.testing.assert_allclose([y["E.Fx"], y["E.Fy"]], y_ref[21:23], atol=1e-4)


@pytest.mark.parametrize("name", ["iftomm_A03_andrews", "ivp_andrews_index3"])
def test_start_of_the_test_set(name):
    """Accelerations and force at the start, where nothing moves."""
    facts = problem("ivp_andrews_index3")["definition"]["initial"]
    y = {key: values[0] for key, values in simulate(andrews(name), 1e-6).sensors().items()}
    assert abs(y["beta.rate"]) < 1e-9
    # The two forms start 3e-4 rad apart.
    rtol = 1e-8 if name == "ivp_andrews_index3" else 1e-2
    np.testing.assert_allclose(y["beta.acceleration"], facts["a"][0], rtol=rtol)
    np.testing.assert_allclose([y["E.Fx"], y["E.Fy"]], facts["lam"][:2], rtol=rtol)
