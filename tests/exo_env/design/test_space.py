"""Numbers of a design by name, their bounds, and the gains that go with the lever."""

import math

import numpy as np
import pytest

from dms_core.errors import InputError
from exo_env.design.space import Bounds, Design, DesignSpace
from exo_env.ecosystem.cuff import Cuff
from exo_env.ecosystem.exoskeleton import Exoskeleton
from tests.exo_env.design.cases import space


def test_a_design_moves_what_it_names_and_nothing_else():
    designs = space(bounds={"ropes.agonist.lower.1": (-0.1, -0.05), "guide_distance": (0.1, 0.2)})
    found = designs.design(np.array([-0.09, 0.15])).device
    today = designs.today.device
    assert found.ropes["agonist"].lower == (0.0338, -0.09, 0.05) and found.guide_distance == 0.15
    assert found.ropes["agonist"].upper == today.ropes["agonist"].upper
    assert found.ropes["antagonist"] == today.ropes["antagonist"] and found.lower_link == today.lower_link
    assert designs.design(designs.start).device == today


def test_the_gains_keep_the_critical_product_of_gain_and_lever():
    designs = space(bounds={"ropes.agonist.lower.1": (-0.1, -0.05)})
    found, today = designs.design(np.array([-0.1])).device, designs.today.device
    levers = [device.moment_arm("agonist", math.radians(60.0)) for device in (today, found)]
    assert levers[1] > 1.1 * levers[0]
    for part, name in (("gains", "kp"), ("gains", "ki"), ("gains", "kd"), ("tuning", "Kc")):
        before, after = (getattr(getattr(device, part), name) for device in (today, found))
        assert after * levers[1] == pytest.approx(before * levers[0], rel=1e-12)
    assert found.tuning.Tc == today.tuning.Tc


def test_without_bounds_rope_ends_guide_and_cuff_may_move():
    rigid, compliant = space(), space(cuff=True)
    assert len(rigid.names) == 9 and "guide_distance" in rigid.names
    assert set(compliant.names) - set(rigid.names) == {"cuff.stiffness.0", "cuff.stiffness.1"}
    assert rigid.at_bounds(rigid.start) == [] and rigid.at_bounds(rigid.low) == list(rigid.names)
    assert (rigid.low < rigid.start).all() and (rigid.start < rigid.high).all()
    softer = compliant.design(compliant.low)
    assert softer.cuff is not None and softer.cuff.stiffness[0] == pytest.approx(0.5 * Cuff().stiffness[0])


def test_bounds_that_nobody_gave_are_clipped_to_what_a_device_can_have():
    device = Exoskeleton.named("elbow")
    near = DesignSpace(Design(device.changed(guide_distance=0.025)))
    # Within a hundredth of the reach of 30 mm.
    assert 0.0 < near.low[near.names.index("guide_distance")] < 3e-4
    assert near.high[near.names.index("guide_distance")] == pytest.approx(0.055)
    far = DesignSpace(Design(device.changed(guide_distance=0.59)))
    assert 0.5997 < far.high[far.names.index("guide_distance")] <= 0.6
    # A horn of 3 cm: a bound 30 mm off would let the rope turn the elbow the other way.
    horn = DesignSpace(Design(device.changed(agonist={"lower": (0.0127, -0.0272, 0.05)})))
    assert set(horn.names) == set(near.names) and (horn.low < horn.start).all() and (horn.start < horn.high).all()
    k = horn.names.index("ropes.agonist.lower.0")
    assert horn.low[k] > horn.start[k] - 0.0299
    # At the limit itself the number may move one way only.
    edge = DesignSpace(Design(device.changed(guide_distance=0.6)))
    assert edge.high[edge.names.index("guide_distance")] == 0.6


def test_a_rope_whose_name_holds_dots():
    device = Exoskeleton.named("elbow")
    ropes = {"left.2": device.ropes["agonist"].model_dump(), "right": device.ropes["antagonist"].model_dump()}
    designs = DesignSpace(
        Design(Exoskeleton(**{**device.model_dump(), "ropes": ropes})), {"ropes.left.2.lower.0": (0, 0.05)}
    )
    assert designs.design(np.array([0.05])).device.ropes["left.2"].lower[0] == 0.05


@pytest.mark.parametrize(
    ("bounds", "message"),
    [
        ({"ropes.agonist.middle.0": (0, 1)}, "'ropes.agonist.middle.0' is no number that can be designed.*upper"),
        ({"gains.kp": (0, 1e5)}, "'gains.kp' is no number that can be designed"),
        ({"cuff.stiffness.0": (1, 1e4)}, "only with a compliant cuff"),
        ({"guide_distance": (0.2, 0.1)}, "expected a least value below the largest"),
        ({"guide_distance": (0.16, 0.16)}, "expected a least value below the largest"),
        ({"guide_distance": (0.16, 0.1600001)}, "largest, by at least 1e-06"),
        ({"guide_distance": (0.17, 0.2)}, "expected bounds with today's value, 0.16, between them"),
        ({"guide_distance": (-0.1, 0.2)}, "guide_distance = -0.1: .*a number above 0"),
        (
            {"ropes.agonist.lower.0": (-0.05, 0.05)},
            "ropes.agonist.lower.0 = -0.05: .*pulls = 'flexion', but at a hinge",
        ),
    ],
)
def test_wrong_bounds(bounds, message):
    with pytest.raises(InputError, match=message):
        space(bounds=bounds)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("guide_distance: [0.1]", "guide_distance.*Expected 2 items"),
        ("guide_distance: [low, high]", "guide_distance.*a number"),
        ("guide_distance: 0.2", "guide_distance"),
        ("- 1", "."),
        ("", "holds nothing"),
        ("{}", "at least one number"),
    ],
)
def test_a_wrong_file_of_bounds(text, message, tmp_path):
    path = tmp_path / "bounds.yaml"
    path.write_text(text)
    with pytest.raises(InputError, match=message) as error:
        Bounds.read(path)
    assert "bounds.yaml" in str(error.value)
