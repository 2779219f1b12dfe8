"""What a user can do wrong, and the sentence that says so."""

import gymnasium
import numpy as np
import pytest

from dms_core.errors import InputError
from exo_env.envs.elbow_lift import ElbowLiftEnv, ElbowLiftVectorEnv


@pytest.mark.parametrize(
    ("action", "complaint"),
    [
        ([np.nan, 0.0], "finite numbers"),
        ([np.inf, 0.0], "finite numbers"),
        ([0.0], r"shape \(1,\)"),
        ([[0.0, 0.0]], r"shape \(1, 2\)"),
        (0.5, r"shape \(\)"),
        ("up", "2 numbers"),
        (None, "finite|shape|2 numbers"),
    ],
)
def test_bad_actions(env, action, complaint):
    env.reset(seed=0)
    with pytest.raises(InputError, match=complaint):
        env.step(action)
    # Nothing has happened: the episode goes on.
    assert env.step(np.zeros(2))[4]["time"] == pytest.approx(0.02)


def test_actions_outside_the_box_are_clipped(env):
    env.reset(seed=0)
    beyond = [env.step(np.array([0.3, -7.0]))[0] for _ in range(3)]
    env.reset(seed=0)
    inside = [env.step(np.array([0.3, -1.0]))[0] for _ in range(3)]
    np.testing.assert_array_equal(beyond, inside)


def test_step_before_reset_and_after_the_end():
    env = ElbowLiftEnv(episode_duration=0.1)
    with pytest.raises(gymnasium.error.ResetNeeded, match="reset"):
        env.step(np.zeros(2))
    with pytest.raises(gymnasium.error.ResetNeeded):
        env.readings()
    env.reset(seed=0)
    truncated = [env.step(np.array([-0.5, -1.0]))[3] for _ in range(5)]
    assert truncated == [False] * 4 + [True]
    with pytest.raises(gymnasium.error.ResetNeeded, match="over"):
        env.step(np.zeros(2))


@pytest.mark.parametrize(
    ("settings", "complaint"),
    [
        ({"patient": "nobody"}, "unknown population 'nobody'.*healthy"),
        ({"patient": {"strength": -1.0}}, "strength"),
        ({"patient": 3}, "patient = 3"),
        ({"load": -1.0}, "load = -1.0"),
        ({"load": "heavy"}, "load = 'heavy'"),
        ({"exoskeleton": "shoulder"}, "exoskeleton = 'shoulder': .*elbow"),
        ({"exoskeleton": {"mass": 1.0}}, "mass"),
        ({"reference": {"amplitude_deg": 70.0}}, "at most 100"),
        ({"reference": {"speed": 1.0}}, "speed"),
        ({"action_mode": "torque"}, "action_mode = 'torque': .*rope_tension"),
        ({"drive_settings": {"setpoint_range": 0.1}}, "setpoint_range"),
        ({"observation": []}, "observation"),
        ({"observation": ["device", "device"]}, "different groups"),
        ({"observation": ["eeg"]}, "group 'eeg' is unknown; there are device, emg, estimated, privileged"),
        ({"noise": {"emg": {"deviation": 0.1}}}, "channel 'emg' is not observed"),
        ({"noise": {"angle": {"deviation": -0.1}}}, "deviation"),
        ({"noise": "some"}, "noise = 'some'"),
        ({"reward_weights": {"beauty": 1.0}}, "beauty"),
        ({"limits": {"lowest_deg": 80.0, "highest_deg": 70.0}}, "lowest_deg = 80.0 must be below"),
        ({"observation": ["device.weight"]}, "group 'device' has no channel 'weight'; it has .*angle"),
        ({"observation": ["device", "device.angle"]}, "asks for a channel twice"),
        ({"exoskeleton": {"lower_link": {"weight": 1.0}}}, "exoskeleton: Link: unknown key 'weight'"),
        ({"exoskeleton": "nowhere.yaml"}, "file 'nowhere.yaml' cannot be read"),
        ({"exoskeleton": 3}, "exoskeleton = 3: expected one of elbow, a YAML file, or a mapping"),
        ({"misalignment": "2 mm"}, "misalignment = '2 mm': expected a mapping"),
        ({"subject": "horse"}, "subject = 'horse': expected one of arm26, or a YAML file"),
        ({"cycle": 0}, "cycle = 0: expected a whole number from 1"),
        ({"drive_settings": 3}, "drive_settings = 3: expected a mapping"),
        ({"drive_settings": {"max_tension": [1.0, 2.0, 3.0]}}, "max_tension"),
        ({"drive_settings": {"max_tension": [100.0]}}, "has 1 numbers; expected one for each of the device's 2 ropes"),
        ({"control_rate": True}, "control_rate = True"),
        ({"control_rate": 0.0}, "control_rate = 0.0"),
        ({"control_rate": "fast"}, "control_rate = 'fast'"),
        ({"episode_duration": float("nan")}, "episode_duration = nan"),
        ({"repetitions": 0}, "repetitions = 0: expected a whole number from 1 to 20"),
        ({"repetitions": 21}, "repetitions = 21"),
        ({"repetitions": 2.0}, "repetitions = 2.0"),
        ({"repetitions": True}, "repetitions = True"),
        ({"reference": {"count": 2}}, "count"),
        ({"rtol": 1.0}, "rtol = 1.0"),
        ({"wings": 2}, "setting 'wings' is unknown; there are action_mode, control_rate"),
        ({"render_mode": "ascii"}, "render_mode = 'ascii': .*rgb_array"),
    ],
)
def test_bad_settings(settings, complaint):
    with pytest.raises(InputError, match=complaint):
        ElbowLiftEnv(**settings)


