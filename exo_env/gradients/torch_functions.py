"""One control period and a whole episode of an environment as functions that torch differentiates.

torch is imported where a function is called. Numbers are computed as doubles on the CPU; second derivatives are not
given.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import Any, NamedTuple

import gymnasium
import numpy as np

from dms_core.errors import InputError
from dms_core.sensitivity.nodes import Number
from exo_env.drives.drive import checked_action
from exo_env.envs.base_env import AssistanceEnv
from exo_env.gradients.maps import carried_back
from exo_env.gradients.moments import Moment
from exo_env.gradients.periods import Periods


class State(NamedTuple):
    """The state of an episode at a control time."""

    numbers: Any
    """What the future depends on smoothly, a tensor: coordinates, rates, inputs, and what the patient remembers."""
    moment: Moment
    """The rest."""


@cache
def _function() -> Any:
    """The subclass of torch.autograd.Function, made when torch is first needed."""
    import torch

    class OnePeriod(torch.autograd.Function):
        @staticmethod
        def forward(
            ctx: Any, state: Any, action: Any, numbers: Any, of: Any, moment: Any, slopes: Any, behind: Any
        ) -> Any:
            x, a, p = (y.detach().cpu().double().numpy() for y in (state, action, numbers))
            used = checked_action(a, of.env.actions)
            ran = of.periods.run(moment, x, used, p, slopes)
            behind.append(ran.moment)
            ctx.maps, ctx.vector, ctx.inside = ran.maps, of.periods.vector, a == used
            ctx.types = [y.dtype for y in (state, action, numbers)]
            return torch.as_tensor(ran.state), torch.as_tensor(ran.read)

        @staticmethod
        def backward(ctx: Any, by_state: Any, by_read: Any) -> Any:
            at, x = ctx.vector.at, np.zeros(ctx.vector.size)
            x[: ctx.vector.state], x[at["read"]] = by_state.numpy(), by_read.numpy()
            carried_back(ctx.maps, x)
            found = [x[: ctx.vector.state], x[at["action"]] * ctx.inside, x[at["numbers"]]]
            tensors = [torch.as_tensor(y).to(kind) for y, kind in zip(found, ctx.types, strict=True)]
            return *tensors, None, None, None, None

    return OnePeriod


class ControlPeriod:
    """One control period of an environment as a function of state, action and declared numbers.

    The derivative holds the world's equations along the solver's own steps, the drive, and the patient: what is felt,
    its delays, effort, fatigue and reflexes. Random numbers and the plan are given. An action is clipped to -1 to 1,
    beyond which its derivative is 0. Events of the task end nothing here.

    Args:
        env: an environment of this package that was reset; the function belongs to its present episode.
        readings: what is read at the end of a period: sensors of the model, or readings that copy sensors, by name.
        numbers: declared numbers that are given with each period, such as Number("forearm", "mass"). The start of the
            episode and the patient's plan stay what they are.

    Raises:
        InputError: it is another environment, a name is unknown, or the drive is not differentiable.
        gymnasium.error.ResetNeeded: the environment has no episode.

    Example:
        >>> period = ControlPeriod(env, ["angle", "tension"])
        >>> state, readings = period(period.start(), action)
    """

    def __init__(self, env: gymnasium.Env, readings: Sequence[str], numbers: Sequence[Number] = ()) -> None:
        own: Any = getattr(env, "unwrapped", env)
        if not isinstance(own, AssistanceEnv):
            raise InputError(f"env: Expected one environment of exo_env, got {type(own).__name__}.")
        self.env, self.periods = own, Periods(own, readings, numbers)

    @property
    def labels(self) -> list[str]:
        """Name of the sensor behind each component of what is read."""
        return self.periods.labels

    def numbers(self) -> Any:
        """The declared values of the numbers, a tensor of shape (n_p,)."""
        import torch

        return torch.as_tensor(self.periods.numbers.declared.copy())

    def readings(self) -> Any:
        """What is read where the environment is now, a tensor of shape (n,)."""
        import torch

        return torch.as_tensor(self.env.world.tables.dynamics.y[self.periods.rows])

    def start(self) -> State:
        """The state in which the environment is now."""
        import torch

        x, moment = self.periods.start()
        return State(torch.as_tensor(x), moment)

    def __call__(self, state: State, action: Any, numbers: Any = None) -> tuple[State, Any]:
        """The state behind a period, and what is read there, shape (n,).

        Args:
            state: from `start`, or from a period of the same function.
            action: shape (n_a,).
            numbers: values of the declared numbers, shape (n_p,); None: as declared.

        Raises:
            InputError: a shape is wrong, a number is not finite, or the state belongs to another episode or its end.
            SimulationError: the solver gives up.
        """
        import torch

        behind: list[Moment] = []
        given = self.numbers() if numbers is None else numbers
        # Where torch takes no gradients, as for a test of a policy, none are found.
        slopes = torch.is_grad_enabled() and any(y.requires_grad for y in (state.numbers, action, given))
        x, read = _function().apply(state.numbers, action, given, self, state.moment, slopes, behind)
        return State(x, behind[0]), read


class WholeEpisode:
    """The present episode of an environment, from now on, as a function of all actions and of declared numbers.

    Args:
        env: as in `ControlPeriod`.
        readings: as in `ControlPeriod`.
        numbers: as in `ControlPeriod`.

    Example:
        >>> env.reset(seed=0)
        >>> run = WholeEpisode(env, ["angle"])
        >>> loss = ((run(actions)[:, 0] - target) ** 2).mean()
        >>> loss.backward()
    """

    def __init__(self, env: gymnasium.Env, readings: Sequence[str], numbers: Sequence[Number] = ()) -> None:
        self.period = ControlPeriod(env, readings, numbers)
        self._start = self.period.start()

    def __call__(self, actions: Any, numbers: Any = None) -> Any:
        """What is read at the end of each period, shape (k, n).

        Args:
            actions: shape (k, n_a), for as many periods as the episode has at most.
            numbers: as in `ControlPeriod`.

        Raises:
            InputError: actions have another shape, and as in `ControlPeriod`.
        """
        import torch

        if actions.ndim != 2 or not len(actions) or actions.shape[1] != self.period.env.actions:
            raise InputError(
                f"actions have shape {tuple(actions.shape)}; expected (periods, {self.period.env.actions}), a row for "
                "each control period."
            )
        state, found = self._start, []
        for action in actions:
            state, read = self.period(state, action, numbers)
            found.append(read)
        return torch.stack(found)
