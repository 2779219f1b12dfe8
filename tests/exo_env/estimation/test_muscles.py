"""The elbow with six muscles, and the filter of a device with electrodes."""

from __future__ import annotations

import math

import numpy as np
import pytest

from dms_core import Model, SolverOptions, World
from dms_core.errors import InputError, SimulationError
from exo_env.ecosystem.gym_machine import GymMachine
from exo_env.ecosystem.sensors import muscle_sensor
from exo_env.estimation.elbow_estimator import ANGLE, GUIDE_FORCE, RATE
from exo_env.estimation.muscle_elbow import DEVICE, ROPE_TENSION, MuscleElbow
from exo_env.estimation.muscle_estimator import CELL, Known, MuscleEstimator, emg_channel
from exo_env.patient.patient import MIDDLE

PERIOD = 0.02


def elbow_with(farther: float = 1.05) -> MuscleElbow:
    return MuscleElbow(machine=GymMachine.from_config("gym_machine/pulley.yaml"), farther=farther)


def test_moment_arms_are_off_and_fibres_are_where_they_were():
    """At 90 degrees the longer tendon takes up what the path is longer; moment arms are larger, if not all by 5 %."""
    right, wrong, angle = elbow_with(1.0), elbow_with(1.05), math.radians(90.0)
    arm = right.arm()
    for m in arm.muscles:
        there = arm.muscle_geometry(m, angle)[0]
        longer = wrong.muscle(arm, m).tendon_slack_length - arm.muscle(m).tendon_slack_length
        rest = [e.muscle(arm, m).equilibrium(there + x, 0.3) for e, x in ((right, 0.0), (wrong, longer))]
        # The tendon's strain is that of its own length, which has grown by less than 1 %.
        assert rest[1] == pytest.approx(rest[0], rel=0.01)
        assert right.lever(arm, m, MIDDLE) == pytest.approx(arm.muscle_geometry(m, MIDDLE)[1], rel=1e-12)
        assert 1.02 < wrong.lever(arm, m, MIDDLE) / right.lever(arm, m, MIDDLE) < 1.07


@pytest.fixture(scope="module")
def record() -> tuple[list[dict[str, float]], np.ndarray, np.ndarray]:
    """Readings of the model itself while its muscles lift 1.5 kg; true forces and activations."""
    elbow = elbow_with(1.0)
    muscles = elbow.arm().muscles
    start = np.array([0.05, 0.05, 0.05, 0.2, 0.2, 0.2])
    world = World(Model(elbow.system(0.9, 1.5, start)), SolverOptions(rtol=1e-6))
    names, rng = [name for name, _ in world.model.layout.outputs], np.random.default_rng(4)
    noise = {ANGLE: 4e-4, RATE: 0.02, GUIDE_FORCE: 0.5, CELL: 1.0, **{emg_channel(m): 0.03 for m in muscles}}
    world.settle()
    rows, forces, activations = [], [], []
    for k in range(150):
        given = start + np.where(start > 0.1, 0.1, 0.03) * math.sin(0.06 * k)
        for m, a in zip(muscles, given, strict=True):
            world.set_input(f"excitation.{m}", float(a))
        hinge = world.read()[names.index(ANGLE)]
        world.set_input(DEVICE, 8.0 * (0.9 - hinge) - 1.0 * world.read()[names.index(RATE)])
        world.advance(PERIOD * (k + 1))
        y = dict(zip(names, world.read(), strict=True))
        rows.append({name: float(y[name] + s * rng.normal()) for name, s in noise.items()})
        forces.append([y[muscle_sensor(m, "tendon_force")] for m in muscles])
        activations.append([y[emg_channel(m)] for m in muscles])
    return rows, np.array(forces), np.array(activations)


