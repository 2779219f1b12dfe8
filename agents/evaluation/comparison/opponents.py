"""Who a policy is measured against where the plan is hidden: the best classical policy with its sensors, and an oracle.

Both were chosen by their mean return on training patients, which `python -m agents tune-baselines` writes beside the
tuned numbers; no evaluation has a say in it.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from dms_core.errors import InputError
from dms_core.files.config_files import configs

from ...environment import PROGRAM, hides_plan
from ...policies.baselines import REFERENCE_FREE
from ...policies.learned import find_policy
from ...policies.policy import Policy
from ...policies.tuned import HIDDEN_INTENT, tuned

RETURNS = "training_return"
"""Key of the file of tuned numbers: the mean return of each policy on the training patients, by its name."""
ALWAYS = frozenset({"device", "estimated"})
"""Groups that every opponent may see: what a device measures, and what it makes of that without another sensor."""


def training_returns() -> dict[str, float]:
    """Mean return of each policy on the training patients, by its name.

    Raises:
        InputError: the file of tuned numbers has none.
    """
    found: Any = tuned(HIDDEN_INTENT).get(RETURNS)
    if not isinstance(found, dict) or "oracle" not in found:
        raise InputError(
            f"'{configs() / HIDDEN_INTENT}' has no '{RETURNS}', by which opponents are chosen: run {PROGRAM} "
            "tune-baselines --env exo/HiddenIntent-v0, or reinstall exo-env."
        )
    return found


def sensors(observation: Sequence[str]) -> frozenset[str]:
    """Groups of an observation, whose parts may be single channels."""
    return frozenset(name.partition(".")[0] for name in observation)


def opponent_of(policy: Policy) -> str:
    """Name of the best tuned classical policy that sees no more than a policy does."""
    seen = sensors(policy.observation) | ALWAYS
    fair = {
        name: returned
        for name, returned in training_returns().items()
        if (kind := REFERENCE_FREE.get(name)) and not kind.informed and sensors(kind.observation) <= seen
    }
    return max(fair, key=fair.__getitem__)


def oracle_name() -> str:
    """Name of the best policy that is told the plan: the hand-made one, or a shipped one that learned."""
    told = {n: x for n, x in training_returns().items() if n not in REFERENCE_FREE or REFERENCE_FREE[n].informed}
    return max(told, key=told.__getitem__)


def with_opponents(policies: Sequence[Policy], environment: str) -> list[Policy]:
    """Policies, and behind them those that they are measured against, where these are not among them.

    Args:
        policies: to compare.
        environment: its id; where it hides no plan nobody is added.
    """
    if not hides_plan(environment):
        return list(policies)
    names = {one.name for one in policies}
    # None of them is a policy's own class, whose name a user may have taken.
    needed = dict.fromkeys([*map(opponent_of, policies), oracle_name()])
    return [*policies, *(find_policy(name, environment) for name in needed if name not in names)]
