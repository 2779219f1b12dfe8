"""Options that several commands share."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Annotated, Any

from tyro.conf import arg

from dms_core.errors import InputError
from dms_core.files.json_text import brief, parse_json

from ..checkpoint import Store
from ..distributed.cluster import connected
from ..environment import hides_plan
from ..evaluation.sharing.shares import ShareOut, processes
from ..policies.learned import (
    DESCRIPTION,
    SHIPPED,
    LearnedPolicy,
    find_policy,
    repetitions_of,
    shipped_for,
    shipped_policies,
)
from ..policies.policy import Policy

PolicyNames = Annotated[tuple[str, ...], arg(name="policy", metavar="NAME [NAME ...]")]
"""Option of the policies that a command runs."""
EnvironmentId = Annotated[str, arg(name="env", metavar="ID")]
"""Option of the environment that they act in."""


def different_policies(names: Sequence[str], environment: str | None = None) -> list[Policy]:
    """Policies by what a user calls them (see `find_policy`), no two of them the same under two names.

    Args:
        names: of the policies.
        environment: id of the one that they are to act in.

    Raises:
        InputError: there is none of a name, or two are the same.
    """
    found: dict[Any, str] = {}
    policies = []
    for name in names:
        policies.append(find_policy(name, environment))
        first = found.setdefault(_identity(name, policies[-1], environment), name)
        if len(found) < len(policies):
            raise InputError(f"policies '{first}' and '{name}' are the same one: expected different policies.")
    return policies


def given_folders(names: Sequence[str]) -> list[Path]:
    """What a command reads of policies by the names of a user: folders of trained ones that are not shipped."""
    return [Path(name) for name in names if name not in shipped_policies()]


def _identity(name: str, one: Policy, environment: str | None) -> Any:
    """What a policy is under any name: its class, or the folder that a trained one was read from."""
    if type(one) is not LearnedPolicy:
        return type(one)
    folder = SHIPPED / shipped_for(name, environment) if name in shipped_policies() else Path(name)
    return (folder if (folder / DESCRIPTION).is_file() else Store(folder / "best").latest()).resolve()


def check_hides_plan(environment: str, usual: str) -> None:
    """Refuse an environment whose task hides nothing.

    Args:
        environment: its id.
        usual: id of one that would be right.

    Raises:
        InputError: names the option.
    """
    if not hides_plan(environment):
        raise InputError(f"--env {environment}: expected one whose task hides the patient's plan, such as {usual}.")


@contextlib.contextmanager
def sharing_out(workers: int, address: str | None) -> Iterator[ShareOut]:
    """What does the shares of a long work, for the options --workers and --address.

    Args:
        workers: processes of this machine.
        address: of a Ray cluster, or 'local' for one of this machine; without it there are processes.
    """
    if address is None:
        with processes(workers) as share_out:
            yield share_out
    else:
        with connected(None if address == "local" else address, workers) as share_out:
            yield share_out


def device_settings(exoskeleton: str | None) -> dict[str, Any]:
    """Settings of the environment for the option --exoskeleton.

    Args:
        exoskeleton: name of a shipped device, a YAML file, or changes of the default device as JSON; None: the default.

    Raises:
        InputError: the JSON is not a mapping.
    """
    if exoskeleton is None:
        return {}
    if not exoskeleton.lstrip().startswith(("{", "[")):
        return {"exoskeleton": exoskeleton}
    said = f"--exoskeleton {brief(exoskeleton, 60)}"
    changes = parse_json(exoskeleton, f"{said}: expected a name, a YAML file or JSON, which")
    if not isinstance(changes, dict):
        raise InputError(f'{said}: expected a mapping, for example {{"hinge_damping": 0.1}}.')
    return {"exoskeleton": changes}


def repeated(policies: Sequence[Policy], given: int | None) -> dict[str, Any]:
    """Settings of the environment for the option --repetitions; none where an episode is as the environment has it.

    Args:
        policies: that act; without the option there are as many repetitions as the trained ones among them learned.
        given: the option.
    """
    often = repetitions_of(policies, given)
    return {"repetitions": often} if given is not None or often > 1 else {}
