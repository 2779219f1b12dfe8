"""Environments whose runs can be differenced, and the derivative of their readings along a direction."""

from __future__ import annotations

from dataclasses import replace

import gymnasium
import numpy as np

LIFT, HIDDEN = "exo/ElbowLift-v2", "exo/HiddenIntent-v0"
SEED = 1
FIXED = {"fixed_step": 2e-3, "newton_tol": 1e-9}
"""Steps that do not follow what is moved, solved to rounding: differences of whole runs then converge."""


def made(name=LIFT, seed=SEED, solver=FIXED, **settings):
    """An environment amid its first episode, with other options of its solver."""
    env = gymnasium.make(name, **settings).unwrapped
    env.solver = replace(env.solver, **solver)
    env.reset(seed=seed)
    return env


def some_actions(env, periods, seed=0):
    """Actions that change little enough for no command to meet its largest rate, shape (periods, n_a)."""
    rng = np.random.default_rng(seed)
    return rng.uniform(-0.05, 0.05, (periods, env.actions)) + np.array([0.1, -0.5, -0.4])[: env.actions]


def steps(env, actions, rows, seed=SEED):
    """These sensors behind each step of a new episode of the environment itself."""
    env.reset(seed=seed)
    found = []
    for action in actions:
        env.step(action)
        found.append(env.world.tables.dynamics.y[rows].copy())
    return np.array(found)
