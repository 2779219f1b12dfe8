"""What a world does about a matrix that is singular, or soon will be: other rows, another order, a shorter step."""

from __future__ import annotations

import math

import numpy as np

from dms_core.assembly.pattern.linear_systems import TYPICAL_C0
from dms_core.errors import ModelError
from dms_core.simulation.failure import singular_joints
from dms_core.simulation.inspection import Inspection
from dms_core.simulation.iteration.order_watch import LEFT_BEHIND, WEAK, ordered_for_another_size
from dms_core.simulation.iteration.parts import SINGULAR_PIVOT
from dms_core.simulation.state import CLOCK, COUNTS, with_tables
from dms_core.simulation.step_control import OUTCOME

LOOK_AGAIN = 0.3
"""Share of a pivot to which it may fall beside a singular position before that is looked at again."""
MOST_RESCUES = 8
"""Times in one call that an iteration which fails at every step size is given another order of elimination."""
Place = tuple[int, float, int | None]
"""Where an order was chosen anew: code, time, decimal logarithm of c0; None where nearby states were looked at too."""
HELPED = (OUTCOME.matrix_singular, OUTCOME.rates_failed, OUTCOME.newton_failed, OUTCOME.step_too_small)
"""Ways to stop that another order of elimination may help."""


class Rescue(Inspection):
    """A world that has its order of elimination chosen anew along the motion."""

    _singular: str
    """Why no order could be chosen, in a sentence."""

    def _help(self, code: int, tried: set[Place]) -> bool:
        """Do something about a matrix that is singular, or soon will be; False if nothing is left that was not tried.

        Args:
            code: of HELPED.
            tried: where an order was chosen anew; written.
        """
        clock, asked = self.state.clock, code == OUTCOME.matrix_singular
        c0 = float(clock[CLOCK.c0_factored]) or TYPICAL_C0
        place: Place = (code, self.time, round(math.log10(c0)))
        known, rescues = place in tried, sum(p[0] == code for p in tried)
        tried.add(place)
        usable = asked and clock[CLOCK.pivot] > SINGULAR_PIVOT
        if usable and not ordered_for_another_size(self._tables.table, self._world.table):
            self._heed_weak_pivot(c0, known)
            return True
        if asked and known:
            return self._pass_saturation((code, self.time, None), tried)
        if known or (not asked and rescues >= MOST_RESCUES):
            return False
        clock[CLOCK.best_pivot] = 0.0
        if code == OUTCOME.rates_failed:
            self.state.counts[COUNTS.restart] = 1
        return self.reorder(c0 if asked or self.options.fixed_step else TYPICAL_C0) or usable

    def _heed_weak_pivot(self, c0: float, known: bool) -> None:
        """Choose an order anew in time, or know the position as singular; nothing where that was done (`known`)."""
        clock = self.state.clock
        weak = clock[CLOCK.pivot] < WEAK * clock[CLOCK.best_pivot]
        clock[CLOCK.best_pivot] = 0.0
        if known:
            return
        if singular_joints(self.model, self.state.q, self.time)[0]:
            # No choice of rows or pivots is a good one here, and one that is made here is none for later.
            clock[CLOCK.best_pivot] = LOOK_AGAIN * clock[CLOCK.pivot] / WEAK
            clock[CLOCK.singular_pivot] = LEFT_BEHIND * clock[CLOCK.pivot]
        elif weak:
            self.reorder(c0)

    def _pass_saturation(self, place: Place, tried: set[Place]) -> bool:
        """Another order, once, or a shorter step; False if neither is left.

        A command that saturates within the step leaves no pivot where the present state shows one.
        """
        if place in tried:
            return self._shorten()
        tried.add(place)
        return self.reorder(nearby=True) or self._shorten()

    def reorder(self, c0: float = TYPICAL_C0, nearby: bool = False) -> bool:
        """Choose rows and pivots anew where the old ones are, or soon will be, singular; False if nothing helps.

        The motion goes on as it was: the multipliers of the new rows exert the force of the old ones.

        Args:
            c0: leading coefficient of the step [1/s] that the order is for.
            nearby: look at nearby states too.
        """
        s, before = self.state, self._tables.values.active
        try:
            self._tables = self.model.reordered(s.q, s.v, self.time, s.signals, c0, nearby)
        except ModelError as error:
            self._singular = str(error)
            return False
        self._singular = ""
        rows = self._tables.values.active
        if not np.array_equal(rows, before):
            kept = np.array([s.lam, s.lam_before, s.mu])
            s.lam[:], s.lam_before[:], s.mu[:] = self.model.carried_over(s.q, kept, rows)
        self._world = with_tables(self._tables.values, s)
        self.state = self._world.values
        return True

    def _shorten(self) -> bool:
        """A quarter of the step for a matrix that is singular far from the present state; False below the smallest."""
        clock = self.state.clock
        clock[CLOCK.h_wanted] *= 0.25
        return self.options.fixed_step is None and bool(clock[CLOCK.h_wanted] > self.options.h_min)
