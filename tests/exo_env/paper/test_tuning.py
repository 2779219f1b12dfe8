"""The tuning command, and that the shipped gains are what it finds."""

import json

import numpy as np
import pytest
import yaml

from dms_core.files.config_files import config_file
from dms_core.files.outputs import MANIFEST
from dms_core.model.control.ziegler_nichols import STEP, oscillation
from exo_env.__main__ import main
from exo_env.ecosystem.exoskeleton import Exoskeleton
from exo_env.paper.tuning import START, StepExperiment, proportional

DEVICE = "exoskeletons/elbow.yaml"


@pytest.fixture(scope="module")
def device() -> Exoskeleton:
    return Exoskeleton.from_config(DEVICE)


@pytest.fixture(scope="module")
def experiment(device) -> StepExperiment:
    return StepExperiment(device)


@pytest.mark.slow
def test_the_command_finds_the_shipped_gains(device, tmp_path, capsys):
    assert main(["tune", "--out", str(tmp_path)]) == 0
    found = json.loads((tmp_path / "tuning.json").read_text())
    # The bracket of Kc is 0.2 % wide; the period is read from samples of 1 ms.
    assert device.tuning.Kc == pytest.approx(found["Kc_N_per_rad"], rel=5e-3)
    assert device.tuning.Tc == pytest.approx(found["Tc_s"], rel=1e-2)
    for name, key in (("kp", "kp_N_per_rad"), ("ki", "ki_N_per_rad_s"), ("kd", "kd_N_s_per_rad")):
        assert getattr(device.gains, name) == pytest.approx(found[key], rel=2e-2)
    printed = capsys.readouterr().out
    assert "Kc = " in printed and "/ 500 = " in printed and "first-order lag of 1 ms" in printed
    assert {p.name for p in tmp_path.iterdir()} == {
        "tuning.json", "fig06_critical_gain.png", "fig07_tuned.png", MANIFEST,
    }  # fmt: skip


def test_a_device_of_ones_own_is_tuned(device, tmp_path, capsys):
    """Twice the lag of the motors halves the critical gain, by Kc r = c / T + c^2 / J, of a small second part."""
    content = yaml.safe_load(config_file("exoskeletons/elbow.yaml").read_text())
    content["actuator"]["time_constant"] *= 2.0
    path = tmp_path / "slow.yaml"
    path.write_text(yaml.safe_dump(content))
    assert main(["tune", "--out", str(tmp_path / "out"), "--exoskeleton", str(path)]) == 0
    critical = json.loads((tmp_path / "out" / "tuning.json").read_text())["Kc_N_per_rad"]
    assert critical == pytest.approx(0.5 * device.tuning.Kc, rel=0.1)
    assert "first-order lag of 2 ms" in capsys.readouterr().out


def test_a_wrong_device_is_named_with_key_and_value(tmp_path, capsys):
    content = yaml.safe_load(config_file("exoskeletons/elbow.yaml").read_text()) | {"hinge_damping": -1.0}
    path = tmp_path / "wrong.yaml"
    path.write_text(yaml.safe_dump(content))
    assert main(["tune", "--out", str(tmp_path), "--exoskeleton", str(path)]) == 2
    assert "wrong.yaml: Exoskeleton: hinge_damping = -1.0" in capsys.readouterr().err


def test_critical_gain_and_period_by_theory(device):
    """A forearm of inertia J and damping c under a lagged rope: Kc r = c/T + c^2/J, Tc = 2 pi sqrt(J T / c).

    J is that of forearm and lower link; c is the hinge's alone, without the passive muscles, which add about a tenth.
    """
    from exo_env.ecosystem.arm import Arm

    link = device.lower_link
    lever = np.hypot(*link.centre_of_mass[:2])
    inertia = Arm().inertia_about_elbow() + link.inertia[2] + link.mass * lever**2
    lag, c = device.actuator.time_constant, device.hinge_damping
    stiffness = device.tuning.Kc * device.moment_arm("agonist", START + STEP)
    assert stiffness == pytest.approx(c / lag + c * c / inertia, rel=0.2)
    assert device.tuning.Tc == pytest.approx(2.0 * np.pi * np.sqrt(inertia * lag / c), rel=0.1)


def test_below_the_critical_gain_it_decays_above_it_grows(device, experiment):
    below, above = (oscillation(*experiment.response(proportional(f * device.tuning.Kc))) for f in (0.95, 1.05))
    assert below.growth < -1e-3 and above.growth > 1e-3


def test_the_tuned_loop_settles(device, experiment):
    from dms_core.model.control.ziegler_nichols import Gains

    times, angle = experiment.response(Gains(**dict(device.gains)), 0.5)
    assert angle[0] == pytest.approx(START, abs=1e-6)
    late = angle[times > 0.3]
    # A tenth of a degree: stiffness of muscles and weight of the arm, which change over the step, stay in the error.
    np.testing.assert_allclose(late, START + STEP, atol=np.radians(0.1))
