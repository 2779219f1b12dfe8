"""The fibre's stop: no run fails on it, none is slow there, none ends anywhere but at rest."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

from dms_core import SolverOptions, System, Trajectory, simulate
from dms_core.model import (
    Constant,
    Harmonic,
    Input,
    LumpedLoad,
    MuscleSensor,
    PathPoint,
    PointMass,
    ThelenMuscle,
)
from dms_core.model.muscles.fibre import (
    MUSCLE,
    STOP_WIDTH,
    fibre_at_rest,
    fibre_pull,
    fibre_state,
    pennation_cosine,
    smallest_fibre,
    stop_begins,
    tendon_state,
)

F0, L0, APART = 600.0, 0.1, 0.3
WIDTH = STOP_WIDTH * L0
FIBRE = "biceps.fibre_length"
STILL = PathPoint(point=(0.0, 0.0, 0.0)), PathPoint(point=(APART, 0.0, 0.0))
MOVING = PathPoint(point=(0.0, 0.0, 0.0)), PathPoint(body="ball", point=(0.0, 0.0, 0.0))

OPTIONS = {
    "default": SolverOptions(),
    "loose": SolverOptions(rtol=1e-3),
    "tight": SolverOptions(rtol=1e-6),
    "sdirk2": SolverOptions(method="sdirk2"),
    "radau5": SolverOptions(method="radau5"),
    "tight radau5": SolverOptions(method="radau5", rtol=1e-9),
}
COARSE = {
    "loose sdirk2": SolverOptions(method="sdirk2", rtol=1e-3),
    # As an environment steps it.
    "rough": SolverOptions(method="sdirk2", rtol=0.02, newton_tol=0.2, h_min=1e-9),
}
FIXED = {
    f"{method} {h}": SolverOptions(fixed_step=h, method=method)
    for method, h in itertools.product(("bdf2", "sdirk2"), (0.01, 0.005, 0.003, 0.002, 0.001, 0.0005))
}
PENNATION = (0.0, 0.1, 0.3)
EXCITATION = (0.0, 0.01, 0.1, 0.5, 1.0)
MOTIONS = ((1.0, 1.5), (1.0, 0.5), (0.5, 0.3), (2.0, 1.0))
"""Frequencies [Hz] and amplitudes [m/s^2] of the end of the path."""


def _muscle(**changes) -> ThelenMuscle:
    """A tendon 1 cm longer than the path between two fixed points; a fibre of 5 cm."""
    facts = {
        "name": "biceps",
        "path": STILL,
        "excitation": "u",
        "max_isometric_force": F0,
        "optimal_fibre_length": L0,
        "tendon_slack_length": 0.31,
        "start_fibre_length": 0.05,
    }
    return ThelenMuscle(**facts | changes)


def _still(muscle: ThelenMuscle, u: float, sensors: tuple = ()) -> System:
    ball = PointMass(name="ball", mass=1.0, position=(1.0, 0.0, 0.0))
    return System(bodies=[ball], forces=[muscle], sensors=sensors, inputs=[Input(name="u", signal=Constant(value=u))])


def _moved(u: float, frequency: float, amplitude: float) -> System:
    """The far end is a mass that a harmonic force moves, whatever the muscle does."""
    ball = PointMass(name="ball", mass=1e6, position=(APART, 0.0, 0.0))
    return System(
        bodies=[ball],
        forces=[_muscle(path=MOVING), LumpedLoad(name="push", body="ball", force=(1e6, 0.0, 0.0), input="course")],
        inputs=[
            Input(name="u", signal=Constant(value=u)),
            Input(name="course", signal=Harmonic(amplitude=amplitude, frequency=frequency)),
        ],
    )


def _tolerance(options: SolverOptions) -> float:
    """What the local error is kept below, times ten: Radau IIA's estimate is coarse, and so is its tolerance."""
    return options.rtol ** (2.0 / 3.0) if options.method == "radau5" else options.rtol


