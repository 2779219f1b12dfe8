"""Many worlds at once: a control period of each in compiled code, on several threads, without the Python lock."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor, wait
from functools import partial
from typing import Any

import numpy as np

from dms_core.kernels import DONE, Packed, floats, ints, table_at
from exo_env.jit import compiled
from exo_env.patient.effort import STATE as EFFORT
from exo_env.tasks.rewards import TERMS
from exo_env.world.control_period import PLANT, READING, STATUS, run_period
from exo_env.world.reset import OPEN, SETTING, open_episode
from exo_env.world.work_sharing import AREAS, areas_of, claim, fetch_ahead

FIELDS, SETTING_FIELDS, N_TERMS = len(PLANT), len(SETTING), len(TERMS)
NUMBERS = ("reward", *TERMS, "time", "tracking_error", "device_share", "effort", "elbow_reaction")
"""What is collected of each world, in the order of `Batch.numbers`; time in control periods, error in rad."""
BESIDE = ("noise", "wanted", "course", "preview", "lacking", "newton", "newton_lu", "rates", "rate_lu")
"""Fields not fetched ahead: of what goes over an episode a period reads one row, and worlds share their patterns."""


@compiled
def collect(p, observation, numbers, status):
    """What the agent is told of a world."""
    seen, r, terms, now = (
        floats(p, PLANT.observation),
        floats(p, PLANT.reading),
        floats(p, PLANT.terms),
        ints(p, PLANT.status),
    )
    for i in range(observation.shape[0]):
        observation[i] = seen[i]
    numbers[0] = floats(p, PLANT.reward)[0]
    for i in range(N_TERMS):
        numbers[1 + i] = terms[i]
    numbers[N_TERMS + 1], numbers[N_TERMS + 2] = now[STATUS.step], r[READING.error]
    numbers[N_TERMS + 3], numbers[N_TERMS + 4] = r[READING.share], floats(p, PLANT.effort)[EFFORT.effort]
    numbers[N_TERMS + 5] = r[READING.reaction]
    for i in range(status.shape[0]):
        status[i] = now[i]


@compiled(nogil=True)
def run_some(addresses, areas, which, actions, observations, numbers, status, ahead, done):
    """A control period of worlds which[k] that no other thread has taken, until all are done.

    `done` counts those that are taken; the world `ahead` of them is fetched. Where the solver gives up, `status` holds
    its code.
    """
    k = claim(done)
    while k < which.shape[0]:
        if k + ahead < which.shape[0]:
            fetch_ahead(areas[which[k + ahead]])
        i = which[k]
        p = table_at(addresses[i], FIELDS)
        if run_period(p, actions[i]) == DONE:
            collect(p, observations[i], numbers[i], status[i])
        else:
            status[i, STATUS.code] = ints(p, PLANT.status)[STATUS.code]
        k = claim(done)


@compiled(nogil=True)
def open_some(addresses, settings, which, observations, numbers, status, codes, done):
    """Open episodes of the worlds which[k] that no other thread has taken; `codes` holds what came of each."""
    k = claim(done)
    while k < which.shape[0]:
        i = which[k]
        p = table_at(addresses[i], FIELDS)
        codes[k] = open_episode(p, table_at(settings[i], SETTING_FIELDS))
        if codes[k] == OPEN:
            collect(p, observations[i], numbers[i], status[i])
        k = claim(done)


class Batch:
    """Worlds side by side.

    Args:
        size: number of worlds.
        observed: components of an observation.
        threads: that step them; None takes one for each core.

    Attributes:
        observations: float32, shape (size, observed).
        numbers: shape (size, len(NUMBERS)).
        status: counters of control_period.STATUS, shape (size, 4).
    """

    def __init__(self, size: int, observed: int, threads: int | None = None) -> None:
        self.threads = min(size, threads or _cores())
        self._addresses, self._settings = np.zeros(size, np.int64), np.zeros(size, np.int64)
        self._areas = np.zeros((size, AREAS, 2), np.int64)
        # Compiled code knows addresses only: what they point to is kept here.
        self.worlds: list[tuple[Packed, Packed] | None] = [None] * size
        self.observations = np.zeros((size, observed), np.float32)
        self.numbers = np.zeros((size, len(NUMBERS)))
        self.status = np.zeros((size, len(STATUS)), np.int64)
        # The thread that calls works, too.
        self._pool = ThreadPoolExecutor(self.threads - 1) if self.threads > 1 else None

    def put(self, i: int, world: Packed, setting: Packed) -> None:
        """World i is that of a packed Plant, which a packed Setting opens."""
        if self.worlds[i] != (world, setting):
            self.worlds[i], self._areas[i] = (world, setting), areas_of(world, BESIDE)
            self._addresses[i], self._settings[i] = world.table.ctypes.data, setting.table.ctypes.data

    def take(self, i: int) -> None:
        """Collect what world i tells, where it was moved by other hands."""
        collect(table_at(self._addresses[i], FIELDS), self.observations[i], self.numbers[i], self.status[i])

    def open(self, which: np.ndarray) -> np.ndarray:
        """Open the episodes of the worlds `which`, shape (k,), as their settings say; gives what came of each."""
        codes = np.zeros(len(which), np.int64)
        self._share(
            len(which), open_some, self._addresses, self._settings, which, self.observations, self.numbers, self.status,
            codes,
        )  # fmt: skip
        return codes

    def run(self, which: np.ndarray, actions: np.ndarray) -> np.ndarray:
        """Step the worlds `which`, shape (k,), with their rows of actions, shape (size, 2).

        Returns:
            Those whose solver gave up.
        """
        self._share(
            len(which), run_some, self._addresses, self._areas, which, actions, self.observations, self.numbers,
            self.status, min(self.threads, len(which)),
        )  # fmt: skip
        return which[self.status[which, STATUS.code] != DONE]

    def _share(self, count: int, work: Callable, *arguments: Any) -> None:
        """Do `count` pieces of work on all threads; its last argument counts those that are taken."""
        share, jobs = partial(work, *arguments, np.zeros(1, np.int64)), list[Future]()
        try:
            if self._pool:
                jobs += [self._pool.submit(share) for _ in range(min(self.threads, count) - 1)]
            share()
        finally:
            _wait(jobs)
        for job in jobs:
            job.result()

    def close(self) -> None:
        """End the threads."""
        if self._pool is not None:
            self._pool.shutdown()
            self._pool = None


def _wait(jobs: list[Future]) -> None:
    """Wait to the end: an interrupt must not leave threads behind that still write."""
    interrupt = None
    while True:
        try:
            wait(jobs)
            break
        except KeyboardInterrupt as error:
            interrupt = error
    if interrupt is not None:
        raise interrupt


def _cores() -> int:
    """That this process may use, where the system says so."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
