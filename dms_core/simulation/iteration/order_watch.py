"""When the order of elimination, or the choice of independent rows, no longer fits the motion: it is then chosen anew.

Both are read off numbers at hand. A pivot of the Newton matrix that has become a hundred times smaller than it was
under the same order tells that rows which were independent where they were chosen hardly are any more (Bennett's and
Bricard's linkages); only a model with redundant rows has others to take. An iteration that fails in a step of quite
another size than the order was chosen for may have lost its pivots in rounding.
"""

from dms_core.assembly.tables import MODEL
from dms_core.compiled.arena import floats, number
from dms_core.compiled.jit import compiled
from dms_core.simulation.state import CLOCK, STATE

WEAK = 1e-2
"""Pivot, over the best one under the same order, at which a model with redundant rows has them chosen anew."""
LOST = 1e-6
"""The same for a model that needs all its rows, and has a choice of the order only."""
SUSPECT = 1e-3
"""Pivot, over the best one under the same order, at which steps that fail ask whether the position is singular."""
LEFT_BEHIND = 10.0
"""Pivot, over the one below which a position counts as nearly singular, at which that is over."""
OTHER_SIZE = 10.0
"""Factor between step sizes beyond which a failed iteration may be due to the order of elimination."""


@compiled
def note_pivot(s, pivot):
    """Take note of the smallest relative pivot of a Newton matrix that a step of any method has factorised."""
    clock = floats(s, STATE.clock)
    clock[CLOCK.pivot] = pivot
    clock[CLOCK.best_pivot] = max(clock[CLOCK.best_pivot], pivot)
    if pivot > LEFT_BEHIND * clock[CLOCK.singular_pivot]:
        clock[CLOCK.singular_pivot] = 0.0


@compiled
def pivots_weaken(m, s):
    """True where other rows or pivots should be taken, before the ones at hand have cost too many digits."""
    clock = floats(s, STATE.clock)
    limit = WEAK if number(m, MODEL.redundant) > 0 else LOST
    return clock[CLOCK.pivot] < limit * clock[CLOCK.best_pivot]


@compiled
def ordered_for_another_size(m, s):
    """True where the matrix that failed belongs to a step of quite another size than the order of elimination."""
    ratio = floats(s, STATE.clock)[CLOCK.c0_factored] / floats(m, MODEL.c0_ordered)[0]
    return not 1.0 / OTHER_SIZE < ratio < OTHER_SIZE


@compiled
def nearly_singular(s):
    """True where all rows together lose rank, as the singular values at the last weak pivot have told."""
    clock = floats(s, STATE.clock)
    return clock[CLOCK.pivot] < clock[CLOCK.singular_pivot]


@compiled
def may_be_singular(m, s):
    """True where a step that fails again and again may do so for the position, which is to be looked at."""
    clock = floats(s, STATE.clock)
    # With redundant rows the best pivot is forgotten too often, as rows are chosen anew, to tell anything.
    suspect = number(m, MODEL.redundant) > 0 or clock[CLOCK.pivot] < SUSPECT * clock[CLOCK.best_pivot]
    return suspect and not nearly_singular(s)
