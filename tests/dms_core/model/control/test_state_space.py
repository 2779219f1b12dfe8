"""A linear block against scipy.signal, alone and around a joint."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import signal

from dms_core.assembly.model import Model
from dms_core.errors import ModelError
from dms_core.model import (
    Function,
    Harmonic,
    Input,
    JointAngle,
    LumpedLoad,
    PointMass,
    Revolute,
    RigidBody,
    StateSpace,
    System,
)
from dms_core.simulation.dynamics import SolverOptions, simulate

FINE = SolverOptions(rtol=1e-8)


def rows(matrix) -> tuple[tuple[float, ...], ...]:
    """A matrix as a declaration takes it."""
    return tuple(tuple(float(x) for x in row) for row in np.atleast_2d(matrix))


def test_a_filter_answers_as_scipy_says():
    """A Butterworth low-pass of order 4, fed by a sine; its output is a force on a mass, the second integral of it."""
    A, B, C, D = signal.tf2ss(*signal.butter(4, 12.0, analog=True))
    block = StateSpace(name="filter", inputs=("wave",), outputs=("push",), A=rows(A), B=rows(B), C=rows(C), D=rows(D))
    mass = PointMass(name="mass", mass=0.5)
    push = LumpedLoad(name="push_load", body="mass", force=(1.0, 0.0, 0.0), input="push")
    wave = Input(name="wave", signal=Harmonic(amplitude=2.0, frequency=1.5, phase=0.4))
    run = simulate(
        System("x", bodies=[mass], forces=[block, push], inputs=[wave, Input(name="push")]), 2.0, FINE
    ).check()
    t = np.linspace(0.0, 2.0, 20001)
    u = 2.0 * np.sin(2.0 * np.pi * 1.5 * t + 0.4)
    # Two integrators behind the block: acceleration y / m.
    big = np.block([
        [A, np.zeros((4, 2))], [np.zeros((1, 5)), np.ones((1, 1))], [C / 0.5, np.zeros((1, 2))]
    ])  # fmt: skip
    _, exact, states = signal.lsim((big, np.vstack([B, [[0.0]], D / 0.5]), np.eye(6), np.zeros((6, 1))), u, t)
    coarse = slice(None, None, 200)
    # lsim holds the sine linear between its samples: an error of 1e-7 of it.
    assert np.abs(run.at(t[coarse]).coordinate("mass.x") - states[coarse, 4]).max() < 2e-6
    assert np.abs(run.at(t[coarse]).coordinate("filter.x4") - states[coarse, 3]).max() < 2e-6


@pytest.mark.parametrize("start", [(0.0, 0.0), (0.01, -0.1)])
def test_a_loop_around_a_joint_is_the_closed_loop_of_scipy(start):
    """A lead compensator (with D) and a second output from two sensors, around an inertia."""
    inertia, gain = 0.05, 3.0
    Ac, Bc, Cc, Dc = signal.tf2ss([gain, gain * 6.0], [1.0, 60.0])
    wheel = RigidBody(name="wheel", mass=1.0, inertia=(inertia,) * 3, angular_velocity=(0.0, 0.0, 0.5))
    A = np.diag([float(Ac[0, 0]), -3.0])
    B = np.array([[-1.0, 0.0, 1.0], [0.0, 1.0, 0.0]])
    C = np.array([[float(Cc[0, 0]), -0.02]])
    D = np.array([[-float(Dc[0, 0]), -0.01, float(Dc[0, 0])]])
    assert Bc[0, 0] == 1.0
    block = StateSpace(
        name="lead", sensors=("angle.angle", "angle.rate"), inputs=("psi",), outputs=("torque",), A=rows(A), B=rows(B),
        C=rows(C), D=rows(D), start=start,
    )  # fmt: skip
    torque = LumpedLoad(name="load", body="wheel", moment=(0.0, 0.0, 1.0), input="torque")
    psi = Input(name="psi", signal=Harmonic(amplitude=0.3, frequency=0.8))
    run = simulate(
        System("x", bodies=[wheel], constraints=[Revolute(name="axle", body_j="wheel")], forces=[block, torque],
               sensors=[JointAngle(name="angle", joint="axle")], inputs=[psi, Input(name="torque")]),
        1.5, FINE,
    ).check()  # fmt: skip
    # States x1, x2, th, thd of the closed loop.
    closed = np.zeros((4, 4))
    closed[:2, :2], closed[:2, 2:] = A, B[:, :2]
    closed[2, 3] = 1.0
    closed[3, :2], closed[3, 2:] = C[0] / inertia, D[0, :2] / inertia
    t = np.linspace(0.0, 1.5, 15001)
    u = 0.3 * np.sin(2.0 * np.pi * 0.8 * t)
    into = np.array([[1.0], [0.0], [0.0], [D[0, 2] / inertia]])
    _, _, states = signal.lsim((closed, into, np.eye(4), np.zeros((4, 1))), u, t, X0=[*start, 0.0, 0.5])
    coarse = slice(None, None, 150)
    assert np.abs(run.sensors(t[coarse])["angle.angle"] - states[coarse, 2]).max() < 5e-6
    assert np.abs(run.at(t[coarse]).coordinate("lead.x1") - states[coarse, 0]).max() < 5e-6


def test_outputs_without_states_are_a_gain():
    block = StateSpace(name="gain", inputs=("a", "b"), outputs=("sum",), D=((2.0, -1.0),))
    mass = PointMass(name="mass", mass=1.0)
    push = LumpedLoad(name="push", body="mass", force=(1.0, 0.0, 0.0), input="sum")
    inputs = [Input(name="a", signal=Harmonic(amplitude=1.0, frequency=1.0)),
              Input(name="b", signal=Function(function=_ramp)), Input(name="sum")]  # fmt: skip
    run = simulate(System("x", bodies=[mass], forces=[block, push], inputs=inputs), 1.0, FINE).check()
    # x'' = 2 sin(2 pi t) - t
    exact = 2.0 * (1.0 / (2.0 * np.pi)) - 1.0 / 6.0
    assert run.q[-1, 0] == pytest.approx(exact, abs=1e-6)


def _ramp(t: float) -> tuple[float, float, float]:
    return t, 1.0, 0.0


@pytest.mark.parametrize(
    ("given", "complaint"),
    [
        ({}, "neither states nor outputs"),
        ({"outputs": ("y",), "inputs": ("u",), "D": ((1.0, 2.0),)}, "D: Expected 1 rows of 1 numbers, .* 1 rows of 2"),
        ({"A": ((1.0, 0.0),), "inputs": ("u",), "B": ((1.0,),)}, "A: Expected 1 rows of 1 numbers"),
        ({"A": ((1.0,),), "inputs": ("u",)}, "B: Expected 1 rows of 1 numbers, .* 0 rows of 0"),
        ({"A": ((1.0,),), "inputs": ("u",), "B": ((1.0,),), "outputs": ("y",)}, "C: Expected 1 rows of 1 numbers"),
        ({"A": ((1.0,),), "start": (1.0, 2.0)}, "start: Expected 1 numbers, one for each state, got 2"),
        ({"outputs": ("y", "y"), "inputs": ("u",), "D": ((1.0,), (1.0,))}, "outputs: 'y' is named twice"),
        ({"outputs": ("y",), "inputs": ("u", "u"), "D": ((1.0, 1.0),)}, "inputs: 'u' is named twice"),
    ],
)  # fmt: skip
def test_a_wrong_block_is_refused(given, complaint):
    with pytest.raises(ModelError, match=complaint) as caught:
        StateSpace(name="block", **given)
    assert "state_space 'block'" in str(caught.value)


def test_names_that_do_not_exist_are_refused():
    for given, complaint in (
        ({"inputs": ("u",), "outputs": ("nobody",)}, "state_space 'b': input 'nobody' does not exist. Declared: u"),
        ({"inputs": ("w",), "outputs": ("u",)}, "state_space 'b': input 'w' does not exist. Declared: u"),
    ):
        with pytest.raises(ModelError, match=complaint):
            Model(System("x", bodies=[PointMass(name="m", mass=1.0)], inputs=[Input(name="u")],
                         forces=[StateSpace(name="b", D=((1.0,),), **given)]))  # fmt: skip