def _row(run: Trajectory, muscle: ThelenMuscle) -> np.ndarray:
    """The fibre row on the accepted steps behind the start [N]."""
    par, s = np.array(muscle.numbers()), run.own_steps()
    length = s.coordinate("ball.x") if muscle.path == MOVING else np.full(len(s.t), APART)
    states = zip(length, s.coordinate(FIBRE), s.rate(FIBRE), s.coordinate("biceps.activation"), strict=True)
    return np.array([fibre_pull(par, q, v, a)[0] - tendon_state(par, x, q)[0] for x, q, v, a in states])[1:]


def _comes_to_rest(run: Trajectory, muscle: ThelenMuscle, error: float = 0.0) -> None:
    """The fibre goes to its stop, stays there, above the smallest length, and ends at rest; `error` [m] of a step."""
    par, s = np.array(muscle.numbers()), run.check().own_steps()
    fibre, a = s.coordinate(FIBRE), s.coordinate("biceps.activation")[-1]
    assert fibre.min() >= smallest_fibre(par)
    reached = int(np.argmax(fibre < stop_begins(par)))
    assert reached > 0 and fibre[reached:].max() < stop_begins(par) + error
    # A hundredth of the stop's width; the activation of the last step is that of the rest to rtol.
    assert fibre[-1] == pytest.approx(fibre_at_rest(par, APART, a), abs=0.01 * WIDTH)
    assert abs(s.rate(FIBRE)[-1]) < 1e-2 * par[MUSCLE.fastest] * STOP_WIDTH


@pytest.mark.parametrize("options", OPTIONS.values(), ids=OPTIONS)
@pytest.mark.parametrize("motion", MOTIONS, ids=str)
@pytest.mark.parametrize("u", [0.01, 0.03, 0.05, 0.1, 0.3, 1.0])
def test_a_tendon_that_becomes_slack_and_taut_again(u, motion, options):
    system = _moved(u, *motion)
    run = simulate(system, 1.0, options).check()
    assert run.own_steps().coordinate(FIBRE).min() > L0 * 0.01
    # Newton's method leaves 0.005 rtol L0 of the fibre, which the taut tendon, of 8e4 N/m, takes for 0.07 rtol F0.
    assert np.abs(_row(run, system.forces[0])).max() < _tolerance(options) * F0
    assert len(run.t) < 3000


@pytest.mark.parametrize("options", (OPTIONS | COARSE).values(), ids=OPTIONS | COARSE)
@pytest.mark.parametrize("pennation", PENNATION)
@pytest.mark.parametrize("u", EXCITATION)
def test_a_slack_muscle_comes_to_rest(u, pennation, options):
    muscle = _muscle(pennation_angle=pennation)
    run = simulate(_still(muscle, u), 0.4, options)
    # The local error is kept below a tenth of rtol (L0 + |q|).
    _comes_to_rest(run, muscle, 0.1 * _tolerance(options) * L0)
    assert np.abs(_row(run, muscle)).max() < max(0.1 * _tolerance(options), 1e-5) * F0


@pytest.mark.parametrize("options", FIXED.values(), ids=FIXED)
@pytest.mark.parametrize("pennation", PENNATION)
@pytest.mark.parametrize("u", EXCITATION)
def test_it_does_so_in_fixed_steps(u, pennation, options):
    muscle = _muscle(pennation_angle=pennation, start_activation=max(u, 0.01))
    run = simulate(_still(muscle, u), 0.4, options)
    _comes_to_rest(run, muscle)
    assert np.abs(_row(run, muscle)).max() < 1e-5 * F0


@pytest.mark.parametrize("options", (OPTIONS | COARSE).values(), ids=OPTIONS | COARSE)
@pytest.mark.parametrize("u", EXCITATION)
def test_the_stop_costs_few_steps(u, options):
    """At most three times what the same muscle needs that a shorter tendon keeps from its stop."""
    free = simulate(_still(_muscle(tendon_slack_length=0.26), u), 0.4, options).check()
    assert free.own_steps().coordinate(FIBRE).min() > 0.02
    stopped = simulate(_still(_muscle(), u), 0.4, options).check()
    assert len(stopped.t) < 3 * len(free.t)


