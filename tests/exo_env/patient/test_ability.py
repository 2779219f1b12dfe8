"""What is needed and what is lacking: against statics, and in the order of impairment."""

import numpy as np
import pytest

from dms_core.files.config_files import configs
from exo_env.ecosystem.arm import Arm
from exo_env.ecosystem.ecosystem import Ecosystem
from exo_env.ecosystem.exoskeleton import Exoskeleton
from exo_env.ecosystem.gym_machine import GymMachine
from exo_env.envs.elbow_lift import ElbowLiftEnv
from exo_env.envs.hidden_intent import HiddenIntentEnv
from exo_env.patient.ability import SMALLEST_SCALE, Need, ability, lacking_when, put_lacking, voluntary
from exo_env.patient.excitation.motor_command import InternalModel, plan_course
from exo_env.patient.patient import MIDDLE, Patient
from exo_env.tasks.movements.repetition import Repetition

DEVICE = Exoskeleton.from_config("exoskeletons/elbow.yaml")
TIMES = np.linspace(0.0, 6.0, 301)
COURSE = Repetition().course(TIMES)


def known(patient=None, load=1.0):
    patient = patient or Patient()
    return InternalModel.of(Arm(patient.person), GymMachine.from_config("gym_machine/pulley.yaml"), load)


def need(patient, model, course):
    """Need of a movement."""
    lacking, weights = np.zeros(len(course)), np.full(len(course), model.load.weight)
    link, needed, ratio = DEVICE.lower_link.numbers(), np.zeros(len(course)), np.zeros(len(course))
    found, scale = put_lacking(patient.row(), model.arm, model.load, weights, link, course, needed, ratio, lacking)
    return Need(found, lacking, scale)


def test_moment_of_muscles_is_that_of_the_motor_command():
    """At rest, what the command wants to give is what the muscles give by their equilibrium."""
    model, still = known(), np.tile([MIDDLE, 0.0, 0.0], (5, 1))
    command = plan_course(model, np.linspace(0.0, 0.2, 5), still)
    # The iteration of the command ends at a change of 1e-4 of every activation: 0.01 Nm of 100 Nm.
    assert model.muscle_moment(MIDDLE, command.activations[2]) == pytest.approx(model.resting_moment(MIDDLE), abs=0.02)


def test_voluntary_moment_is_that_of_full_flexors_less_co_contraction():
    model = known()
    full = model.muscle_moment(MIDDLE, np.where(Arm().signs > 0.0, 1.0, 0.01))
    assert voluntary(Patient().row(), model.arm, MIDDLE) == pytest.approx(full, rel=1e-12)
    both = model.muscle_moment(MIDDLE, np.where(Arm().signs > 0.0, 0.32, 0.1))
    weak = Patient(maximum_activation_flexors=0.4, fatigued_at_start=0.2, co_contraction=0.25)
    assert voluntary(weak.row(), model.arm, MIDDLE) == pytest.approx(both, rel=1e-12)
    # No more is driven against it than the extensors have left.
    limp = weak.changed(maximum_activation_extensors=0.05)
    assert voluntary(limp.row(), model.arm, MIDDLE) > voluntary(weak.row(), model.arm, MIDDLE)


def test_ability_falls_with_weakness_and_load_and_stays_within_its_range():
    assert ability(Patient(), known()) == 1.0
    limp = Patient(maximum_activation_flexors=0.0, maximum_activation_extensors=1.0, co_contraction=0.0)
    # Passive forces of the muscles at 60 deg hold less than 5 % of arm and load.
    assert 0.0 <= ability(limp, known()) < 0.05
    weak = [Patient(maximum_activation_flexors=x) for x in (0.04, 0.08, 0.12)]
    found = [ability(p, known(p)) for p in weak]
    assert 0.0 < found[0] < found[1] < found[2] < 1.0
    assert ability(weak[1], known(weak[1], 2.0)) < found[1]


def test_who_can_do_nothing_lacks_everything_and_who_can_do_all_only_the_device():
    model = known()
    g = np.linalg.norm(model.load.gravity)
    own = np.array([DEVICE.own_moment(a, g) for a in COURSE[:, 0]])
    needed = plan_course(model, TIMES, COURSE).moment
    able = need(Patient(), model, COURSE)
    np.testing.assert_allclose(able.lacking, own, rtol=1e-12)
    assert able.ability == 1.0 and able.scale == pytest.approx(needed.mean(), rel=1e-12)
    weak = Patient(maximum_activation_flexors=0.06)
    half = need(weak, model, COURSE)
    assert 0.0 < half.ability < 1.0
    np.testing.assert_allclose(half.lacking, (1.0 - half.ability) * needed + own, rtol=1e-12)


