"""Populations between two others."""

import numpy as np
import pytest

from dms_core.errors import InputError
from exo_env.patient.between import between
from exo_env.patient.population import Population

NEAR, FAR = Population.shipped("evaluation"), Population.shipped("shifted")


def test_both_ends_are_the_populations_themselves():
    assert between(NEAR, FAR, 0.0) is NEAR and between(NEAR, FAR, 1.0) is FAR


def test_numbers_lie_between():
    middle = between(NEAR, FAR, 0.25).fields
    for name, spec in middle.items():
        a, b = NEAR.fields[name], FAR.fields[name]
        if "normal" in spec:
            for key, value in spec["normal"].items():
                assert value == pytest.approx(0.75 * a["normal"][key] + 0.25 * b["normal"][key]), name
        elif "log_uniform" in spec:
            ends = zip(a["log_uniform"], b["log_uniform"], strict=True)
            assert spec["log_uniform"] == pytest.approx([x**0.75 * y**0.25 for x, y in ends]), name
    assert middle["sex"]["choice"] == ["male", "female"]


def test_patients_change_steadily_with_the_part():
    def activation(part):
        source = between(NEAR, FAR, part)
        return np.mean([source.sample(k).maximum_activation_flexors for k in range(200)])

    courses = [activation(part) for part in (0.0, 0.25, 0.5, 0.75, 1.0)]
    assert courses == sorted(courses, reverse=True) and courses[0] > courses[-1] + 0.05


@pytest.mark.parametrize(
    ("one", "other", "part", "said"),
    [
        (NEAR, FAR, -0.1, "part = -0.1"),
        (NEAR, FAR, float("nan"), "part = nan"),
        (NEAR, Population.shipped("mixed"), 0.5, "'mixed, for training' is a mixture"),
        (
            NEAR,
            Population(base="evaluation", fields={"body_mass": 70.0}),
            0.5,
            "only one has body_mass, body_mass_index",
        ),
        (NEAR, Population.shipped("wide"), 0.5, "fields: .*: nothing lies between .* distributions of one kind"),
    ],
)
def test_what_nothing_lies_between(one, other, part, said):
    with pytest.raises(InputError, match=said):
        between(one, other, part)