@pytest.mark.parametrize(
    ("options", "complaint"),
    [
        ({"weight": 1.0}, "option 'weight' is unknown; there are initial_angle_deg, load, patient, reference"),
        ({"load": 0.0}, "load = 0.0"),
        ({"patient": "nobody"}, "nobody"),
        ({"initial_angle_deg": 170.0}, "initial_angle_deg = 170.0"),
        ({"initial_angle_deg": "low"}, "initial_angle_deg = 'low'"),
        ({"reference": {"start_deg": 5.0}}, "start_deg"),
    ],
)
def test_bad_options(env, options, complaint):
    with pytest.raises(InputError, match=complaint):
        env.reset(options=options)
    with pytest.raises(gymnasium.error.ResetNeeded):
        env.step(np.zeros(2))


def test_a_population_file_with_a_wrong_value(tmp_path):
    path = tmp_path / "wrong.yaml"
    path.write_text("base: healthy\nfields:\n  strength: {uniform: [0.5, 99.0]}\n")
    with pytest.raises(InputError, match="wrong.yaml.*strength"):
        ElbowLiftEnv(patient=str(path))


def test_a_first_reset_that_is_refused_leaves_the_made_environment_usable():
    env = gymnasium.make("exo_env:exo/ElbowLift-v2")
    with pytest.raises(InputError, match="foo"):
        env.reset(seed=0, options={"foo": 1})
    env.reset(seed=0)
    assert np.isfinite(env.step(np.zeros(2, np.float32))[0]).all()
    env.close()


@pytest.mark.parametrize("options", [3, [{"load": 1.0}], "load"])
def test_options_that_are_no_mapping_are_refused(options):
    env, batch = ElbowLiftEnv(), ElbowLiftVectorEnv(2)
    for world in (env, batch):
        with pytest.raises(InputError, match="options = .* mapping"):
            world.reset(seed=0, options=options)
    batch.close()


def test_a_load_that_is_no_number_is_refused_in_a_line():
    with pytest.raises(InputError, match=r"load = nan: expected a number from 0.05 to 50.0 kg") as caught:
        ElbowLiftEnv(load=float("nan"))
    assert "\n" not in str(caught.value)


