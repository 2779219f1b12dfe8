"""How the numbers of a world follow from a person's sizes and the weight, without declaring and placing every element.

Masses go with the body mass M, lengths with the height H, inertias with M H^2, maximal forces with strength M / H
(human.py). So every number of the compiled tables is linear in few monomials of the sizes,

    x = C phi,   phi = (1, H, H^2, M, M H^2, weight, strength M / H, tau_act, tau_deact, 1 / min(tau_act, tau_deact))

with constants C for a device, a drive and a sex, found by declaring as many persons as there are monomials. Only the
length of the gym rope and the start of what moves are not linear; start_kernel.py gives them.
"""

from __future__ import annotations

from functools import lru_cache
from threading import Lock
from typing import NamedTuple

import numpy as np

from dms_core import Model
from dms_core.model import Constant, System
from dms_core.model.signals import AnySignal
from exo_env.drives.drive import DRIVES, Drive, drive_inputs
from exo_env.ecosystem.arm import HEIGHT_0, MASS_0, MUSCLES, Arm, Person
from exo_env.ecosystem.ecosystem import Ecosystem
from exo_env.jit import compiled
from exo_env.patient.motor_command import arm_table
from exo_env.patient.patient import SEXES, Patient, Sex

TEMPLATE_ANGLE = 1.0
"""Elbow angle at which the elimination orders are chosen [rad], amid the exercise."""
MONOMIALS = 10
NOISE = 1e-12
"""Part of a number, relative to the largest of its kind, below which a coefficient is rounding."""