@pytest.mark.parametrize("name", ["default", "loose", "sdirk2"])
def test_runs_agree_with_a_tight_one(name):
    t = np.linspace(0.0, 1.0, 201)
    tight = simulate(_moved(0.01, 1.0, 1.5), 1.0, SolverOptions(rtol=1e-8)).check().at(t).coordinate(FIBRE)
    run = simulate(_moved(0.01, 1.0, 1.5), 1.0, OPTIONS[name]).check().at(t).coordinate(FIBRE)
    # The motion is over some 5 cm; dense output is a hundred times rougher than a step.
    assert np.abs(run - tight).max() < 100.0 * OPTIONS[name].rtol * L0


@pytest.mark.parametrize("a", [0.01, 0.1, 0.5, 1.0])
@pytest.mark.parametrize("pennation", [0.0, 0.1, 0.3, 1.0, 1.4, 1.47])
def test_the_row_lengthens_a_fibre_at_its_smallest_length(pennation, a):
    """By 3 vmax or more, as the head of `fibre.py` says: the row at that rate still asks for more."""
    par = np.array(_muscle(pennation_angle=pennation, start_fibre_length=None).numbers())
    assert fibre_pull(par, smallest_fibre(par), 3.0 * par[MUSCLE.fastest] * (1.0 - 1e-9), a)[0] <= 0.0


@pytest.mark.parametrize("pennation", PENNATION)
def test_nothing_changes_above_the_stop(pennation):
    par = np.array(_muscle(pennation_angle=pennation).numbers())
    for fibre in (stop_begins(par), np.nextafter(stop_begins(par), 1.0), 0.05, 0.13):
        for rate in (-0.3, -0.0, 0.0, 0.2):
            active, passive, by_l, by_v, by_a, passive_l = fibre_state(par, fibre, rate, 0.3)
            c, c_l = pennation_cosine(par, fibre)
            expected = (active + passive) * c, (by_l + passive_l) * c + (active + passive) * c_l, by_v * c, by_a * c
            assert fibre_pull(par, fibre, rate, 0.3) == expected


@pytest.mark.parametrize("pennation", PENNATION)
@pytest.mark.parametrize("slack", [0.31, 0.299, 0.2985])
def test_rest_is_where_the_row_is_zero_at_rate_zero(slack, pennation):
    par = np.array(_muscle(pennation_angle=pennation, tendon_slack_length=slack).numbers())
    for a in (0.01, 0.3, 1.0):
        fibre = fibre_at_rest(par, APART, a)
        assert smallest_fibre(par) < fibre
        # The row's slope there is some 1e6 N/m, of an argument that is rounded to 1e-18 m.
        assert fibre_pull(par, fibre, 0.0, a)[0] == pytest.approx(tendon_state(par, APART, fibre)[0], abs=1e-9)


def test_a_sensor_reads_the_force_that_the_tendon_takes():
    """On the stop of a slack muscle it is 0: nothing holds a fibre that pulls."""
    sensor = MuscleSensor(name="probe", muscle="biceps", components=("active_force", "tendon_force"))
    run = simulate(_still(_muscle(), 0.5, (sensor,)), 0.4).check()
    read = run.sensors()
    assert read["probe.tendon_force"][-1] == 0.0
    assert read["probe.active_force"][-1] == pytest.approx(0.0, abs=1e-6 * F0)


def test_the_width_of_the_stop_is_that_of_its_flag():
    run = simulate(_still(_muscle(), 0.5), 0.4).check()
    (flag,) = run.flags
    assert flag.worst == pytest.approx(0.01 * L0 + WIDTH * (1.0 - 0.625 / 4.0), abs=0.01 * WIDTH)
    assert math.isclose(flag.first + flag.total, 0.4, abs_tol=0.01)
