"""Measures of an episode on profiles whose smoothness, work and errors are known."""

import math

import numpy as np
import pytest

from agents.environment import ENVIRONMENT, make
from agents.evaluation.episodes.episode import episode
from agents.evaluation.episodes.measures import (
    READ,
    REPETITIONS,
    TENSION,
    Record,
    left_out,
    measured,
    positive_work,
    smoothness,
    sparc,
)
from agents.policies.policy import Policy
from dms_core.files.config_files import configs
from exo_env.tasks.movements.repetition import Repetition

FREQUENCY = 100.0
ROPES = ("agonist_tension", "antagonist_tension", "helper_tension")


def bump(duration=1.0, frequency=FREQUENCY):
    """Speed of a minimum-jerk reach of length 1 (Flash and Hogan 1985)."""
    s = np.arange(0.0, duration, 1.0 / frequency) / duration
    return 30.0 * s**2 * (1.0 - s) ** 2 / duration


def arc_length_of_gaussian(deviation):
    """SPARC of a Gaussian speed profile in closed form but for one integral.

    The spectrum exp(-2 (pi f s)^2) falls to 5 % at f_c; the length of its graph over f / f_c from 0 to 1.
    """
    cutoff = math.sqrt(-math.log(0.05) / 2.0) / (math.pi * deviation)
    f = np.linspace(0.0, cutoff, 20001)
    spectrum = np.exp(-2.0 * (np.pi * f * deviation) ** 2)
    return -float(np.sum(np.hypot(np.diff(f / cutoff), np.diff(spectrum))))


def test_sparc_of_a_gaussian_profile():
    deviation, times = 0.15, np.arange(-1.0, 1.0, 1.0 / FREQUENCY)
    found = sparc(np.exp(-0.5 * (times / deviation) ** 2), FREQUENCY)
    # The cutoff is met to a step of the transform, 100 / 4096 Hz of 2.6 Hz: 1 % of the horizontal part, which is
    # rescaled to 1 and so changes nothing but the end of the fall, at most 1 % of 0.95.
    assert found == pytest.approx(arc_length_of_gaussian(deviation), abs=0.01)


def test_sparc_of_a_minimum_jerk_reach():
    # Its spectrum by quadrature of the polynomial instead of a transform; the cutoff is met to a step of the transform.
    f, s = np.linspace(0.0, 10.0, 4001), np.linspace(0.0, 1.0, 1001)
    spectrum = np.abs(np.trapezoid(30.0 * s**2 * (1.0 - s) ** 2 * np.exp(-2j * np.pi * f[:, None] * s), s))
    last = np.flatnonzero(spectrum >= 0.05)[-1] + 1
    expected = -np.sum(np.hypot(np.diff(f[:last]) / f[last - 1], np.diff(spectrum[:last])))
    assert sparc(bump(), FREQUENCY) == pytest.approx(expected, abs=0.01)
    assert expected == pytest.approx(-1.41, abs=0.005)  # the figure that the docstring names


@pytest.mark.parametrize("factor", [0.1, 10.0])
def test_sparc_does_not_see_amplitude(factor):
    assert sparc(factor * bump(), FREQUENCY) == pytest.approx(sparc(bump(), FREQUENCY), rel=1e-12)


def test_sparc_hardly_sees_duration():
    # The scale of frequency cancels but for the steps of the transform.
    assert sparc(bump(2.0), FREQUENCY) == pytest.approx(sparc(bump(), FREQUENCY), abs=0.02)


def test_each_submovement_more_is_less_smooth():
    pause = np.zeros(50)
    one = bump(0.5)
    found = [sparc(np.concatenate([one, *(n * [pause, one])]), FREQUENCY) for n in range(4)]
    assert all(later < earlier - 0.3 for earlier, later in zip(found, found[1:], strict=False))


def test_tremor_is_less_smooth():
    times = np.arange(0.0, 1.0, 1.0 / FREQUENCY)
    assert sparc(np.abs(bump() + 0.5 * np.sin(2.0 * np.pi * 6.0 * times)), FREQUENCY) < sparc(bump(), FREQUENCY) - 0.2


@pytest.mark.parametrize("speed", [np.zeros(50), np.ones(3), np.array([])])
def test_no_movement_has_no_smoothness(speed):
    assert math.isnan(sparc(speed, FREQUENCY))


