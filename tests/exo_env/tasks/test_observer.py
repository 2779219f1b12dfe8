"""What an agent sees against the readings, through imperfect sensors."""

import math

import numpy as np
import pytest

from exo_env.envs.elbow_lift import ElbowLiftEnv
from exo_env.tasks.lift import LiftTask
from exo_env.tasks.movements.repetition import Repetition
from exo_env.tasks.observation.channels import Channel, Imperfection, Parts, first_places
from exo_env.tasks.observation.noise import IMPERFECTION, imperfect
from exo_env.tasks.observation.observer import Observer


def _part(env, observation, name):
    s = next(s for s in env.observation_structure if s.name == name)
    return observation[s.start : s.stop] * s.scale


@pytest.mark.parametrize("noise", [False])
def test_observations_are_the_readings(noise):
    env = ElbowLiftEnv(observation=["device", "emg", "privileged"], noise=noise)
    env.reset(seed=3)
    for _ in range(5):
        observation, *_ = env.step(np.array([-0.3, -0.8]))
    r, p = env.readings(), env.episode.patient
    close = {"rel": 1e-6, "abs": 1e-6}  # float32
    assert _part(env, observation, "angle") == pytest.approx([r["exo_angle.angle"]], **close)
    assert _part(env, observation, "tension") == pytest.approx([r["agonist_tension"], r["antagonist_tension"]], **close)
    assert _part(env, observation, "reference") == pytest.approx([r["reference"]], **close)
    assert _part(env, observation, "last_action") == pytest.approx([-0.3, -0.8], **close)
    assert _part(env, observation, "emg")[3] == pytest.approx(r["BIClong.sensor.activation"], **close)
    assert _part(env, observation, "muscle_force")[5] == pytest.approx(r["BRA.sensor.tendon_force"], **close)
    assert _part(env, observation, "neural_delay") == pytest.approx([p.neural_delay], **close)
    ahead = Repetition.of_row(env.episode.movement).course(np.array([0.2, 0.3, 0.5]))[:, 0]
    assert _part(env, observation, "preview") == pytest.approx(ahead, **close)
    force = math.sqrt(sum(r[f"guide_force.F{x}"] ** 2 for x in "xyz"))
    # A plane guide has a force along its normal only.
    assert abs(_part(env, observation, "guide_force")[0]) == pytest.approx(force, rel=1e-5)


def test_noise_bias_delay_and_quantisation():
    reading = {"hinge": 1.0, "hinge_rate": 0.0, "tension": [1.0, 2.0], "guide_force": 0.0, "reference": 0.0,
               "reference_rate": 0.0, "preview": [0.0] * 3, "last_action": [0.0, 0.0]}  # fmt: skip
    spec = {"angle": {"delay": 0.03}, "rate": {"quantum": 0.25, "bias": 0.3}, "guide_force": {"deviation": 2.0}}
    task = LiftTask(Parts(("flexor",), ("agonist", "antagonist"), ("first", "second")))
    observer = Observer(["device"], task.readings, task.groups, spec, 0.02)
    generator, first = np.random.default_rng(0), first_places(task.readings)
    places = {reading.name: int(first[k]) for k, reading in enumerate(task.readings)}
    memory, out, truth = observer.memory(), np.zeros(observer.size), np.zeros(int(first[-1]))

    def observed(changed, begin=False):
        noise = generator.standard_normal(observer.size)
        for name, values in (reading | changed).items():
            truth[places[name] :][: np.size(values)] = values
        imperfect(truth, observer.columns, observer.imperfections, memory, noise, begin, out)
        return out.copy()

    observed({}, begin=True)
    rows = [observed({"hinge": 1.0 + k, "hinge_rate": 0.1 + 0.1 * k}) for k in (1, 2, 3)]
    # 1.5 periods late, between two samples; the range ends at 3.
    np.testing.assert_allclose([row[0] for row in rows], [1.0, 1.5, 2.5])
    # 0.5, 0.6 and 0.7 with the bias, then in quanta of 0.25.
    np.testing.assert_allclose([row[1] for row in rows], [0.5, 0.5, 0.75])
    many = np.array([observed({})[4] * 10.0 for _ in range(4000)])
    # Standard error of a deviation from 4000 numbers: 2 / sqrt(8000) = 0.022; four of them.
    assert many.std() == pytest.approx(2.0, abs=0.09) and abs(many.mean()) < 0.13


def test_two_groups_may_show_one_reading():
    """Another channel of the same angle, under a name of its own, with another scale and noise."""
    task = LiftTask(Parts(("flexor",), ("agonist", "antagonist"), ("first", "second")))
    groups = {**task.groups, "imu": [Channel("angle", 2.0, -4.0, 4.0, Imperfection(deviation=0.1), "hinge")]}
    seen = Observer(["device", "imu"], task.readings, groups, {"imu.angle": {"quantum": 0.5}}, 0.02)
    device, imu = (s for s in seen.structure if s.name == "angle")
    assert (device.group, imu.group, imu.scale) == ("device", "imu", 2.0)
    assert seen.columns[device.start] == seen.columns[imu.start]
    assert (
        seen.imperfections[imu.start, IMPERFECTION.quantum] == 0.5
        and seen.imperfections[device.start, IMPERFECTION.quantum] == 0.0015
    )
    assert len(set(seen.streams.tolist())) == seen.size


def test_a_channel_more_changes_the_noise_of_no_other():
    plain, more = ElbowLiftEnv(), ElbowLiftEnv(observation=["emg", "privileged.load", "device"])
    (a, _), (b, info) = plain.reset(seed=2), more.reset(seed=2)
    assert b.shape == (19,) and b[6] == pytest.approx(info["load"])
    np.testing.assert_array_equal(a, b[7:])
    for _ in range(3):
        a, b = plain.step(np.zeros(2))[0], more.step(np.zeros(2))[0]
        np.testing.assert_array_equal(a, b[7:])
