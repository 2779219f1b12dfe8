"""Options of a reset and readings of exo/ElbowLift."""

import math

import gymnasium
import numpy as np
import pytest

from dms_core.errors import InputError
from dms_core.files.config_files import configs
from exo_env.envs.elbow_lift import ElbowLiftEnv

HOLD = np.array([-1.0, -1.0])


def test_options_fix_what_they_name_and_nothing_else(env):
    _, free = env.reset(seed=9)
    _, heavy = env.reset(seed=9, options={"load": 3.0})
    assert heavy["load"] == 3.0
    assert heavy["patient"] == free["patient"] and heavy["reference"] == free["reference"]
    wanted = {"start_deg": 30.0, "amplitude_deg": 50.0, "rest": 0.4, "duration": 2.0, "pause": 0.5}
    _, fixed = env.reset(seed=9, options={"patient": {"strength": 0.7}, "reference": wanted, "initial_angle_deg": 40.0})
    assert fixed["patient"]["strength"] == 0.7 and fixed["patient"]["maximum_activation_flexors"] == 1.0
    assert fixed["reference"] == wanted and fixed["load"] == free["load"]
    assert fixed["initial_angle_deg"] == pytest.approx(40.0, abs=1e-6)


def test_readings_hold_what_the_figures_show(env):
    env.reset(seed=0)
    env.step(HOLD)
    r, units = env.readings(), env.reading_units()
    for name in ("elbow_angle.angle", "reference", "BIClong.sensor.tendon_force", "TRIlong.sensor.tendon_force",
                 "agonist_tension", "antagonist_tension", "muscle_moment", "exo_moment", "elbow_reaction.Fx",
                 "elbow_reaction.Mz", "guide_force.Fx", "gym_rope_tension"):  # fmt: skip
        assert math.isfinite(r[name])
    assert units["agonist_tension"] == "N" and units["exo_moment"] == "Nm"


@pytest.mark.filterwarnings("ignore:.*out of date")
def test_the_old_version_names_the_new_one():
    with pytest.raises(gymnasium.error.DeprecatedEnv, match="exo/ElbowLift-v2"):
        gymnasium.make("exo_env:exo/ElbowLift-v0")


def test_a_device_is_changed_deep_inside_and_by_a_file(tmp_path):
    default = ElbowLiftEnv().ecosystem.device
    changed = ElbowLiftEnv(exoskeleton={"lower_link": {"mass": 1.0}, "gains": {"kp": 100.0}}).ecosystem.device
    assert changed.lower_link.mass == 1.0 and changed.lower_link.inertia == default.lower_link.inertia
    assert changed.gains.kp == 100.0 and changed.gains.kd == default.gains.kd
    old = ElbowLiftEnv(exoskeleton={"agonist": {"upper": [0.0, 0.21, 0.05]}}).ecosystem.device
    assert old.ropes["agonist"].upper[1] == 0.21 and old.ropes["agonist"].lower == default.ropes["agonist"].lower
    path = tmp_path / "mine.yaml"
    text = (configs() / "exoskeletons" / "elbow.yaml").read_text()
    path.write_text(text.replace("hinge_damping: 1.0", "hinge_damping: 0.5"))
    assert ElbowLiftEnv(exoskeleton=str(path)).ecosystem.device.hinge_damping == 0.5


def test_a_device_that_is_worn_askew_starts_closed_and_moves():
    env = ElbowLiftEnv(
        misalignment={"shift": [0.005, -0.004, 0.0], "tilt_deg": [3.0, -2.0]}, action_mode="pid_setpoint"
    )
    env.reset(seed=0)
    for _ in range(20):
        env.step(np.array([0.0, 1.0]))
    r = env.readings()
    # The hinge turns otherwise than the elbow, and the guide still holds.
    assert abs(r["exo_angle.angle"] - r["elbow_angle.angle"]) > 1e-3
    assert r["solver.largest_phi"] < 1e-9
    aligned = ElbowLiftEnv(misalignment={"shift": [0.0, 0.0, 0.0]})
    aligned.reset(seed=0)
    assert aligned.readings()["exo_angle.angle"] == pytest.approx(aligned.readings()["elbow_angle.angle"], abs=1e-12)


def test_a_cycle_of_episodes_comes_again():
    env = ElbowLiftEnv(cycle=3)
    loads = [env.reset(seed=7)[1]["load"]] + [env.reset()[1]["load"] for _ in range(6)]
    assert loads[:3] == loads[3:6] and loads[6] == loads[0] and len(set(loads)) == 3
    assert [env.reset(seed=7)[1]["load"]] + [env.reset()[1]["load"] for _ in range(2)] == loads[:3]


def test_reset_options_that_stay():
    env = ElbowLiftEnv()
    env.set_reset_options({"load": 1.5})
    assert env.reset(seed=0)[1]["load"] == 1.5 and env.reset()[1]["load"] == 1.5
    assert env.reset(options={"load": 0.7})[1]["load"] == 0.7
    with pytest.raises(InputError, match="option 'weight' is unknown"):
        env.set_reset_options({"weight": 1.0})
    env.set_reset_options(None)
    assert env.reset()[1]["load"] != 1.5


def test_a_reference_that_the_episode_cuts_off_is_told():
    with pytest.warns(UserWarning, match="may take 9.3 s, and an episode ends after 6 s"):
        ElbowLiftEnv(reference={"duration": 4.0, "pause": 0.5})


def test_device_groups_of_three_ropes():
    """Muscles, ropes and motors come from the ecosystem: a third rope is a third action."""
    third = {"upper": [0.0, 0.18, 0.05], "lower": [0.0338, -0.0725, 0.05], "pulls": "flexion"}
    settings = {"exoskeleton": {"ropes": {"second": third}}, "drive_settings": {"max_tension": [200.0, 100.0, 50.0]}}
    env = ElbowLiftEnv(**settings)
    observation, _ = env.reset(seed=0)
    assert env.action_space.shape == (3,) and observation.shape == (14,)
    for _ in range(10):
        observation, *_ = env.step(np.array([-0.5, -1.0, 1.0]))
    r = env.readings()
    assert r["second_tension"] > 40.0 and observation[4] == pytest.approx(r["second_tension"] / 100.0, abs=0.05)
    assert r["solver.largest_phi"] < 1e-9