def test_limits_that_exclude_the_starts_are_refused_at_once():
    with pytest.raises(InputError, match="may start from 20 to .* begin from 30 to"):
        ElbowLiftEnv(limits={"lowest_deg": 30.0})
    env = ElbowLiftEnv(limits={"lowest_deg": 30.0}, reference={"start_deg": 35.0})
    with pytest.raises(InputError, match="may start from 20 to 20 deg"):
        env.set_reset_options({"reference": {"start_deg": 20.0}})


@pytest.mark.parametrize(
    ("options", "complaint"),
    [
        ({"load": "abc"}, "load = 'abc'"),
        ({"patient": "nobody"}, "population 'nobody'"),
        ({"initial_angle_deg": "low"}, "initial_angle_deg = 'low'"),
    ],
)
def test_reset_options_are_checked_when_they_are_set(env, options, complaint):
    with pytest.raises(InputError, match=complaint):
        env.set_reset_options(options)


def test_reset_options_are_a_copy():
    env, options = ElbowLiftEnv(), {"load": {"uniform": [1.0, 1.0]}}
    env.set_reset_options(options)
    options["load"]["uniform"][:] = [3.0, 3.0]
    env.reset(seed=0)
    assert env.episode.load == 1.0


@pytest.mark.parametrize(("seed", "complaint"), [(1.5, "seed = 1.5"), ("12", "seed = '12'"), ([1, 2, 3], "3 seeds")])
def test_seeds_of_a_batch(seed, complaint):
    worlds = ElbowLiftVectorEnv(2)
    try:
        with pytest.raises(InputError, match=complaint):
            worlds.reset(seed=seed)
    finally:
        worlds.close()


@pytest.mark.parametrize(
    ("device", "complaint"),
    [
        ({"ropes": {"agonist": {"lower": [33.8, -72.5, 50.0]}}}, r"lower\S* = 33.8.*at most 1"),
        ({"guide_distance": 16.0}, "guide_distance = 16.0.*at most 0.6"),
        ({"lower_link": {"mass": 450.0}}, "mass = 450.0.*at most 20"),
        ({"lower_link": {"centre_of_mass": [0.0, -100.0, 50.0]}}, r"centre_of_mass\S* = -100.0.*from -1|at least -1"),
        ({"actuator": {"time_constant": 1.0}}, "time_constant = 1.0.*at most 0.5"),
    ],
)
def test_numbers_of_a_device_in_another_unit_are_refused(device, complaint):
    with pytest.raises(InputError, match=complaint):
        ElbowLiftEnv(exoskeleton=device)


NO_NUMBERS = {
    "texts": lambda shape: np.full(shape, "0.1"),
    "dates": lambda shape: np.full(shape, "2020-01-01", dtype="M8[D]"),
    "masked": lambda shape: np.ma.masked_array(np.zeros(shape), np.ones(shape, bool)),
    "complex": lambda shape: np.full(shape, 0.1 + 1j),
    "too large": lambda shape: np.full(shape, 10**400, dtype=object).tolist(),
    "nothing": lambda shape: np.full(shape, None).tolist(),
    "rows of other lengths": lambda shape: [[0.1], *np.zeros(shape).tolist()],
}
"""What NumPy would read numbers out of, or refuse in its own words."""


@pytest.mark.parametrize("kind", NO_NUMBERS)
def test_actions_that_are_no_numbers(env, kind):
    env.reset(seed=0)
    with pytest.raises(InputError, match="^action .*expected 2 numbers"):
        env.step(NO_NUMBERS[kind]((2,)))
    worlds = ElbowLiftVectorEnv(2)
    worlds.reset(seed=0)
    with pytest.raises(InputError, match="^actions .*expected"):
        worlds.step(NO_NUMBERS[kind]((2, 2)))
    worlds.close()


@pytest.mark.parametrize("kind", [list, tuple, np.float16, np.int8, bool, ">f8", "g", object])
def test_numbers_of_all_kinds_are_an_action(env, kind):
    env.reset(seed=0)
    given = kind([1, 0]) if kind in (list, tuple) else np.array([1, 0], dtype=kind)
    found = env.step(given)[0]
    env.reset(seed=0)
    assert np.array_equal(found, env.step(np.array([1.0, 0.0]))[0])