class Numbers(NamedTuple):
    """Of a world, as far as they depend on who is in it and what is lifted."""

    model: tuple[np.ndarray, ...]
    """As `Model.numbers`."""
    start: np.ndarray
    """Coordinates at the start; true only for what does not move, shape (n_q,)."""
    muscles: np.ndarray
    points: np.ndarray
    elbow: np.ndarray
    """As in command_kernel.ArmTable."""
    forearm: np.ndarray
    """Inertia about the elbow, mass, centre of mass and grip, as in command_kernel.LoadTable, shape (8,)."""


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
        drive: of the action mode.
        start: elbow angle [rad].
        held: commands of the drive at the start, shape (2,).
        reference: course of psi [rad]; default: it stays at the start.
        activations: of the muscles at the start [-], shape (6,); default: the least.
        times: the muscles' time constants [s]; default: those of arm26.
    """
    given = {} if activations is None else dict(zip(MUSCLES, map(float, activations), strict=True))
    return ecosystem.system(
        start,
        reference or Constant(value=start),
        {m: Constant(value=a) for m, a in given.items()},
        start_activation=given,
        muscle_times=times,
        device_forces=lambda worn: drive.forces(worn, held),
        device_inputs=drive_inputs(drive, held),
    )


@lru_cache(maxsize=8)
def template(mode: str) -> Model:
    """The model whose elimination orders all worlds of an action mode take over.

    It is made of fixed numbers, never of the first patient, so that a seed gives the same bits whatever was simulated
    before.
    """
    used = DRIVES[mode]()
    return Model(declared(Ecosystem(), used, TEMPLATE_ANGLE, used.start(0.0)))


@compiled
def put_monomials(body_mass, height, strength, weight, rise, fall, phi):
    """Fill phi, shape (MONOMIALS,), with sizes as multiples of arm26's.

    Args:
        body_mass: [kg].
        height: [m].
        strength: factor on every muscle's F0 [-].
        weight: on the machine [kg].
        rise: activation time constant [s].
        fall: deactivation time constant [s].
        phi: filled.
    """
    m, h = body_mass / MASS_0, height / HEIGHT_0
    phi[0], phi[1], phi[2], phi[3], phi[4], phi[5] = 1.0, h, h * h, m, m * h * h, weight
    phi[6], phi[7], phi[8], phi[9] = strength * m / h, 100.0 * rise, 100.0 * fall, 0.01 / min(rise, fall)


def monomials(person: Person, weight: float, times: dict[str, float]) -> np.ndarray:
    """phi of a person, shape (MONOMIALS,); times: activation and deactivation time constants of ThelenMuscle [s]."""
    phi = np.empty(MONOMIALS)
    put_monomials(person.body_mass, person.height, person.strength, weight, *times.values(), phi)
    return phi


def numbers_of(model: Model, arm: Arm) -> Numbers:
    """The numbers of a model of an arm."""
    table, forearm = arm_table(arm), arm.segments["forearm"]
    carried = np.array([arm.inertia_about_elbow(), forearm.mass, *forearm.centre_of_mass, *arm.grip])
    return Numbers(model.numbers, model.start.q, table.muscles, table.points, table.elbow, carried)


class Fitting:
    """The constants C of a device and a drive.

    Args:
        ecosystem: device and machine; person and weight do not matter.
        mode: action mode.
        drive: of this mode.
    """

    def __init__(self, ecosystem: Ecosystem, mode: str, drive: Drive) -> None:
        self.ecosystem, self.mode, self.drive = ecosystem, mode, drive
        self._known, self._lock = set[str](), Lock()
        self._parts: list[tuple[int, int, tuple[int, ...]]] = []
        self.both = np.zeros((0, MONOMIALS))
        """C of men, then of women, as far as they were asked for, shape (2 n, MONOMIALS)."""

    def numbers(self, patient: Patient, weight: float) -> Numbers:
        """Of a patient who lifts a weight [kg]."""
        C = self.coefficients(patient.sex)
        return self.split(C @ monomials(patient.person, weight, patient.time_constants(Arm())))

    def split(self, x: np.ndarray) -> Numbers:
        """C phi, shape (n,), as views of its parts."""
        parts = [x[first:end].reshape(shape) for first, end, shape in self._parts]
        count = len(parts) - len(Numbers._fields) + 1
        return Numbers(tuple(parts[:count]), *parts[count:])

    def coefficients(self, sex: Sex) -> np.ndarray:
        """C, shape (n, MONOMIALS)."""
        with self._lock:
            if sex not in self._known:
                C = self._found(sex)
                if not self._known:
                    self.both = np.zeros((len(SEXES) * len(C), MONOMIALS))
                self.both[SEXES.index(sex) * len(C) :][: len(C)] = C
                self._known.add(sex)
        n = len(self.both) // len(SEXES)
        return self.both[SEXES.index(sex) * n :][:n]

    def _found(self, sex: Sex) -> np.ndarray:
        """C, shape (numbers, MONOMIALS)."""
        rng, rows, found = np.random.default_rng(0), [], []
        for _ in range(MONOMIALS):
            m, h, strength, weight, rise, fall = rng.uniform(
                (0.5, 0.8, 0.5, 0.5, 0.8, 3.0), (2.0, 1.2, 2.0, 2.0, 8.0, 5.0)
            )
            person = Person(body_mass=m * MASS_0, height=h * HEIGHT_0, sex=sex, strength=strength)
            times = {"activation_time_constant": 0.01 * rise, "deactivation_time_constant": 0.01 * fall}
            joined = self.ecosystem.changed(person=person, weight=weight)
            system = declared(joined, self.drive, TEMPLATE_ANGLE, self.drive.start(0.0), times=times)
            given = numbers_of(Model(system, like=template(self.mode)), Arm(person))
            parts = [*given.model, *given[1:]]
            ends = np.cumsum([x.size for x in parts]).tolist()
            self._parts = [(end - x.size, end, x.shape) for end, x in zip(ends, parts, strict=True)]
            rows.append(monomials(person, weight, times))
            found.append(np.concatenate([x.ravel() for x in parts]))
        C = np.linalg.solve(np.array(rows), np.array(found)).T
        return np.where(np.abs(C) > NOISE * np.abs(found).max(axis=0)[:, None], C, 0.0)


fitting = lru_cache(maxsize=16)(Fitting)
"""Fittings made so far in this process; many worlds share one."""