def test_smoothness_takes_lift_and_return_apart():
    r = Repetition(rest=0.5, duration=1.0, pause=0.5)
    times = np.arange(0.0, 4.0, 0.02)
    rate = r.course(times)[:, 1]
    # As one movement it would have two peaks; apart each is a reach and a rest.
    assert smoothness(r, times, rate, 0.02) == pytest.approx(-1.41, abs=0.02)
    assert sparc(np.abs(rate), 50.0) < -2.0
    often = r.model_copy(update={"count": 3, "every": 4.0})
    times = np.arange(0.0, 12.0, 0.02)
    assert smoothness(often, times, often.course(times)[:, 1], 0.02) == pytest.approx(-1.41, abs=0.02)


def test_positive_work():
    times = np.linspace(0.0, 2.0 * np.pi, 2001)
    # The positive half of a sine holds 2 J; the trapezoidal rule errs by h^2 / 12 of the slopes at the ends, 1e-6.
    assert positive_work(times, np.sin(times)) == pytest.approx(2.0, abs=1e-5)


def record_of(**columns):
    """An episode of 3 s with these readings; all others are 0."""
    times = np.arange(0.0, 3.0, 0.02)
    given = {"time": times, **columns}
    record = Record(Repetition(), ROPES, 0.02)
    for k in range(len(times)):
        record.add({name: float(np.broadcast_to(given.get(name, 0.0), times.shape)[k]) for name in (*READ, *ROPES)})
    return record


def test_measures_of_a_made_up_episode():
    record = record_of(
        **{"elbow_angle.rate": 2.0, "exo_angle.rate": 2.0, "muscle_moment": 1.0, "exo_moment": 3.0},
        tracking_error=math.radians(-5.0), agonist_tension=7.0, antagonist_tension=9.0, helper_tension=150.0,
        elbow_reaction=400.0,
    )  # fmt: skip
    record.rewards, record.event = [1.0, 2.5], "The rope broke."
    found = measured(record)
    expected = {
        "return": 3.5, "tracking_rms_deg": 5.0, "tracking_peak_deg": 5.0, "device_work_share": 0.75,
        "patient_work_share": 0.25, "peak_tension_N": 150.0, "peak_reaction_N": 400.0, "unsafe": 1.0,
    }  # fmt: skip
    # Constants: only round-off.
    assert {k: found[k] for k in expected} == pytest.approx(expected, rel=1e-12)


def test_braking_is_no_share_of_the_work():
    found = measured(
        record_of(**{"elbow_angle.rate": 2.0, "exo_angle.rate": 2.0, "muscle_moment": 1.0}, exo_moment=-3.0)
    )
    assert (found["device_work_share"], found["patient_work_share"]) == (0.0, 1.0)


def test_what_an_environment_does_not_have_is_left_out_and_named():
    record = Record(None, ROPES, 0.02)
    record.add(dict.fromkeys((*READ, *ROPES[:2]), 1.0))
    # The peak over two of three ropes would be a wrong number.
    assert left_out(record) == {"peak_tension_N": [TENSION], "smoothness_sparc": [REPETITIONS]}


class OnlyTheHelper(Policy):
    """The third rope pulls, and the other two are slack; the tension that it reaches is kept."""

    title, action_mode = "helper", "rope_tension"

    def reset(self, env):
        self.world, self.reached = env.unwrapped, [env.unwrapped.readings()]

    def __call__(self, observation, info):
        self.reached.append(self.world.readings())
        return np.array([-1.0, -1.0, 1.0])


def test_the_peak_tension_is_that_of_any_rope_of_the_device():
    device = configs().parent / "tests" / "outside" / "steady" / "three_ropes.yaml"
    env = make(
        ENVIRONMENT, exoskeleton=str(device), drive_settings={"max_tension": [200.0, 100.0, 150.0]},
        patient="stroke_mild", episode_duration=0.4,
    )  # fmt: skip
    acting = OnlyTheHelper()
    found = episode(env, acting, 0)["measures"]["peak_tension_N"]
    acting.reached.append(env.unwrapped.readings())
    env.close()
    helper, others = (
        max(r[f"{rope}_tension"] for r in acting.reached for rope in ropes)
        for ropes in (["helper"], ["agonist", "antagonist"])
    )
    assert found == helper > others
