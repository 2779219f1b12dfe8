"""Numbers and start of a world against those of a model declared, placed and assembled for the same patient."""

import numpy as np
import pytest

from dms_core import Model
from dms_core.errors import ModelError
from exo_env.ecosystem.arm import Arm
from exo_env.ecosystem.ecosystem import Ecosystem
from exo_env.ecosystem.gym_machine import ROPE
from exo_env.envs.elbow_lift import ElbowLiftEnv
from exo_env.patient.patient import Patient
from exo_env.patient.population import population
from exo_env.tasks.movements.repetition import Repetition
from exo_env.world.kernels import scaling
from exo_env.world.kernels.scaling import SIZES, Numbers, Scaling, declared, monomials, numbers_of, scaling_of, template

DRIVES = ElbowLiftEnv.drives
MODES = tuple(DRIVES)
PATIENTS = (
    *(population("evaluation").sample(k) for k in range(6)),
    Patient(body_mass=20.0, height=1.0, sex="female", strength=0.1, activation_time_scale=5.0),
    Patient(body_mass=250.0, height=1.7, strength=5.0, activation_time_scale=4.5, deactivation_time_scale=0.5),
)


def declared_model(patient: Patient, weight: float, mode: str, **start) -> Model:
    """As an episode would have to be made without fitting."""
    joined, drive = Ecosystem(person=patient.person, weight=weight), DRIVES[mode]()
    times = patient.time_constants(Arm(patient.person))
    return Model(declared(joined, drive, times=times, **start), like=template(joined, drive))


def rope_number(model: Model) -> int:
    """Place of the gym rope's length in the numbers of constraints."""
    calls = model.tables.values.constraints
    return int(calls.par_ptr[[c.element.name for c in model.layout.constraints].index(ROPE)])


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("patient", PATIENTS)
def test_numbers_are_those_of_the_declared_patient(mode, patient):
    weight = 0.5 + patient.height
    scaling = scaling_of(Ecosystem(), DRIVES[mode]())
    C = scaling.coefficients(patient.sex)
    found = scaling.split(C @ monomials(patient.person, weight, patient.time_constants(Arm())))
    model = declared_model(
        patient, weight, mode, start=1.0, held=np.zeros(len(DRIVES[mode]().commands(Ecosystem().device)))
    )
    wanted = numbers_of(model, Arm(patient.person))
    rope = rope_number(model)
    found.model[1][rope] = wanted.model[1][rope]
    pairs = [*zip(found.model, wanted.model, strict=True), *zip(found[2:], wanted[2:], strict=True)]
    assert len(pairs) == 6 + len(Numbers._fields) - 2
    for x, y in pairs:
        # Ten equations solved to rounding, for numbers up to a hundred times those they were solved for.
        # Parts of a point that cancel are true to rounding of a metre; what is 0 for all is 0.
        np.testing.assert_allclose(x, y, rtol=1e-11, atol=1e-12)


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("angle_deg", [20.0, 63.0, 100.0])
def test_start_is_that_of_the_declared_patient(mode, angle_deg):
    env = ElbowLiftEnv(action_mode=mode, patient="evaluation")
    env.reset(seed=int(angle_deg), options={"initial_angle_deg": angle_deg})
    episode = env.episode
    patient, state = episode.patient, episode.world.state
    activations = state.q[[episode.model.layout.index[f"{m}.activation"] for m in episode.arm.muscles]]
    model = declared_model(
        patient, episode.load, mode, start=np.radians(angle_deg), held=episode.tables.drive.commands,
        reference=Repetition.of_row(episode.movement).signal, activations=activations,
    )  # fmt: skip
    rope = rope_number(model)
    assert episode.model.numbers[1][rope] == pytest.approx(model.numbers[1][rope], abs=1e-11)
    q = state.q.copy()
    if mode == "impedance":
        # What a law asks for at the start follows from the angle, which a declared motor does not know.
        q[model.layout.index["agonist_motor.tension"]] = 0.0
    # Lengths and Euler parameters to rounding; tensions are of the order of 100 N.
    np.testing.assert_allclose(q, model.start.q, rtol=1e-10, atol=1e-11)
    follow = (".fibre_length", ".activation", ".tension", "_impulse")
    slow = np.array([not name.endswith(follow) for name in model.layout.names])
    # The rates of fibres, activations, tensions and of what asks for them follow when the world settles.
    np.testing.assert_allclose(state.v[slow], model.start.v[slow], atol=1e-11)


