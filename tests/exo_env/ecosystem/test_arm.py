"""The subject: arm26 unchanged by default, and scaled by published fractions."""

import math

import numpy as np
import pytest

from dms_core.errors import InputError
from exo_env.ecosystem.arm import Arm
from exo_env.ecosystem.person import HEIGHT_0, MASS_0, Person
from tests.arm26 import subject, table

EXACT = 1e-12
"""The reference tables have 12 digits."""


@pytest.mark.parametrize("row", table("arm26_paths_via_points_only"), ids=lambda r: f"{r['elbow_flexion_deg']:.0f}deg")
def test_lengths_and_moment_arms_of_the_internal_model(row):
    for m in Arm().muscles:
        length, arm = Arm().muscle_geometry(m, math.radians(row["elbow_flexion_deg"]))
        # 1e-9 m is what the reference asks for.
        assert length == pytest.approx(row[f"{m}_length_m"], abs=1e-9)
        assert arm == pytest.approx(row[f"{m}_elbow_moment_arm_m"], abs=1e-9)


@pytest.mark.parametrize("row", table("arm26_elbow_inertia_gravity"), ids=lambda r: f"{r['elbow_flexion_deg']:.0f}deg")
def test_inertia_and_weight_of_the_internal_model(row):
    arm = Arm()
    # 1e-10 is what the reference asks for.
    assert arm.inertia_about_elbow() == pytest.approx(row["generalised_inertia_kg_m2"], abs=1e-10)
    moment = arm.gravity_moment(math.radians(row["elbow_flexion_deg"]))
    assert moment == pytest.approx(row["gravity_generalised_force_Nm"], abs=1e-10)


def test_the_default_person_is_arm26():
    facts = subject()
    for ours, theirs in (("humerus", "r_humerus"), ("forearm", "r_ulna_radius_hand")):
        segment, body = Arm().segments[ours], facts["bodies"][theirs]
        assert segment.mass == body["mass"]
        np.testing.assert_array_equal(segment.centre_of_mass, body["centre_of_mass"])
        np.testing.assert_array_equal(segment.inertia, body["inertia"])
    for m in Arm().muscles:
        muscle = Arm().muscle(m)
        for key in ("max_isometric_force", "optimal_fibre_length", "tendon_slack_length"):
            assert getattr(muscle, key) == facts["muscles"][m][key]


def test_a_taller_and_heavier_person():
    k, f = 1.1, 1.3
    arm = Arm(Person(body_mass=f * MASS_0, height=k * HEIGHT_0))
    assert arm.segments["forearm"].mass == pytest.approx(f * Arm().segments["forearm"].mass, rel=EXACT)
    # J about the elbow: mass times length squared.
    assert arm.inertia_about_elbow() == pytest.approx(f * k * k * Arm().inertia_about_elbow(), rel=EXACT)
    for m in Arm().muscles:
        muscle, before = arm.muscle(m), Arm().muscle(m)
        assert muscle.optimal_fibre_length == pytest.approx(k * before.optimal_fibre_length, rel=EXACT)
        assert muscle.tendon_slack_length == pytest.approx(k * before.tendon_slack_length, rel=EXACT)
        assert muscle.max_isometric_force == pytest.approx(f / k * before.max_isometric_force, rel=EXACT)
        assert arm.muscle_geometry(m, 1.0)[0] == pytest.approx(k * Arm().muscle_geometry(m, 1.0)[0], rel=EXACT)


def test_a_woman_of_the_published_mean():
    arm = Arm(Person(sex="female", body_mass=61.9, height=1.735))
    # de Leva (1996), table 4: forearm 1.38 % and hand 0.56 % of body mass, forearm 0.2643 m against 0.2689 m. The
    # masses of arm26 are rounded to 1e-6 kg, which MASS_0 inherits.
    assert arm.segments["forearm"].mass == pytest.approx((0.0138 + 0.0056) * 61.9, rel=2e-6)
    assert arm.segments["humerus"].mass == pytest.approx(0.0255 * 61.9, rel=2e-6)
    assert arm.length_factor("forearm") == pytest.approx(0.2643 / 0.2689, rel=EXACT)


def test_strength_scales_force_alone():
    weak = Arm(Person(strength=0.5)).muscle("BRA")
    assert weak.max_isometric_force == pytest.approx(0.5 * Arm().muscle("BRA").max_isometric_force, rel=EXACT)
    assert weak.optimal_fibre_length == Arm().muscle("BRA").optimal_fibre_length


def test_an_impossible_person_is_named():
    with pytest.raises(InputError, match="body_mass = -3"):
        Person(body_mass=-3.0)
    with pytest.raises(InputError, match="unknown key 'weight'"):
        Person(weight=70.0)
