"""How the numbers of a world follow from a person's sizes and the load, without declaring and placing every element.

Masses go with the body mass M, lengths with the height H, inertias with M H^2, maximal forces with strength M / H
(ecosystem/arm.py), and numbers of joints with the traits that act in joints. So every number of the compiled tables is
linear in few monomials,

    x = C phi,   phi = (1, H, H^2, M, M H^2, load, strength M / H, tau_act, tau_deact, 1 / min(tau_act, tau_deact),
                        traits of joints)

with constants C for an ecosystem, a drive and a sex, known by declaring as many persons as there are monomials: first
with joints as the defaults have them, then one for each trait of joints, so that a further trait leaves the numbers of
all that have its default what they were, to the bit. One more person is declared to see that it is so. Only the length
of the gym rope and the start of what moves are not linear; rest_pose.py gives them.
"""

from __future__ import annotations

from functools import lru_cache
from threading import Lock
from typing import NamedTuple

import numpy as np

from dms_core import Model
from dms_core.assembly.layout import Layout, same_structure
from dms_core.compiled.jit import compiled
from dms_core.errors import InputError, ModelError
from dms_core.kernels import floats, inner, matrix
from dms_core.model import Constant, System
from dms_core.model.signals import AnySignal
from exo_env.drives.drive import Drive
from exo_env.ecosystem.arm import Arm
from exo_env.ecosystem.ecosystem import Ecosystem
from exo_env.ecosystem.gym_machine import ROPE
from exo_env.ecosystem.person import HEIGHT_0, JOINT_TRAITS, MASS_0, SEXES, Person, Sex
from exo_env.patient.excitation.motor_command import arm_table
from exo_env.patient.patient import FIELDS, PATIENT
from exo_env.places import places
from exo_env.tables import DRAW, SCALING, WORLD
from exo_env.traits import range_of

TEMPLATE_ANGLE = 1.0
"""Elbow angle at which the elimination orders are chosen [rad], amid the exercise."""
MONOMIALS = places((
    "one", "height", "area", "mass", "inertia", "load", "force", "rise", "fall", "rate",
    *JOINT_TRAITS,
))  # fmt: skip
"""Place of each monomial in phi."""
SIZES = len(MONOMIALS) - len(JOINT_TRAITS)
JOINT_PLACES = np.array([FIELDS.index(name) for name in JOINT_TRAITS], np.int64)
"""Places of the traits of joints in a patient's row."""
NOISE = 1e-12
"""Part of a number, relative to the largest of its kind, below which a coefficient is rounding."""
LINEAR = 1e-9
"""Relative error in the numbers of a further person up to which they count as linear in phi: rounding of ten equations
whose condition is about 1e4, and a thousandth of a millimetre in a metre would be a thousand times more."""


class Numbers(NamedTuple):
    """Numbers of a world, as far as they depend on who is in it and what is lifted."""

    model: tuple[np.ndarray, ...]
    """Arrays of `Model.numbers`."""
    start: np.ndarray
    """Coordinates at the start; true only for what does not move, shape (n_q,)."""
    muscles: np.ndarray
    points: np.ndarray
    elbow: np.ndarray
    """Muscles, points and elbow, as in static_optimisation.ArmTable."""
    forearm: np.ndarray
    """Inertia about the elbow, mass, centre of mass and grip, as in static_optimisation.LoadTable, shape (8,)."""


def declared(
    ecosystem: Ecosystem,
    drive: Drive,
    start: float,
    held: np.ndarray,
    *,
    reference: AnySignal | None = None,
    activations: np.ndarray | None = None,
    times: dict[str, float] | None = None,
) -> System:
    """The system of an episode.

    Args:
        ecosystem: person, device, machine and weight.
        drive: drive of the action mode.
        start: elbow angle [rad].
        held: commands of the drive at the start, shape (n_c,).
        reference: psi over time [rad]; default: it stays at the start.
        activations: activations of the muscles at the start [-], shape (m,); default: the least.
        times: the muscles' time constants [s]; default: those of arm26.
    """
    given = {} if activations is None else dict(zip(ecosystem.arm().muscles, map(float, activations), strict=True))
    return ecosystem.system(
        start,
        reference or Constant(value=start),
        {m: Constant(value=a) for m, a in given.items()},
        start_activation=given,
        muscle_times=times,
        device_forces=lambda worn: drive.forces(worn, held),
        device_inputs=drive.inputs(ecosystem.device, held),
    )


def _template(ecosystem: Ecosystem, drive: Drive) -> Model:
    return Model(declared(ecosystem, drive, TEMPLATE_ANGLE, drive.start(ecosystem.device, 0.0)))


_of_default = lru_cache(maxsize=8)(_template)
_of_structure = lru_cache(maxsize=8)(_template)


