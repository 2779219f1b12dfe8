"""The search for a better design: L-BFGS-B within bounds, on the mean objective of some wearers.

Variables are scaled so that the bounds are 0 and 1, and the objective so that the first step, which is that of steepest
descent, has FIRST_STEP as its longest part, whether an objective is sensitive or hardly so. A design in which a run
fails or the exercise is not done, or that no device can have, is not acceptable: it counts as REFUSED times today's
value with no slope, so that the line search turns back. The best design so far is kept whatever happens.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial
from itertools import count

import numpy as np
from scipy.optimize import minimize

from dms_core import SolverOptions
from dms_core.errors import DmsError, SimulationError
from exo_env.design.acceptance import Acceptance
from exo_env.design.gradient import Trial
from exo_env.design.objectives import Objective
from exo_env.design.space import DesignSpace
from exo_env.design.wearer import Wearer

REFUSED = 10.0
"""Times today's value that a design counts which is not acceptable."""
FIRST_STEP = 0.25
"""Longest part of the first step, as a part of the width of the bounds."""
GAIN = 1e-4
"""Relative gain of an iteration below which the search ends; runs err by less."""
ENDINGS = {
    0: f"It converged: an iteration gains less than {100.0 * GAIN:g} % of the objective, or no number has a way down "
    "within its bounds.",
    1: "The iterations are spent (--iterations); more of them may lower the objective further.",
    2: "The line search found no acceptable design with a lower objective along its last direction.",
}
"""Why a search ended, by the status of scipy's L-BFGS-B."""


@dataclass
class Found:
    """The best design of a search."""

    x: np.ndarray
    """Values of the numbers that are designed, shape (n,)."""
    start: float
    """Mean objective of today's design."""
    value: float
    """Mean objective of this one."""
    evaluations: int = 0
    """Times that objective and gradient were evaluated over all wearers."""
    refused: list[str] = field(default_factory=list)
    """A sentence for each design that was not acceptable."""
    stopped: bool = False
    """Whether the search was stopped by the user."""
    ending: str = ENDINGS[0]
    """Why it ended, a sentence."""


def search(
    space: DesignSpace,
    who: Sequence[Wearer],
    objective: Objective,
    options: SolverOptions,
    iterations: int,
    say: Callable[[str], None] = lambda sentence: None,
) -> Found:
    """The best design for these wearers.

    Args:
        space: what is designed.
        who: wearers that the objective is the mean of.
        objective: what is lowered.
        options: of the solver.
        iterations: largest number of iterations.
        say: is called with a sentence on each iteration, and on each design that is not acceptable.

    Raises:
        SimulationError: a run in today's design fails, does not do the exercise, or has nothing to lower.
        KeyboardInterrupt: stopped before today's design was evaluated.
    """
    width = space.high - space.low
    mean = partial(mean_gradient, space, who, objective, options, Acceptance())
    value, slope = mean(space.start)
    if value == 0.0:
        raise SimulationError(f"{objective.title}: it is 0 in today's design; there is nothing to lower.")
    found = Found(space.start.copy(), value, value, 1)
    begin = (space.start - space.low) / width
    downhill = np.clip(begin - slope * width, 0.0, 1.0) - begin
    if not downhill.any():
        return found
    scale = FIRST_STEP / np.abs(slope * width)[downhill != 0.0].max()
    # The optimiser begins with today's design, which is known.
    known, counter = [(value, slope)], count(1)

    def scaled(u: np.ndarray) -> tuple[float, np.ndarray]:
        now, by = known.pop() if known else _tried(found, mean, np.clip(space.low + width * u, space.low, space.high))
        if now == np.inf:
            say(f"not acceptable: {found.refused[-1]}")
            return REFUSED * scale * found.start, np.zeros(len(u))
        return scale * now, scale * by * width

    def tell(u: np.ndarray) -> None:
        change = 100.0 * (found.value / found.start - 1.0)
        say(
            f"iteration {next(counter)}: {found.value:.5g} {objective.unit} ({change:+.2f} %), "
            f"{found.evaluations} evaluations"
        )

    try:
        done = minimize(
            scaled, begin, jac=True, method="L-BFGS-B", bounds=[(0.0, 1.0)] * len(width),
            callback=tell, options={"maxiter": iterations, "ftol": GAIN * min(1.0, scale * value), "maxls": 5},
        )  # fmt: skip
        found.ending = ENDINGS[done.status]
    except KeyboardInterrupt:
        found.stopped, found.ending = True, "It was stopped."
    return found


def _tried(
    found: Found, mean: Callable[[np.ndarray], tuple[float, np.ndarray]], x: np.ndarray
) -> tuple[float, np.ndarray]:
    """Objective and gradient of a design, which is kept if it is the best; infinite where it is not acceptable."""
    found.evaluations += 1
    try:
        value, slope = mean(x)
    except DmsError as error:
        found.refused.append(str(error))
        return np.inf, np.zeros(len(x))
    if value < found.value:
        found.x, found.value = x, value
    return value, slope


def mean_gradient(
    space: DesignSpace,
    who: Sequence[Wearer],
    objective: Objective,
    options: SolverOptions,
    acceptance: Acceptance,
    x: np.ndarray,
) -> tuple[float, np.ndarray]:
    """Mean objective over some wearers, and its gradient, shape (n,).

    Raises:
        InputError: there can be no such device.
        SimulationError: a run fails or does not do the exercise; names the wearer.
    """
    device, parts = space.design(x).device, []
    for wearer in who:
        trial = Trial(wearer, space, x, options)
        acceptance.check(wearer.name, device, trial.off, trial.tension)
        parts.append(trial.gradient(objective))
    return float(np.mean([value for value, _ in parts])), np.mean([slope for _, slope in parts], axis=0)
