"""Compiling a reset and a control period while another process compiles the kernels of the model."""

from __future__ import annotations

from numba import types

from dms_core.kernels import TABLE
from exo_env.world.kernels.control_period import run_period
from exo_env.world.kernels.reset import begin_episode

EPISODE_CODE = "exo_env.world.kernels.episode_code:compile_episode_code"


def compile_episode_code() -> None:
    """Compile both for the types with which a single environment calls them."""
    begin_episode.compile((TABLE,))
    run_period.compile((TABLE, types.Array(types.float64, 1, "C")))
