"""Work shared out by Ray (https://www.ray.io), here or on a cluster; what a lost worker had is done again."""

from __future__ import annotations

import contextlib
import os
import socket
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

from dms_core.errors import DmsError, extra

ROOT = Path(__file__).resolve().parents[2]
"""Folder of the packages: the checkout, or where the wheel is installed."""
RETRIES = 3
"""Times a share is done again when its worker is lost."""
POLL = 0.5
"""Between two looks at who is done [s]."""
PATIENCE = 10.0
"""Until a cluster that does not answer is given up [s]."""
TOKEN = "(Where the cluster wants a token, set RAY_AUTH_MODE=token and RAY_AUTH_TOKEN as it was started with.)"
LEFT_BEHIND = ["/.git", "/.venv", "/out", "/build", "/dist", "__pycache__"]
"""Not sent to a cluster."""


def share_out(
    function: Callable[..., Any],
    shares: Sequence[tuple[Any, ...]],
    *,
    address: str | None = None,
    cpus: int | None = None,
    done: Callable[[int], None] = lambda k: None,
    waiting: Callable[[], None] = lambda: None,
) -> list[Any]:
    """Call a function with each share of arguments, each call in one process.

    Args:
        function: of a module that workers can import.
        shares: arguments of each call.
        address: of a cluster, or 'auto' for that of this machine; a local one is started where it is not given. A
            cluster with a token (the default of Ray 2.59 and later) reads it from RAY_AUTH_MODE and RAY_AUTH_TOKEN.
        cpus: of a local one; all there are where it is not given.
        done: called with the number of a share that is done.
        waiting: called again and again while others work.

    Returns:
        What the calls returned, in the order of the shares.

    Raises:
        DmsError: Ray is missing or cannot be reached, a call failed, or a share lost its worker too often.
    """
    with _cluster(address, cpus) as ray:
        results: list[Any] = [None] * len(shares)
        for k, result in _each(ray, function, shares, waiting):
            results[k] = result
            done(k)
        return results


@contextlib.contextmanager
def connected(address: str | None, cpus: int | None = None) -> Iterator[Callable[..., Iterator[Any]]]:
    """A cluster for several rounds of shares: a function that does shares and gives what comes of each, in order.

    Args:
        address: as in `share_out`.
        cpus: of a local one.

    Raises:
        DmsError: as `share_out`.
    """
    with _cluster(address, cpus) as ray:

        def each(function: Callable[..., Any], shares: Sequence[tuple[Any, ...]]) -> Iterator[Any]:
            results: dict[int, Any] = {}
            given = 0
            for k, result in _each(ray, function, shares):
                results[k] = result
                while given in results:
                    yield results.pop(given)
                    given += 1

        yield each


def _each(
    ray: Any, function: Callable[..., Any], shares: Sequence[tuple[Any, ...]],
    waiting: Callable[[], None] = lambda: None,
) -> Iterator[tuple[int, Any]]:  # fmt: skip
    """Number and result of each share, as they are done."""
    remote = ray.remote(num_cpus=1, max_retries=RETRIES)(function)
    running = {remote.remote(*share): k for k, share in enumerate(shares)}
    while running:
        ready, _ = ray.wait(list(running), timeout=POLL)
        for one in ready:
            yield running.pop(one), ray.get(one)
        waiting()


@contextlib.contextmanager
def _cluster(address: str | None, cpus: int | None) -> Iterator[Any]:
    """Ray, connected within; its errors, and those of workers, become ours."""
    ray = _started(address, cpus)
    try:
        yield ray
    except ray.exceptions.RayTaskError as error:
        raise DmsError(str(error.cause) if isinstance(error.cause, DmsError) else f"a worker failed: {error}") from None
    except ray.exceptions.RayError as error:
        reason = " ".join(str(error).split())[:200]
        raise DmsError(f"a share lost its worker {RETRIES + 1} times; not enough memory? Ray says: {reason}") from None
    finally:
        ray.shutdown()


def _started(address: str | None, cpus: int | None) -> Any:
    """Ray, connected."""
    try:
        import ray
    except ImportError:
        raise DmsError(f"Ray is missing. {extra('sweep')}") from None
    quiet: dict[str, Any] = {"log_to_driver": False, "logging_level": "error"}
    try:
        if address is None:
            environment = {"env_vars": {"PYTHONPATH": str(ROOT)}}
            ray.init("local", num_cpus=cpus, include_dashboard=False, runtime_env=environment, **quiet)
        else:
            _reach(address)
            # A checkout travels along; where the wheel is installed here, it has to be on the cluster, too.
            checkout = (
                {"working_dir": str(ROOT), "excludes": LEFT_BEHIND} if (ROOT / "pyproject.toml").is_file() else {}
            )
            ray.init(address, runtime_env=checkout, **quiet)
    except (ConnectionError, ValueError, RuntimeError, OSError) as error:
        reason = " ".join(str(error).split())[:200]
        hint = "" if address is None or os.environ.get("RAY_AUTH_TOKEN") else f" {TOKEN}"
        raise DmsError(f"Ray at '{address or 'local'}' cannot be reached: {reason}{hint}") from None
    return ray


def _reach(address: str) -> None:
    """Knock at a cluster's door: Ray itself would try for many minutes.

    Raises:
        OSError: nobody is there.
    """
    host, _, port = address.rpartition("://")[2].partition(":")
    if port.isdecimal():
        socket.create_connection((host, int(port)), timeout=PATIENCE).close()
