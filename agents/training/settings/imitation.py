"""Imitation: a student learns the actions of a teacher that sees more, in the states that the student itself comes to.

DAgger (Ross, Gordon and Bagnell 2011, arXiv:1011.0686). In each round every world does one episode. The teacher says
after each observation what it would do; a share of the worlds, which falls from 1 to 0, is driven by the teacher, the
others by the student. Then the student is fitted to what the teacher said in the last rounds.
"""

from __future__ import annotations

from pydantic import Field

from exo_env.settings import Settings

MOST_STEPS = 10**12


class Imitation(Settings):
    """How a student learns from a teacher (algorithm dagger)."""

    teacher: str = Field(
        min_length=1,
        max_length=4096,
        description="a policy by name, the folder of a trained one or of its training; what begins with ../ is beside "
        "the training's own folder, and {seed} is the training's seed",
    )
    driven: int = Field(
        default=100_000, ge=0, le=MOST_STEPS,
        description="steps over which the share of worlds that the teacher drives falls from 1 to 0",
    )  # fmt: skip
    noise: float = Field(
        default=0.0, ge=0.0, le=1.0,
        description="standard deviation of what is added to the actions that drive the worlds, so that the student "
        "comes to know the states that noise leads to, that of reinforcement learning afterwards too",
    )  # fmt: skip
    kept: int = Field(default=8, ge=1, le=1000, description="rounds that are learned from, the last ones")
    segment: int = Field(
        default=150, ge=1, le=1_000_000, description="decisions over which an error is followed back in time"
    )
