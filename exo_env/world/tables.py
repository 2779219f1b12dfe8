"""The arrays of a world and of what acts on it, put together for compiled code (control_period.py)."""

from __future__ import annotations

import numpy as np

from dms_core.compiled.arena import Packed
from dms_core.simulation.dynamics import World
from exo_env.ecosystem.arm import MUSCLES
from exo_env.patient.effort import state_size
from exo_env.patient.patient import PATIENT
from exo_env.tasks.limits import Limits
from exo_env.tasks.observer import PREVIEW, TRUTH_SIZE, Observer
from exo_env.tasks.rewards import TERMS, Weights
from exo_env.world.control_period import READING, STATUS, Plant

SENSORS = (
    "elbow_angle.angle", "elbow_angle.rate", "exo_angle.angle", "exo_angle.rate", "agonist_tension",
    "antagonist_tension", "muscle_moment", "exo_moment", *(f"elbow_reaction.F{x}" for x in "xyz"),
    *(f"guide_force.F{x}" for x in "xyz"), *(f"{m}.sensor.tendon_force" for m in MUSCLES),
    *(f"{m}.sensor.activation" for m in MUSCLES),
)  # fmt: skip
"""What a control period reads, in the order of `Plant.places`."""


def plant_of(
    world: World,
    names: dict[str, int],
    inputs: np.ndarray,
    *,
    period: float,
    times: np.ndarray,
    drive: np.ndarray,
    axes: np.ndarray,
    observer: Observer,
    weights: Weights,
    limits: Limits,
) -> Packed:
    """A packed Plant without a patient.

    Args:
        world: the DAE.
        names: place of each sensor's component in a reading.
        inputs: rows of commands and excitations in the signals of the world, shape (8,).
        period: control period [s].
        times: control times [s], shape (k,).
        drive: table of the drive, shape (2, 3).
        axes: of the worn device, shape (3, 3).
        observer: what is observed, and how well.
        weights: of the reward.
        limits: that end an episode.
    """
    k, n, zeros = len(times), observer.size, np.zeros
    status = zeros(len(STATUS), np.int64)
    status[STATUS.steps] = k - 1
    return Packed(Plant(
        model=world.tables, world=world.packed, sensing=world.model.sensing,
        options=np.array(world.options.numbers(), float), patient=zeros(len(PATIENT)), effort=zeros(state_size(period)),
        period=np.array([period]), wanted=zeros((k, len(MUSCLES))), course=zeros((k, 3)),
        preview=zeros((k, len(PREVIEW))), lacking=zeros(k), scale=zeros(1), noise=zeros((k, 1 + n)), drive=drive,
        commands=zeros(2), excitations=zeros(len(MUSCLES)), stretch=zeros(len(MUSCLES)), inputs=inputs, axes=axes,
        places=np.array([names[name] for name in SENSORS], np.int64), y=zeros(len(names)), reading=zeros(len(READING)),
        truth=zeros(TRUTH_SIZE), columns=observer.columns, sensors=observer.sensors, memory=observer.memory(),
        observation=zeros(n), action=zeros(2), before=zeros(2), weights=weights.numbers(), limits=limits.numbers(),
        terms=zeros(len(TERMS)), reward=zeros(1), status=status,
    ))  # fmt: skip