def template(ecosystem: Ecosystem, drive: Drive) -> Model:
    """The model whose elimination orders all worlds of the same elements take over.

    It is made of fixed numbers, never of the first patient, so that a seed gives the same bits whatever was simulated
    before: of the default ecosystem and drive where the elements are the same, or else of the given ones with a default
    person and one kilogram.
    """
    given = ecosystem.changed(person=Person(), weight=1.0)
    try:
        default = _of_default(type(ecosystem)(), type(drive)())
    except InputError:
        return _of_structure(given, drive)
    own = Layout(declared(given, drive, TEMPLATE_ANGLE, drive.start(given.device, 0.0)))
    return default if same_structure(default.layout, own) else _of_structure(given, drive)


@compiled
def put_monomials(body_mass, height, strength, load, rise, fall, phi):
    """Fill the first places of phi with sizes as multiples of arm26's.

    Args:
        body_mass: body mass [kg].
        height: height [m].
        strength: factor on every muscle's F0 [-].
        load: weight on the machine [kg].
        rise: activation time constant [s].
        fall: deactivation time constant [s].
        phi: filled, shape (len(MONOMIALS),); the traits of joints are not touched.
    """
    m, h = body_mass / MASS_0, height / HEIGHT_0
    phi[MONOMIALS.one], phi[MONOMIALS.height], phi[MONOMIALS.area] = 1.0, h, h * h
    phi[MONOMIALS.mass], phi[MONOMIALS.inertia], phi[MONOMIALS.load] = m, m * h * h, load
    phi[MONOMIALS.force], phi[MONOMIALS.rise], phi[MONOMIALS.fall] = strength * m / h, 100.0 * rise, 100.0 * fall
    phi[MONOMIALS.rate] = 0.01 / min(rise, fall)


@compiled
def put_numbers(w, load):
    """Put the numbers that follow from a patient's sizes and a weight on the machine [kg] into a world."""
    scaling, draw = inner(w, WORLD.scaling), inner(w, WORLD.draw)
    who, times, phi = floats(draw, DRAW.patient), floats(scaling, SCALING.constants), np.empty(len(MONOMIALS))
    put_monomials(
        who[PATIENT.body_mass], who[PATIENT.height], who[PATIENT.strength], load,
        who[PATIENT.activation_time_scale] * times[0], who[PATIENT.deactivation_time_scale] * times[1], phi,
    )  # fmt: skip
    for k in range(JOINT_PLACES.shape[0]):
        phi[SIZES + k] = who[JOINT_PLACES[k]]
    C, x, targets = (
        matrix(scaling, SCALING.coefficients),
        floats(scaling, SCALING.numbers),
        inner(scaling, SCALING.targets),
    )
    first, at = int(who[PATIENT.sex]) * x.shape[0], 0
    for i in range(x.shape[0]):
        total = 0.0
        for j in range(phi.shape[0]):
            total += C[first + i, j] * phi[j]
        x[i] = total
    for k in range(targets.shape[0]):
        into = floats(targets, k)
        for i in range(into.shape[0]):
            into[i] = x[at + i]
        at += into.shape[0]


def monomials(person: Person, load: float, times: dict[str, float]) -> np.ndarray:
    """Monomials phi of a person.

    Args:
        person: the person.
        load: weight on the machine [kg].
        times: activation and deactivation time constants, as fields of ThelenMuscle [s].
    """
    phi = np.empty(len(MONOMIALS))
    put_monomials(person.body_mass, person.height, person.strength, load, *times.values(), phi)
    phi[SIZES:] = [getattr(person, name) for name in JOINT_TRAITS]
    return phi


def numbers_of(model: Model, arm: Arm) -> Numbers:
    """The numbers of a model of an arm."""
    table, forearm = arm_table(arm), arm.segments["forearm"]
    carried = np.array([arm.inertia_about_elbow(), forearm.mass, *forearm.centre_of_mass, *arm.grip])
    return Numbers(model.numbers, model.start.q, table.muscles, table.points, table.elbow, carried)