def estimates(record, known: Known, cell: bool, farther: float = 1.0):  # noqa: ANN201
    """Of a filter along the record."""
    elbow = elbow_with(farther)
    estimator, found = MuscleEstimator(elbow, PERIOD, known=known), []
    for k, row in enumerate(record[0]):
        y = {name: x for name, x in row.items() if cell or name != CELL}
        found.append((estimator.update if k else estimator.reset)(y, 1.5))
    return found


def rms(x: np.ndarray) -> float:
    return float(np.sqrt(np.mean(np.square(x))))


def test_forces_of_known_muscles_with_a_known_load(record):
    """Moment arms 5 % off, all else as in the filter: what is left is the noise of the electrodes, and the arms."""
    arm = elbow_with().arm()
    strength = np.array([arm.muscle(m).max_isometric_force for m in arm.muscles])
    found = estimates(record, Known(load=True, strength=strength), cell=False, farther=1.05)[25:]
    forces, activations = record[1][25:], record[2][25:]
    assert rms(np.array([e.activations for e in found]) - activations) < 0.03
    assert rms(np.array([e.forces for e in found]) - forces) < 0.2 * rms(forces)


def test_a_load_cell_tells_the_load_and_electrodes_alone_know_that_they_do_not(record):
    with_cell, without = (estimates(record, Known(), cell=x)[-1] for x in (True, False))
    assert with_cell.load == pytest.approx(1.5, abs=0.1) and with_cell.load_deviation < 0.1
    assert without.load_deviation > 0.1
    assert ROPE_TENSION == CELL


def test_a_period_without_a_step_passes_and_makes_nothing_surer(record, monkeypatch):
    """Of what no reading tells: without readings a lost period leaves more doubt of everything, and its time passes."""
    estimator = MuscleEstimator(elbow_with(), PERIOD)
    estimator.reset(record[0][0])
    for row in record[0][1:5]:
        estimator.update(row)
    before = estimator.filter.belief()
    for _ in range(3):
        monkeypatch.setattr(estimator.filter, "try_step", lambda readings: False)
        estimator.update({})
    after = estimator.filter.belief()
    assert estimator.lost == 3 and after.t == pytest.approx(before.t + 3 * PERIOD)
    assert after.chart.names == before.chart.names
    assert (after.deviations >= before.deviations).all()
    fibres = slice(2 * len(after.chart.chosen), after.chart.size)
    assert (after.deviations[fibres] > before.deviations[fibres]).all()


def test_readings_that_are_missing(record, monkeypatch):
    """NaN of electrodes tells nothing; a start needs an angle, and beginning anew takes the one believed."""
    estimator, first = MuscleEstimator(elbow_with(), PERIOD), record[0][0]
    with pytest.raises(InputError, match=f"'{ANGLE}': Expected the angle to begin with"):
        estimator.reset(first | {ANGLE: math.nan})
    estimator.reset(first | {emg_channel("BRA"): math.nan})
    missing = dict.fromkeys(first, math.nan)
    assert np.isfinite(estimator.update(missing).forces).all()

    def fails(readings):
        raise SimulationError("no rates")

    monkeypatch.setattr(type(estimator.filter), "try_step", lambda self, readings: fails(readings))
    told = estimator.update(missing)
    assert np.isfinite(told.forces).all() and estimator.lost == 1


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"steps": 0}, "steps = 0: Expected a whole number"),
        ({"known": Known(strength=np.ones(3))}, r"largest force of each of 6 muscles \[N\], got shape \(3,\)"),
    ],
)
def test_arguments_that_do_not_fit(given, message):
    with pytest.raises(InputError, match=message):
        MuscleEstimator(elbow_with(), PERIOD, **given)


def test_what_is_to_come_first(record):
    with pytest.raises(InputError, match="Expected 'reset' with first readings"):
        MuscleEstimator(elbow_with(), PERIOD).update(record[0][0])
    with pytest.raises(InputError, match="Expected 'load'"):
        MuscleEstimator(elbow_with(), PERIOD, known=Known(load=True)).reset(record[0][0])