def test_lower_link_is_held_where_it_hangs_and_where_it_is_level():
    x, y, _ = DEVICE.lower_link.centre_of_mass
    assert DEVICE.own_moment(0.0, 10.0) == pytest.approx(10.0 * DEVICE.lower_link.mass * x)
    assert DEVICE.own_moment(np.pi / 2, 10.0) == pytest.approx(-10.0 * DEVICE.lower_link.mass * y)


def test_a_movement_that_needs_next_to_nothing_has_a_scale():
    light = known(Patient(body_mass=20.0), 0.05)
    down = np.tile([-0.3, 0.0, 0.0], (5, 1))
    assert need(Patient(body_mass=20.0), light, down).scale == SMALLEST_SCALE


def test_environment_tells_the_ability_and_holds_the_need_at_its_control_times():
    env = ElbowLiftEnv()
    weak = {"maximum_activation_flexors": 0.06}
    _, info = env.reset(seed=1, options={"patient": weak, "load": 1.5})
    needed = env.episode.need
    assert info["ability"] == needed.ability
    # Both to rounding.
    assert needed.ability == pytest.approx(ability(Patient(**weak), known(Patient(**weak), 1.5)), rel=1e-12)
    assert needed.lacking.shape == env.episode.times.shape
    for _ in range(4):
        *_, after = env.step(np.array([0.6, -1.0]))
    moment = env.readings()["exo_moment"]
    wanted = -max(moment - needed.lacking[4], -moment, 0.0) / needed.scale
    assert after["reward_terms"]["assistance"] == pytest.approx(wanted, rel=1e-12) and wanted < -0.05


def test_populations_hold_patients_of_all_abilities():
    """Whoever is trained on or evaluated on: many who can do something, and of those who are evaluated some cannot."""
    assert configs().is_dir()
    machine, found = Ecosystem().machine, {}
    assert machine is not None
    from exo_env.patient.population import population

    for name in ("healthy", "stroke_mild", "stroke_severe", "evaluation"):
        generator, patients = np.random.default_rng(0), []
        for _ in range(60):
            patient = population(name).sample(np.uint64(generator.integers(2**63)))
            patients.append(ability(patient, known(patient, generator.uniform(0.5, 2.0))))
        found[name] = np.array(patients)
    assert (found["healthy"] == 1.0).all() and (found["stroke_mild"] > 0.9).all()
    # 65 % below 1 of 150 were measured; the standard error of 60 is 6 %.
    assert 0.4 < (found["stroke_severe"] < 1.0).mean() < 0.9
    assert 0.02 < (found["evaluation"] < 0.2).mean() < 0.4 and (found["evaluation"] >= 0.2).mean() > 0.6


def test_who_tires_lacks_more():
    # Of 4 Nm that are needed somebody who could give 1.5 times that gives all until a third has tired.
    assert lacking_when(0.5, 4.0, 1.5, 1.0) == 0.5 and lacking_when(0.5, 4.0, 1.5, 0.7) == 0.5
    assert lacking_when(0.5, 4.0, 1.5, 0.5) == pytest.approx(0.5 + 0.25 * 4.0)
    # Half of the need, then half of that; and more than at the start where fatigue has passed.
    assert lacking_when(2.5, 4.0, 0.5, 0.5) == pytest.approx(2.5 + 1.0)
    assert lacking_when(2.5, 4.0, 0.5, 1.2) == pytest.approx(2.5 - 0.4)
    assert lacking_when(0.5, -1.0, 0.5, 0.5) == 0.5, "what falls by itself needs nobody"


def test_a_tired_patient_is_helped_for_nothing():
    """Over a minute with a patient who tires quickly, what is lacking grows with the fatigue of the flexors."""
    env = HiddenIntentEnv(repetitions=4, patient={"fatigue_rate": 0.1, "recovery_rate": 0.0}, load=2.0)
    env.reset(seed=3)
    found = []
    for _ in range(env.steps):
        if env.step(np.array([0.0, -1.0]))[2]:
            break
        found.append(env.readings())
    plan, k = env.world.tables.plan, len(found)
    assert found[-1]["fatigued.BIClong"] > 0.3
    assert found[-1]["lacking_moment"] > plan.lacking[k] or plan.needed[k] <= 0.0 or plan.able[k] > 1.5
    assert all(r["lacking_moment"] >= x - 1e-12 for r, x in zip(found, plan.lacking[1:], strict=False))