class Scaling:
    """The constants C of an ecosystem and a drive.

    Args:
        ecosystem: device, machine and anatomy; person and weight do not matter.
        drive: drive of the action mode.
    """

    def __init__(self, ecosystem: Ecosystem, drive: Drive) -> None:
        self.ecosystem, self.drive, self.template = ecosystem, drive, template(ecosystem, drive)
        self._known, self._lock = set[str](), Lock()
        self._parts: list[tuple[int, int, tuple[int, ...]]] = []
        self.both = np.zeros((0, len(MONOMIALS)))
        """Constants C for men, then for women, as far as they were asked for, shape (2 n, monomials)."""

    def split(self, x: np.ndarray) -> Numbers:
        """Numbers C phi, shape (n,), as views of their parts."""
        parts = [x[first:end].reshape(shape) for first, end, shape in self._parts]
        count = len(parts) - len(Numbers._fields) + 1
        return Numbers(tuple(parts[:count]), *parts[count:])

    def coefficients(self, sex: Sex) -> np.ndarray:
        """Constants C of a sex, shape (n, monomials)."""
        with self._lock:
            if sex not in self._known:
                C = self._fitted(sex)
                if not self._known:
                    self.both = np.zeros((len(SEXES) * len(C), len(MONOMIALS)))
                self.both[SEXES.index(sex) * len(C) :][: len(C)] = C
                self._known.add(sex)
        n = len(self.both) // len(SEXES)
        return self.both[SEXES.index(sex) * n :][:n]

    def _fitted(self, sex: Sex) -> np.ndarray:
        """Constants C, shape (n, monomials): of sizes from as many persons with neutral joints, then trait by trait.

        So that a further trait of joints leaves all other constants what they are, to the bit.
        """
        sizes, joints = np.random.default_rng(0), np.random.default_rng(1)
        neutral = {name: float(Person.model_fields[name].default) for name in JOINT_TRAITS}
        rows, found = zip(*(self._declared(sex, sizes, neutral) for _ in range(SIZES)), strict=True)
        known, largest = np.linalg.solve(np.array(rows)[:, :SIZES], np.array(found)), np.abs(found).max(axis=0)
        C = np.zeros((known.shape[1], len(MONOMIALS)))
        C[:, :SIZES] = known.T
        for k, name in enumerate(JOINT_TRAITS):
            phi, numbers = self._declared(sex, sizes, neutral | {name: joints.uniform(*range_of(Person, name))})
            more = numbers - C[:, :SIZES] @ phi[:SIZES]
            C[:, SIZES + k] = np.where(np.abs(more) > LINEAR * np.maximum(largest, 1.0), more, 0.0) / (
                phi[SIZES + k] - neutral[name]
            )
            largest = np.maximum(largest, np.abs(numbers))
        C[:, 0] -= C[:, SIZES:] @ np.array([neutral[name] for name in JOINT_TRAITS])
        C = np.where(np.abs(C) > NOISE * largest[:, None], C, 0.0)
        phi, numbers = self._declared(
            sex, sizes, {name: joints.uniform(*range_of(Person, name)) for name in JOINT_TRAITS}
        )
        self._check(C @ phi, numbers, np.maximum(largest, np.abs(numbers)))
        return C

    def _declared(
        self, sex: Sex, sizes: np.random.Generator, traits: dict[str, float]
    ) -> tuple[np.ndarray, np.ndarray]:
        """Monomials phi and all numbers of a random person."""
        m, h, strength, load, rise, fall = sizes.uniform((0.5, 0.8, 0.5, 0.5, 0.8, 3.0), (2.0, 1.2, 2.0, 2.0, 8.0, 5.0))
        person = Person(body_mass=m * MASS_0, height=h * HEIGHT_0, sex=sex, strength=strength, **traits)
        times = {"activation_time_constant": 0.01 * rise, "deactivation_time_constant": 0.01 * fall}
        joined = self.ecosystem.changed(person=person, weight=load)
        held = self.drive.start(joined.device, 0.0)
        model = Model(declared(joined, self.drive, TEMPLATE_ANGLE, held, times=times), like=self.template)
        given = numbers_of(model, joined.arm())
        self._model, parts = model, [*given.model, *given[1:]]
        ends = np.cumsum([x.size for x in parts]).tolist()
        self._parts = [(end - x.size, end, x.shape) for end, x in zip(ends, parts, strict=True)]
        return monomials(person, load, times), np.concatenate([x.ravel() for x in parts])

    def _check(self, fitted: np.ndarray, numbers: np.ndarray, largest: np.ndarray) -> None:
        """Refuse numbers of elements that are not linear in phi; rope and start are given by rest_pose.py.

        Raises:
            ModelError: names the element.
        """
        layout, names = self._model.layout, []
        for calls in (layout.dynamics, layout.constraints):
            names += [call.element.name for call in calls for _ in call.placement.numbers]
        wrong = np.abs(fitted - numbers)[: len(names)] > LINEAR * np.maximum(largest[: len(names)], 1.0)
        for k in np.flatnonzero(wrong).tolist():
            if names[k] != ROPE:
                raise ModelError(
                    f"element '{names[k]}': a number of it, {numbers[k]:.6g} for one person, is not linear in the "
                    f"person's sizes, the load and the traits of joints ({fitted[k]:.6g} if it were); an environment "
                    "needs it to be (exo_env/world/kernels/scaling.py)."
                )


scaling_of = lru_cache(maxsize=16)(Scaling)
"""The scaling of an ecosystem and a drive; many worlds share one."""
