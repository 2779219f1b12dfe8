"""`python -m agents train`."""

from __future__ import annotations

import contextlib
import signal
import sys
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any

from tqdm import tqdm
from tyro.conf import arg

from dms_core.command_line import STOPPED, FolderOut
from dms_core.errors import InputError, Stopped
from dms_core.files.config_files import configs

from ...environment import PROGRAM, environment_id
from ...evaluation.episodes.episode import judged
from ...training.usable import check_other_policies, checked_config, require_training

BAR = "{percentage:3.0f}% |{bar}| {n_fmt} of {total_fmt} steps, {rate_fmt}, {elapsed} passed, {remaining} left"


def train(
    config: Path | None = None,
    seed: int | None = None,
    changes: Annotated[tuple[str, ...], arg(name="set", metavar="KEY=VALUE ...")] = (),
    out: FolderOut | None = None,
    resume: Path | None = None,
    environment: Annotated[str | None, arg(name="env", metavar="ID")] = None,
) -> int:
    """Train a policy; Ctrl-C saves a checkpoint, and --resume goes on from the last one.

    Args:
        config: YAML file in the format of rl_zoo3, as in configs/agents.
        seed: decides all that is random; 0 where it is not given.
        changes: values that replace those of the configuration, for example n_timesteps=1e5 policy_kwargs.net_arch=[32]
            training.eval_every=1e4. A value is YAML 1.2, so that 1e5 is a number, 010 is 10 and yes is text.
        out: folder of the training, empty or new; out/training/ALGORITHM_SEED where it is not given.
        resume: folder of a training to go on with; of the values only n_timesteps, training.eval_every,
            training.save_every, training.threads and training.device may then be changed.
        environment: id of the section of the configuration to take; module:ID where another package registers it.
    """
    require_training()
    from ...training.run import TrainingRun

    if environment is not None:
        environment_id(environment)

    begun = _begun(config, seed, changes, out, resume, environment)
    with _stopping() as stop, begun as (folder, used, seed):
        try:
            with _bar(used.n_timesteps) as report:
                run = TrainingRun(folder, used, seed, report, judged, stop)
                for line in _outlook(run.steps, run.end, used.n_timesteps):
                    tqdm.write(line)
                done = run.run()
        except KeyboardInterrupt:
            raise Stopped(f"what was saved before is in '{folder.path}'; the rest is lost.") from None
    if not done:
        stopped = f"stopped after {run.steps} steps, an unfinished round is dropped"
        print(f"{stopped}; go on with: {PROGRAM} train --resume {folder.path}")
        return STOPPED
    best = max(run.evaluations, key=lambda e: e["return"])
    print(f"{run.steps} steps in {run.seconds:.0f} s; best return {best['return']:.5g} after {best['steps']} steps")
    print(f"written: {folder.path}")
    return 0


def _outlook(steps: int, end: int, planned: int) -> Iterator[str]:
    """What is ahead, where it is not just what the configuration says."""
    if steps >= planned:
        yield f"already complete: {steps} of {planned} steps; give more with --set n_timesteps=..."
        return
    if steps > 0:
        yield f"going on after {steps} steps"
    if end > planned:
        yield f"rounds are not cut short: the training ends after {end} steps, not {planned}"


@contextlib.contextmanager
def _begun(
    config: Path | None, seed: int | None, changes: tuple[str, ...], out: Path | None, resume: Path | None,
    environment: str | None,
) -> Iterator[Any]:  # fmt: skip
    """Folder, configuration and seed of a training, which no other process can begin or go on with meanwhile."""
    from ...training.files.run_folder import RunFolder

    if resume is not None:
        if config is not None or out is not None:
            raise InputError("--resume takes configuration and folder from the training; leave out --config and --out.")
        folder = RunFolder(resume)
        # First: what is no training gets no lock.
        _check_known(resume, seed, environment)
        with folder.locked():
            yield folder, *folder.go_on(changes)
        return
    if config is None:
        raise InputError(f"expected --config FILE or --resume DIR; there are files in {configs() / 'agents'}.")
    seed = 0 if seed is None else seed
    if seed < 0:
        raise InputError(f"seed = {seed}: expected a whole number from 0.")
    # A mistake shall not leave a folder behind.
    used = checked_config(config, changes, environment)
    folder = RunFolder(out or Path("out/training") / f"{used.training.algorithm}_{seed}")
    used = used.placed(folder.path, seed)
    check_other_policies(used)
    folder.check_new()
    with folder.locked():
        folder.begin(used, seed)
        yield folder, used, seed


def _check_known(folder: Path, seed: int | None, environment: str | None) -> None:
    """Refuse another seed or environment than those of a training that is to go on."""
    from ...training.files.records import read_record

    record = read_record(folder)
    if seed is not None and seed != record["seed"]:
        raise InputError(f"--seed {seed}: the training in '{folder}' has seed {record['seed']}, which may not change.")
    if environment is not None and environment_id(environment) != environment_id(record["environment"]):
        raise InputError(
            f"--env {environment}: the training in '{folder}' is in {record['environment']}, which may not change."
        )


@contextlib.contextmanager
def _stopping() -> Iterator[Any]:
    """Whether the user wants to stop: asked after each step. A second Ctrl-C stops at once."""
    asked: list[int] = []
    if threading.current_thread() is not threading.main_thread():
        yield lambda: False
        return

    def ask(number: int, frame: Any) -> None:
        asked.append(number)
        signal.signal(number, before[number])
        print("\nstopping after this step; Ctrl-C once more stops at once", file=sys.stderr, flush=True)

    before: dict[int, Any] = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    for number in before:
        signal.signal(number, ask)
    try:
        yield lambda: bool(asked)
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


@contextlib.contextmanager
def _bar(steps: int) -> Iterator[Any]:
    """A progress bar, and a line an evaluation."""
    with tqdm(total=steps, unit="step", unit_scale=True, leave=False, disable=None, bar_format=BAR) as bar:

        def report(done: int, evaluation: dict[str, Any] | None) -> None:
            if bar.n == 0 and done > 0:
                bar.initial = bar.n = done
            bar.update(done - bar.n)
            if evaluation is not None:
                bar.write(line(evaluation))

        yield report


SHOWN = (
    ("return", "return", ".5g", ""), ("tracking_rms_deg", "tracking", ".3g", " deg"),
    ("device_work_share", "work of the device", ".2f", ""), ("unsafe", "unsafe", ".2f", ""),
)  # fmt: skip
"""Measures in the line of an evaluation, with label, format and unit."""


def line(evaluation: dict[str, Any]) -> str:
    """An evaluation in words."""
    parts = []
    for name, label, digits, unit in SHOWN:
        # An environment without the reading has no such measure.
        if name in evaluation:
            value = evaluation[name]
            parts.append(f"{label} {'-' if value is None else format(value, digits)}{unit}")
    return f"{evaluation['steps']:>9} steps: {', '.join(parts)}"
