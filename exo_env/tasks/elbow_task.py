"""What the tasks of the assisted elbow share: the limits that end an episode, and the reward terms of rewards.py."""

from __future__ import annotations

from typing import ClassVar

from dms_core.compiled.jit import compiled
from dms_core.kernels import floats, inner, matrix
from exo_env.settings import Settings
from exo_env.tables import DRIVE, PLAN, WORLD
from exo_env.tasks.elbow import ELBOW, lacking_of
from exo_env.tasks.judgement.limits import EVENTS, Limits, exceeded, limit_sentence
from exo_env.tasks.judgement.rewards import term_values
from exo_env.tasks.task import (
    NOTHING,
    Task,
    Values,
    end_with,
    event_of,
    first_of,
    readings,
    step_of,
    task_numbers,
    terms_of,
)

PREVIEW = (0.1, 0.2, 0.4)
"""How far ahead the plan is tabulated for those who are shown it [s]; assumed."""


@compiled
def put_preview(w, place):
    """Fill the reading of the plan some time ahead, which begins at a place in the readings."""
    r, preview, k = readings(w), matrix(inner(w, WORLD.plan), PLAN.preview), step_of(w)
    for i in range(preview.shape[1]):
        r[place + i] = preview[k, i]


@compiled
def judge_elbow(w, width):
    """Check the limits, then fill the reward terms of rewards.py, which are the first of the task's.

    Args:
        w: the world.
        width: error that earns 1/e [rad].
    """
    r, at, plan, drive = readings(w), first_of(w), inner(w, WORLD.plan), inner(w, WORLD.drive)
    reaction = r[at[ELBOW.reaction]]
    tensions = r[at[ELBOW.tension] : at[ELBOW.muscle_moment]]
    if event_of(w) == NOTHING:
        end_with(w, exceeded(task_numbers(w), r[at[ELBOW.angle]], tensions, reaction))
    term_values(
        r[at[ELBOW.error]], width, r[at[ELBOW.exo_moment]], lacking_of(w), floats(plan, PLAN.scale)[0], reaction,
        floats(drive, DRIVE.action), floats(drive, DRIVE.before), event_of(w) != NOTHING, terms_of(w),
    )  # fmt: skip


class ElbowTask(Task):
    """Base of the tasks of the assisted elbow."""

    limits_type: ClassVar[type[Settings]] = Limits
    limits: Limits
    events: ClassVar[tuple[str, ...]] = EVENTS
    preview: ClassVar[tuple[float, ...]] = PREVIEW

    def start_range(self) -> tuple[float, float]:
        """The limits of the elbow [deg]."""
        return self.limits.lowest_deg, self.limits.highest_deg

    def sentence(self, event: str, values: Values) -> str:
        """A sentence on the limit that was passed."""
        angle, reaction = float(values("angle")[0]), float(values("reaction")[0])
        return limit_sentence(event, self.limits, angle, float(values("tension").max()), reaction)
