"""Many worlds at once: a control period of each in compiled code, on several threads, without the Python lock."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from dms_core.compiled.jit import compiled
from dms_core.compiled.threads import Threads
from dms_core.kernels import DONE, Packed, floats, inner, ints, table_at
from exo_env.tables import OBSERVER, STATUS, TASK, WORLD
from exo_env.world.kernels.control_period import run_period
from exo_env.world.kernels.reset import BEGUN, begin_episode
from exo_env.world.work_sharing import AREAS, areas_of, claim, fetch_ahead

FIELDS = len(WORLD)
ELSEWHERE = -1
"""Code of a world that something else than the batch has moved."""
BESIDE = (
    "noise", "tremor", "wanted", "course", "preview", "lacking", "newton", "newton_lu", "rates", "rate_lu", "draw",
    "scaling", "subject", "rest", "cleared",
)  # fmt: skip
"""Fields that are not fetched ahead: a period reads one row of what spans an episode, and nothing of a reset's."""


@compiled
def collect(w, reported, observation, numbers, status):
    """Copy what a step gives: observation; reward, terms and the readings at the places `reported`; status."""
    seen, task, now = (
        floats(inner(w, WORLD.observer), OBSERVER.observation),
        inner(w, WORLD.task),
        ints(w, WORLD.status),
    )
    r, terms = floats(task, TASK.readings), floats(task, TASK.terms)
    for i in range(observation.shape[0]):
        observation[i] = seen[i]
    numbers[0] = floats(task, TASK.reward)[0]
    for i in range(terms.shape[0]):
        numbers[1 + i] = terms[i]
    for i in range(reported.shape[0]):
        numbers[1 + terms.shape[0] + i] = r[reported[i]]
    for i in range(status.shape[0]):
        status[i] = now[i]


@compiled(nogil=True)
def run_some(addresses, areas, which, actions, reported, observations, numbers, status, ahead, done):
    """A control period of worlds which[k] that no other thread has taken, until all are done.

    `done` counts those that are taken; the world `ahead` of them is fetched. Where the solver gives up, `status` holds
    its code; ELSEWHERE where a world is not at the control time at which the batch left it, and was not stepped.
    """
    k = claim(done)
    while k < which.shape[0]:
        if k + ahead < which.shape[0]:
            fetch_ahead(areas[which[k + ahead]])
        i = which[k]
        w = table_at(addresses[i], FIELDS)
        if ints(w, WORLD.status)[STATUS.step] != status[i, STATUS.step]:
            status[i, STATUS.code] = ELSEWHERE
        elif run_period(w, actions[i]) == DONE:
            collect(w, reported, observations[i], numbers[i], status[i])
        else:
            status[i, STATUS.code] = ints(w, WORLD.status)[STATUS.code]
        k = claim(done)


@compiled(nogil=True)
def begin_some(addresses, which, reported, observations, numbers, status, codes, done):
    """Begin episodes in the worlds which[k] that no other thread has taken; `codes` takes the code of each."""
    k = claim(done)
    while k < which.shape[0]:
        i = which[k]
        w = table_at(addresses[i], FIELDS)
        codes[k] = begin_episode(w)
        if codes[k] == BEGUN:
            collect(w, reported, observations[i], numbers[i], status[i])
        k = claim(done)


class Batch:
    """Worlds side by side.

    Args:
        size: number of worlds.
        observed: components of an observation.
        terms: number of reward terms.
        reported: places of the readings that are collected.
        threads: number of threads that step them; None takes one for each core.

    Attributes:
        observations: float32, shape (size, observed).
        numbers: reward, terms and readings, shape (size, 1 + terms + len(reported)).
        status: numbers at the places of tables.STATUS, shape (size, 3).
    """

    def __init__(self, size: int, observed: int, terms: int, reported: np.ndarray, threads: int | None = None) -> None:
        self._team = Threads(size, threads)
        self._addresses, self._reported = np.zeros(size, np.int64), reported
        self._areas = np.zeros((size, AREAS, 2), np.int64)
        # Compiled code knows addresses only: what they point to is kept here.
        self.worlds: list[Packed | None] = [None] * size
        self.observations = np.zeros((size, observed), np.float32)
        self.numbers = np.zeros((size, 1 + terms + len(reported)))
        self.status = np.zeros((size, len(STATUS)), np.int64)

    @property
    def threads(self) -> int:
        """Number of threads that step the worlds."""
        return self._team.count

    def put(self, i: int, world: Packed) -> None:
        """Make the packed WorldTables world i."""
        if self.worlds[i] is not world:
            self.worlds[i], self._areas[i] = world, areas_of(world, BESIDE)
            self._addresses[i] = world.table.ctypes.data

    def take(self, i: int) -> None:
        """Copy what world i gives, where something else than the batch has moved it."""
        collect(
            table_at(self._addresses[i], FIELDS), self._reported, self.observations[i], self.numbers[i], self.status[i]
        )

    def begin(self, which: np.ndarray) -> np.ndarray:
        """Begin the episodes that are drawn for the worlds `which`, shape (k,).

        Returns:
            The code of each, see reset.py, shape (k,).
        """
        codes = np.zeros(len(which), np.int64)
        self._share(
            len(which), begin_some, self._addresses, which, self._reported, self.observations, self.numbers,
            self.status, codes,
        )  # fmt: skip
        return codes

    def run(self, which: np.ndarray, actions: np.ndarray) -> np.ndarray:
        """Step the worlds `which`, shape (k,), with their rows of actions, shape (size, n).

        Returns:
            Numbers of the worlds that were not stepped to the end, with the code of each in `status`.
        """
        self._share(
            len(which), run_some, self._addresses, self._areas, which, actions, self._reported, self.observations,
            self.numbers, self.status, min(self.threads, len(which)),
        )  # fmt: skip
        return which[self.status[which, STATUS.code] != DONE]

    def _share(self, count: int, work: Callable, *arguments: Any) -> None:
        """Do `count` pieces of work on all threads; its last argument counts those that are taken."""
        share = partial(work, *arguments, np.zeros(1, np.int64))
        self._team.run([share] * max(min(self.threads, count), 1))

    def close(self) -> None:
        """End the threads."""
        self._team.close()