def test_a_world_forgets_the_patient_before():
    """A seed gives the same bits, whoever was in the device before and however the episode ended."""
    used, fresh = ElbowLiftEnv(patient="evaluation"), ElbowLiftEnv(patient="evaluation")
    for seed in (3, 4):
        used.reset(seed=seed, options={"reference": {"rest": 0.0}})
        for _ in range(40):
            *_, terminated, _, _ = used.step(np.array([1.0, 1.0]))
            if terminated:
                break
    actions = np.random.default_rng(0).uniform(-1.0, 0.2, (50, 2))
    for a, b in zip((used.reset(seed=9)), (fresh.reset(seed=9)), strict=True):
        assert str(a) == str(b)
    for action in actions:
        one, other = used.step(action), fresh.step(action)
        np.testing.assert_array_equal(one[0], other[0])
        assert one[1:4] == other[1:4]
    for name, value in used.readings().items():
        assert value == fresh.readings()[name], name


def test_a_template_of_the_same_elements_is_shared_and_another_one_is_made():
    drive, default = DRIVES["rope_tension"](), Ecosystem()
    heavy = default.changed(device={"lower_link": {"mass": 0.9}})
    assert template(heavy, drive) is template(default, drive)
    one_rope = {"ropes": {"lift": default.device.ropes["agonist"]}}
    single = default.changed(device=default.device.model_copy(update=one_rope))
    assert template(single, DRIVES["rope_tension"](max_tension=(200.0,))) is not template(default, drive)


class WithSpring(Ecosystem):
    """An element whose number is not linear in the sizes of a person."""

    def more_parts(self, arm, worn):
        from dms_core.model import JointSpringDamper

        class Spring:
            bodies = staticmethod(lambda flexion: [])
            joints = staticmethod(lambda: [])
            forces = staticmethod(
                lambda: [JointSpringDamper(name="band", joint="elbow", stiffness=arm.person.height**5)]
            )

        return [Spring()]


def test_a_number_that_is_not_linear_in_the_sizes_is_named():
    with pytest.raises(ModelError, match="element 'band': a number of it, .* is not linear in the person's sizes"):
        scaling_of(WithSpring(), DRIVES["rope_tension"]()).coefficients("male")


class Known(Scaling):
    """A scaling of numbers that are linear in phi with known constants."""

    def __init__(self, constants):
        self.constants = constants

    def _declared(self, sex, sizes, traits):
        phi = np.concatenate([sizes.uniform(0.5, 2.0, SIZES), list(traits.values())])
        phi[0] = 1.0
        return phi, self.constants @ phi

    def _check(self, fitted, numbers, largest):
        np.testing.assert_allclose(fitted, numbers, rtol=1e-9)


def test_a_trait_of_joints_moves_no_constant_of_the_sizes(monkeypatch):
    """To the bit: a neutral trait must not move what a seed gives to those who have its default."""
    constants = np.random.default_rng(5).normal(size=(4, SIZES + 1))
    constants[:3, SIZES] = 0.0  # only the last number depends on the trait
    without = Known(constants[:, :SIZES])._fitted("male")
    monkeypatch.setattr(scaling, "MONOMIALS", (*scaling.MONOMIALS, "trait"))
    monkeypatch.setattr(scaling, "JOINT_TRAITS", ("strength",))  # any name with a range and a default
    found = Known(constants)._fitted("male")
    np.testing.assert_array_equal(found[:3, :SIZES], without[:3])
    assert not found[:3, SIZES].any()
    # As exact as a linear solve of random persons is.
    np.testing.assert_allclose(found, constants, rtol=1e-8, atol=1e-8)
