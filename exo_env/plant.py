"""The arrays of one episode, put together for compiled code (control_period.py)."""

from __future__ import annotations

import numpy as np

from dms_core.assembly.arena import Packed
from exo_env.control_period import READING, STATUS, Plant
from exo_env.episode import Episode
from exo_env.events import Limits
from exo_env.human import MUSCLES, excitation_name
from exo_env.observations import PREVIEW, Observer, patient_channels, truth_of
from exo_env.rewards import TERMS, Weights

SENSORS = (
    "elbow_angle.angle", "elbow_angle.rate", "exo_angle.angle", "exo_angle.rate", "agonist_tension",
    "antagonist_tension", "muscle_moment", "exo_moment", *(f"elbow_reaction.F{x}" for x in "xyz"),
    *(f"guide_force.F{x}" for x in "xyz"), *(f"{m}.sensor.tendon_force" for m in MUSCLES),
    *(f"{m}.sensor.activation" for m in MUSCLES),
)  # fmt: skip
"""What a control period reads, in the order of `Plant.places`."""


def plant_of(
    episode: Episode, observer: Observer, weights: Weights, limits: Limits, generator: np.random.Generator
) -> Packed:
    """A packed Plant at the start of an episode; the noise of the whole episode is drawn here.

    Args:
        episode: whose world, patient and repetition it holds.
        observer: what is observed, and how well.
        weights: of the reward.
        limits: that end an episode.
        generator: of the environment.
    """
    times, world, zeros = episode.times, episode.world, np.zeros
    course, last, n = episode.course, episode.times[-1], observer.size
    ahead = [episode.repetition.course(np.minimum(times + t, last))[:, 0] for t in PREVIEW]
    rows = [world.state.signals.ptr[world.model.input_index(name)] for name in _inputs(episode)]
    status = zeros(len(STATUS), np.int64)
    status[STATUS.steps] = len(times) - 1
    return Packed(Plant(
        model=world.tables, world=world.packed, sensing=world.model.sensing,
        options=np.array(world.options.numbers(), float), patient=episode.effort.numbers, effort=episode.effort.state,
        period=np.array([episode.period]), wanted=episode.wanted, course=course,
        preview=np.ascontiguousarray(np.stack(ahead, axis=1)), lacking=episode.need.lacking,
        scale=np.array([episode.need.scale]), noise=generator.standard_normal((len(times), 1 + n)),
        drive=episode.drive.table(episode.period), commands=episode.held.copy(), excitations=zeros(len(MUSCLES)),
        stretch=zeros(len(MUSCLES)), inputs=np.array(rows, np.int64),
        axes=np.ascontiguousarray(episode.worn.axes),
        places=np.array([episode.names[name] for name in SENSORS], np.int64), y=zeros(len(episode.names)),
        reading=zeros(len(READING)), truth=_constants(episode), columns=observer.columns, sensors=observer.sensors,
        memory=observer.memory(), observation=zeros(n), action=zeros(2), before=zeros(2), weights=weights.numbers(),
        limits=limits.numbers(), terms=zeros(len(TERMS)), reward=zeros(1), status=status,
    ))  # fmt: skip


def _inputs(episode: Episode) -> list[str]:
    """Names of the inputs that a control period sets."""
    return [*episode.drive.inputs, *(excitation_name(m) for m in MUSCLES)]


def _constants(episode: Episode) -> np.ndarray:
    """Channels that do not change in an episode; the rest is 0."""
    patient = {c.name: getattr(episode.patient, c.name) for c in patient_channels()}
    return truth_of({**patient, "load": episode.ecosystem.weight})
