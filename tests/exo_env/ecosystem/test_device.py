"""The device on an arm: ropes that do what they claim, any elbow axis, and how far askew it is worn."""

from __future__ import annotations

import copy
import math
import warnings

import numpy as np
import pytest
import yaml

from dms_core import Model
from dms_core.errors import InputError
from dms_core.files.config_files import config_file
from dms_core.model import Constant
from dms_core.model.geometry.frames import rotation_matrix
from exo_env.ecosystem.arm import Arm
from exo_env.ecosystem.ecosystem import Ecosystem
from exo_env.ecosystem.exoskeleton import Exoskeleton
from exo_env.ecosystem.worn_exoskeleton import Misalignment, WornExoskeleton, link_axes

DEVICE = Exoskeleton.named("elbow")
UPPER, LOWER = (0.0, 0.20, 0.05), (0.0338, -0.0725, 0.05)
"""Ends of the shipped device's agonist [m]."""
ROPE = {"pulls": "flexion", "upper": list(UPPER), "lower": list(LOWER)}


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        ({"hinge_damping": "1.0"}, "hinge_damping = '1.0': Expected a number"),
        ({"hinge_damping": True}, "hinge_damping = True: Expected a number"),
        ({"upper_link": {"mass": 1, "centre_of_mass": [0, "0", 0], "inertia": [1, 1, 1]}}, "centre_of_mass.1 = '0'"),
        ({"ropes": [1], "agonist": {"upper": [0, 0, 0]}}, r"ropes = \[1\]: expected a mapping of ropes"),
        ({"ropes": {f"r{k}": ROPE for k in range(101)}}, "Expected at most 100 items"),
        ({"ropes": {"mine": "x" * 5000}}, r"ropes.mine = 'x+\.\.\.: Expected a mapping"),
    ],
)
def test_a_file_with_a_wrong_value_is_refused(change, complaint, tmp_path):
    path = tmp_path / "mine.yaml"
    path.write_text(yaml.safe_dump({**yaml.safe_load(config_file("exoskeletons/elbow.yaml").read_text()), **change}))
    with pytest.raises(InputError, match=f"(?s)mine.yaml: Exoskeleton: .*{complaint}") as caught:
        Exoskeleton.named(str(path))
    assert len(str(caught.value)) < 1000


def test_numbers_of_numpy_are_numbers():
    assert DEVICE.changed(hinge_damping=np.float32(1.0), guide_distance=np.float64(0.16)) == DEVICE
    with pytest.raises(InputError, match="hinge_damping = '1.0': Expected a number"):
        DEVICE.changed(hinge_damping="1.0")


@pytest.mark.parametrize(
    ("rope", "complaint"),
    [
        (
            {"pulls": "extension", "upper": UPPER, "lower": LOWER},
            r"ropes.mine: pulls = 'extension', but at a hinge angle of 20 deg its moment arm is 0.0431 m",
        ),
        (
            {"pulls": "flexion", "upper": UPPER, "lower": (0.0, 0.0, 0.05)},
            r"ropes.mine: pulls = 'flexion', .* its moment arm is -?0 m .*expected at least 0.001 m from 20 to 100 deg",
        ),
        (
            {"pulls": "flexion", "upper": (0.0, 0.2, 0.05), "lower": (-0.1, 0.1, 0.05)},
            r"ropes.mine: pulls = 'flexion', but at a hinge angle of 20 deg its moment arm is -",
        ),
        ({"pulls": "flexion", "upper": (0.0, 0.0, 0.05), "lower": (0.0, 0.0, 0.05)}, r"ropes.mine: .* no length"),
    ],
)
def test_a_rope_that_does_not_pull_as_declared_is_refused(rope, complaint):
    with pytest.raises(InputError, match=complaint):
        DEVICE.changed(ropes={"mine": rope})


def _arm_with_axis(tmp_path, axis) -> Arm:
    facts = copy.deepcopy(yaml.safe_load(config_file("subject/arm26.yaml").read_text()))
    facts["joints"]["r_elbow"]["axis_i"] = axis
    path = tmp_path / "mine.yaml"
    path.write_text(yaml.safe_dump(facts))
    return Arm(subject=str(path))


@pytest.mark.parametrize("axis", [(0.0, 0.0, -1.0), (0.1, 0.2, -1.0), (1.0, 0.0, 0.0), (-1.0, 0.5, 0.0)])
def test_a_device_fits_any_elbow_axis_across_the_humerus(tmp_path, axis):
    arm = _arm_with_axis(tmp_path, list(axis))
    worn = WornExoskeleton(DEVICE, arm, Misalignment())
    assert np.isfinite(worn.orientation).all()
    np.testing.assert_allclose(rotation_matrix(worn.orientation), link_axes(arm), atol=1e-15)
    assert [body.name for body in worn.bodies(1.0)] == ["upper_link", "lower_link"]


@pytest.mark.parametrize(
    ("worn", "complaint"),
    [
        ({"shift": [1000.0, 0.0, 0.0]}, r"shift = \[1000.0, 0.0, 0.0\]: expected each component from -0.1 to 0.1 m"),
        ({"shift": [0.0, 0.0, -0.11]}, r"shift = .*expected each component from -0.1 to 0.1 m"),
        ({"tilt_deg": [0.0, 180.0]}, r"tilt_deg = \[0.0, 180.0\]: expected both tilts from -30 to 30 deg"),
    ],
)
def test_a_device_off_the_arm_is_refused(worn, complaint):
    with pytest.raises(InputError, match=complaint):
        Misalignment(**worn)


@pytest.mark.parametrize("angle", [0.4, 1.0, 1.7])
def test_a_misaligned_device_is_declared_closed(angle):
    worn = Misalignment(shift=(0.02, 0.02, 0.01), tilt_deg=(8.0, 4.0))
    ecosystem = Ecosystem(misalignment=worn)
    # The hinge differs from the elbow, or nothing would be shown.
    assert abs(ecosystem.worn().hinge_angle(angle) - angle) > math.radians(1.0)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        model = Model(ecosystem.system(angle, Constant(value=angle)))
    # Rounding of declared Euler parameters and centimetres; states that elements set are not counted.
    assert model.start.moved < 1e-12


def test_an_aligned_hinge_is_at_the_elbow_angle():
    assert Ecosystem().worn().hinge_angle(0.7) == 0.7
