"""PID from a sensor to an input against closed forms: response of a joint, limits and anti-windup, current loop."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from dms_core.assembly.model import Model
from dms_core.errors import ModelError
from dms_core.model import (
    Beam,
    BeamLoad,
    BeamSection,
    Constant,
    CoordinateSensor,
    DcMotor,
    ElasticRope,
    Fixed,
    Gravity,
    Input,
    JointAngle,
    JointMoment,
    LumpedLoad,
    PathPoint,
    Point,
    PointMass,
    Revolute,
    RigidBody,
    RopeSensor,
    SensorPid,
    Steps,
    System,
)
from dms_core.simulation.dynamics import SolverOptions, simulate

INERTIA = 0.05
RTOL = SolverOptions(rtol=1e-8)


def joint(*pids: SensorPid, inputs=(), forces=(), sensors=()) -> Model:
    """A wheel about z, turned by a moment that the input 'torque' scales."""
    wheel = RigidBody(name="wheel", mass=1.0, inertia=(INERTIA,) * 3)
    torque = LumpedLoad(name="torque_load", body="wheel", moment=(0.0, 0.0, 1.0), input="torque")
    return Model(
        System(
            "joint", bodies=[wheel], constraints=[Revolute(name="axle", body_j="wheel")],
            forces=[*pids, torque, *forces], sensors=[JointAngle(name="angle", joint="axle"), *sensors],
            inputs=[Input(name="torque"), *inputs],
        )
    )  # fmt: skip


def pid(**changes) -> SensorPid:
    given = {"name": "pid", "sensor": "angle.angle", "output": "torque", "kp": 20.0, "kd": 0.8, "rate": "angle.rate"}
    return SensorPid(**(given | changes))


def test_pd_of_a_joint_is_the_response_of_second_order():
    """I thdd = kp (psi - th) - kd thd: w^2 = kp / I, 2 z w = kd / I; the step response of any textbook."""
    w, z, psi = math.sqrt(20.0 / INERTIA), 0.8 / (2.0 * math.sqrt(20.0 * INERTIA)), 0.5
    run = simulate(joint(pid(setpoint=psi)), 1.0, RTOL).check()
    t = np.linspace(0.0, 1.0, 201)
    wd = w * math.sqrt(1.0 - z * z)
    exact = psi * (1.0 - np.exp(-z * w * t) * (np.cos(wd * t) + z / math.sqrt(1.0 - z * z) * np.sin(wd * t)))
    angle = run.sensors(t)["angle.angle"]
    assert np.abs(angle - exact).max() < 2e-6
    # Overshoot exp(-pi z / sqrt(1 - z^2)).
    assert angle.max() == pytest.approx(psi * (1.0 + math.exp(-math.pi * z / math.sqrt(1.0 - z * z))), abs=1e-4)


@pytest.mark.parametrize("filter_time", [None, 0.02])
def test_pid_with_a_step_of_the_reference_is_a_linear_system(filter_time):
    """States (I, th, thd, x): the exponential of its matrix, before and behind a step of the reference."""
    kp, ki, kd, load = 20.0, 60.0, 0.8, 1.5
    steps = Input(name="psi", signal=Steps(times=(0.0, 0.3), values=(0.2, -0.3)))
    derivative = {"rate": "angle.rate"} if filter_time is None else {"rate": None, "filter_time": filter_time}
    weight = LumpedLoad(name="load", body="wheel", moment=(0.0, 0.0, -load))
    run = simulate(
        joint(pid(kp=kp, ki=ki, kd=kd, reference="psi", **derivative), inputs=[steps], forces=[weight]), 1.0, RTOL
    ).check()
    T = filter_time or 1.0
    rate = [0.0, 0.0, 1.0, 0.0] if filter_time is None else [0.0, 1.0 / T, 0.0, -1.0 / T]
    A = np.array([
        [0.0, -ki, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0],
        (np.array([1.0, -kp, 0.0, 0.0]) - kd * np.array(rate)) / INERTIA,
        [0.0, 1.0 / T, 0.0, -1.0 / T],
    ])  # fmt: skip

    def later(x, psi: float, t: float) -> np.ndarray:
        b = np.array([ki * psi, 0.0, (kp * psi - load) / INERTIA, 0.0])
        whole = expm(np.block([[A, b[:, None]], [np.zeros((1, 5))]]) * t)
        return whole[:4, :4] @ x + whole[:4, 4]

    t = np.linspace(0.0, 1.0, 51)
    kink = later(np.zeros(4), 0.2, 0.3)
    exact = np.array([later(np.zeros(4), 0.2, x) if x <= 0.3 else later(kink, -0.3, x - 0.3) for x in t])
    assert np.abs(run.sensors(t)["angle.angle"] - exact[:, 1]).max() < 1e-5
    assert np.abs(run.at(t).coordinate("pid.integral") - exact[:, 0]).max() < 1e-4
    # The integral part carries the load at rest.
    assert run.at(t[-1:]).coordinate("pid.integral")[0] == pytest.approx(exact[-1, 0], abs=1e-4)


def _saturated(tracking: float, limit: float, end: float) -> tuple[np.ndarray, np.ndarray]:
    """The same loop, written out and solved by another method; t and (I, th, thd)."""
    kp, ki, kd, psi = 20.0, 60.0, 0.8, 0.6

    def raw(x) -> float:
        return kp * (psi - x[1]) + x[0] - kd * x[2]

    def slope(_, x) -> list[float]:
        out = min(max(raw(x), -limit), limit)
        return [ki * (psi - x[1]) + (out - raw(x)) / tracking, x[2], out / INERTIA]

    t = np.linspace(0.0, end, 401)
    found = solve_ivp(slope, (0.0, end), [0.0, 0.0, 0.0], "Radau", t, rtol=1e-10, atol=1e-12, max_step=1e-3)
    return t, found.y.T


@pytest.mark.parametrize("tracking", [0.05, 0.5])
def test_a_limited_output_winds_up_by_the_tracking_time_only(tracking):
    t, exact = _saturated(tracking, 0.9, 4.0)
    given = {"ki": 60.0, "setpoint": 0.6, "lowest": -0.9, "highest": 0.9, "tracking_time": tracking}
    run = simulate(joint(pid(**given)), 4.0, SolverOptions(rtol=1e-7)).check()
    assert np.abs(run.sensors(t)["angle.angle"] - exact[:, 1]).max() < 2e-4
    out = run.at(t).rate("pid.output")
    assert np.abs(out).max() <= 0.9 + 1e-9 and np.sum(np.abs(out) > 0.9 - 1e-9) > 20


def test_the_default_tracking_time_is_that_of_the_integral():
    one = pid(ki=60.0, highest=1.0).place(None).numbers
    other = pid(ki=60.0, highest=1.0, tracking_time=20.0 / 60.0).place(None).numbers
    assert one == other
    assert pid(ki=60.0).place(None).numbers[7] == 0.0


def test_without_anti_windup_it_overshoots_more():
    def overshoot(tracking: float) -> float:
        run = simulate(
            joint(pid(ki=60.0, setpoint=0.6, lowest=-0.9, highest=0.9, tracking_time=tracking)), 4.0,
            SolverOptions(rtol=1e-6),
        ).check()  # fmt: skip
        return float(run.sensors(run.t)["angle.angle"].max()) - 0.6

    # Bang-bang control of an inertia stops it at the set-point at best; the integral part carries it beyond.
    assert overshoot(1.0) > 1.5 * overshoot(0.02)


def test_a_current_loop_has_the_poles_of_its_closed_form():
    """PI on the current of a motor at rest: L i' = kp (r - i) + I - R i, I' = ki (r - i)."""
    R, L, kp, ki, wanted = 1.2, 0.05, 4.0, 300.0, 2.0
    wheel = RigidBody(name="wheel", mass=1.0, inertia=(1e9,) * 3)
    motor = DcMotor(name="motor", joint="axle", voltage="volts", resistance=R, inductance=L, torque_constant=0.1)
    loop = SensorPid(name="loop", sensor="current.value", output="volts", kp=kp, ki=ki, reference="amps")
    system = System(
        "current", bodies=[wheel], constraints=[Revolute(name="axle", body_j="wheel")], forces=[motor, loop],
        sensors=[CoordinateSensor(name="current", coordinate="motor.current")],
        inputs=[Input(name="volts"), Input(name="amps", signal=Constant(value=wanted))],
    )  # fmt: skip
    run = simulate(system, 0.2, RTOL).check()
    A = np.array([[-(kp + R) / L, 1.0 / L], [-ki, 0.0]])
    rest = np.array([wanted, R * wanted])
    t = np.linspace(0.0, 0.2, 101)
    exact = np.array([rest - expm(A * x) @ rest for x in t])
    assert np.abs(run.sensors(t)["current.value"] - exact[:, 0]).max() < 1e-5


def test_a_cascade_of_two_controllers():
    """A PD of the angle whose output is the reference of the PI of the current: a linear system of four states."""
    R, L, K, kp, ki, outer, damping, psi = 1.2, 0.05, 0.3, 40.0, 3000.0, 50.0, 2.0, 0.4
    wheel = RigidBody(name="wheel", mass=1.0, inertia=(INERTIA,) * 3)
    forces = [
        DcMotor(name="motor", joint="axle", voltage="volts", resistance=R, inductance=L, torque_constant=K),
        SensorPid(name="inner", sensor="current.value", output="volts", kp=kp, ki=ki, reference="amps"),
        SensorPid(
            name="outer", sensor="angle.angle", output="amps", kp=outer, kd=damping, rate="angle.rate", setpoint=psi
        ),
    ]
    system = System(
        "cascade", bodies=[wheel], constraints=[Revolute(name="axle", body_j="wheel")], forces=forces,
        sensors=[CoordinateSensor(name="current", coordinate="motor.current"), JointAngle(name="angle", joint="axle")],
        inputs=[Input(name="volts"), Input(name="amps")],
    )  # fmt: skip
    run = simulate(system, 0.5, RTOL).check()
    # States i, I, th, thd; r = outer (psi - th) - damping thd.
    A = np.array([
        [-(kp + R) / L, 1.0 / L, -kp * outer / L, -(kp * damping + K) / L],
        [-ki, 0.0, -ki * outer, -ki * damping],
        [0.0, 0.0, 0.0, 1.0],
        [K / INERTIA, 0.0, 0.0, 0.0],
    ])  # fmt: skip
    rest = np.array([0.0, 0.0, psi, 0.0])
    t = np.linspace(0.0, 0.5, 101)
    exact = np.array([rest - expm(A * x) @ rest for x in t])
    y = run.sensors(t)
    assert np.abs(y["angle.angle"] - exact[:, 2]).max() < 1e-5
    assert np.abs(y["current.value"] - exact[:, 0]).max() < 1e-3


def test_any_sensor_may_be_controlled():
    """The height of a mass by a force on it: m ydd = kp (psi - y) - kd yd + ki int - m g."""
    mass = PointMass(name="mass", mass=2.0)
    lift = LumpedLoad(name="lift", body="mass", force=(0.0, 1.0, 0.0), input="force")
    height = pid(sensor="at.position.y", output="force", rate="at.velocity.y", kp=80.0, kd=16.0, ki=40.0, setpoint=0.3)
    system = System(
        "lift", bodies=[mass], forces=[lift, height, Gravity(name="weight")], inputs=[Input(name="force")],
        sensors=[Point(name="at", body="mass")],
    )  # fmt: skip
    run = simulate(system, 2.0, RTOL).check()
    A = np.array([[0.0, -40.0, 0.0], [0.0, 0.0, 1.0], [0.5, -40.0, -8.0]])
    rest = np.array([2.0 * 9.80665, 0.3, 0.0])
    t = np.linspace(0.0, 2.0, 41)
    exact = np.array([rest - expm(A * x) @ rest for x in t])
    assert np.abs(run.sensors(t)["at.position.y"] - exact[:, 1]).max() < 2e-5


def test_a_force_is_controlled_through_a_rope_that_measures_it():
    """m sdd = F - T, T = k s + c sd, F = kp (T* - T) + I, Idot = ki (T* - T): what a joint's reaction cannot do."""
    m, stiffness, damping, free, kp, ki, wanted = 2.0, 400.0, 40.0, 0.8, 1.5, 30.0, 25.0
    k, c = stiffness / free, damping / free
    mass = PointMass(name="mass", mass=m, position=(free + 0.02, 0.0, 0.0))
    path = (PathPoint(point=(0.0, 0.0, 0.0)), PathPoint(body="mass", point=(0.0, 0.0, 0.0)))
    rope = ElasticRope(name="rope", path=path, axial_stiffness=stiffness, damping=damping, free_length=free)
    pull = LumpedLoad(name="pull", body="mass", force=(1.0, 0.0, 0.0), input="force")
    loop = SensorPid(name="loop", sensor="cell", output="force", kp=kp, ki=ki, setpoint=wanted)
    system = System(
        "force control", bodies=[mass], forces=[rope, pull, loop], inputs=[Input(name="force")],
        sensors=[RopeSensor(name="cell", rope="rope", components=("tension",))],
    )  # fmt: skip
    run = simulate(system, 2.0, RTOL).check()
    T = np.array([0.0, k, c])
    A = np.array([-ki * T, [0.0, 0.0, 1.0], (np.array([1.0, 0.0, 0.0]) - (1.0 + kp) * T) / m])
    rest = np.linalg.solve(-A, [ki * wanted, 0.0, kp * wanted / m])
    t = np.linspace(0.0, 2.0, 81)
    exact = np.array([rest + expm(A * x) @ ([0.0, 0.02, 0.0] - rest) for x in t])
    assert exact[:, 1].min() > 0.0
    assert np.abs(run.sensors(t)["cell"] - exact @ T).max() < 1e-3
    assert run.sensors(t[-1:])["cell"][0] == pytest.approx(wanted, rel=1e-3)


def test_a_beam_is_a_load_cell():
    """The pull in a clamped beam is led to its set-point by the force at its tip: 1 - exp(-ki t) of it."""
    section = BeamSection.rectangle(0.01, 0.01, 2e9, 0.3, 1000.0)
    beam = Beam(name="cell", section=section, length=0.2, elements=2, damping_time=1e-3)
    system = System(
        "cell", compositions=[beam], constraints=[Fixed(name="clamp", body_j=beam.node(0))],
        forces=[
            LumpedLoad(name="pull", body=beam.node(-1), force=(1.0, 0.0, 0.0), input="force"),
            SensorPid(name="loop", sensor="gauge.N", output="force", ki=40.0, setpoint=5.0, nominal_reading=10.0),
        ],
        sensors=[BeamLoad(name="gauge", element="cell.element0")], inputs=[Input(name="force")],
    )  # fmt: skip
    run = simulate(system, 0.2, SolverOptions(rtol=1e-6)).check()
    t = np.linspace(0.02, 0.2, 10)
    # The beam answers within its longest period of 1 ms, 4 % of the controller's time.
    assert run.sensors(t)["gauge.N"] == pytest.approx(5.0 * (1.0 - np.exp(-40.0 * t)), abs=1e-2)


@pytest.mark.parametrize(
    ("changes", "complaint"),
    [
        ({"kp": 0.0, "kd": 0.0, "rate": None}, "kp = ki = kd = 0: Expected one gain other than 0"),
        ({"rate": None}, "kd = 0.8: Expected either 'rate', a sensor component, or 'filter_time'"),
        ({"filter_time": 0.1}, "kd = 0.8: Expected either 'rate', a sensor component, or 'filter_time'"),
        ({"kd": 0.0}, "Expected a kd other than 0"),
        ({"filter_time": 0.0, "rate": None}, "filter_time = 0.0: Expected a number above 0"),
        ({"lowest": 1.0, "highest": 1.0}, "lowest = 1, highest = 1: Expected the lowest output below the highest"),
        ({"lowest": 2.0, "highest": -1.0}, "Expected the lowest output below the highest"),
        ({"kp": 0.0, "ki": 3.0, "highest": 1.0}, "kp = 0, ki = 3: Expected a tracking_time"),
        ({"tracking_time": -1.0}, "tracking_time = -1.0: Expected a number above 0"),
        ({"setpoint": 1.0, "reference": "psi"}, "reference = 'psi', setpoint = 1: Expected one of both"),
        ({"sensor": 3}, "sensor = 3: Expected a text"),
    ],
)
def test_a_wrong_controller_is_refused(changes, complaint):
    with pytest.raises(ModelError, match=complaint) as caught:
        pid(**changes)
    assert "sensor_pid 'pid'" in str(caught.value)


def test_a_moment_cannot_be_read():
    with pytest.raises(ModelError, match="sensor component 'moment' is composed from the forces of other elements"):
        joint(pid(sensor="moment"), sensors=[JointMoment(name="moment", joint="axle", elements=("torque_load",))])
