"""`python -m agents sweep`: trainings of several configurations and seeds, shared out by Ray."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Annotated, Any

from tqdm import tqdm
from tyro.conf import arg

from dms_core.command_line import FolderOut
from dms_core.errors import Stopped
from dms_core.files.output_place import check_folder

from ...distributed.cluster import share_out
from ...distributed.sweep import in_order, planned, steps_of, train_share
from ...distributed.variations import read_variations
from ...environment import PROGRAM
from ...training.settings.config import Config
from ...training.usable import require_training


def sweep(
    out: FolderOut,
    configs: tuple[Path, ...] = (),
    variations: Path | None = None,
    seeds: tuple[int, ...] = (0, 1, 2),
    changes: Annotated[tuple[str, ...], arg(name="set", metavar="KEY=VALUE ...")] = (),
    address: str | None = None,
    cpus: int | None = None,
    environment: Annotated[str | None, arg(name="env", metavar="ID")] = None,
) -> int:
    """Train every configuration with every seed; the same command again goes on where it was stopped.

    A training that learns from another of them (training.imitation.teacher, training.initial) waits for it.

    Args:
        out: folder of the trainings, one in each CONFIG_SEED; with a cluster, one that all its machines see.
        configs: YAML files in the format of rl_zoo3, as in configs/agents.
        variations: YAML file with a list of such files and of values that each variation changes, as in
            configs/ablations; their folders are NAME_SEED.
        seeds: of the trainings.
        changes: values that replace those of all configurations, as for train.
        address: of a Ray cluster, or 'auto' for that of this machine; a local one is started where it is not given.
        cpus: processes of a local one.
        environment: id of the section to take of each file, where it has several.
    """
    require_training()
    varied = () if variations is None else read_variations(variations)
    groups = in_order(planned(configs, seeds, changes, out, environment, varied))
    shares = [share for group in groups for share in group]
    check_folder(out)
    total = sum(Config.of(content, "").n_timesteps for content, _, _ in shares)
    with tqdm(total=total, unit="step", unit_scale=True, leave=False, disable=None) as bar:

        def show_progress() -> None:
            bar.update(min(sum(steps_of(Path(folder)) for _, _, folder in shares), total) - bar.n)

        best_ones: list[Any] = []
        try:
            for group in groups:
                best_ones += share_out(
                    train_share, group, address=address, cpus=cpus, waiting=show_progress,
                    done=partial(_say_done, bar, group),
                )  # fmt: skip
        except KeyboardInterrupt:
            raise Stopped("the same command goes on from the last checkpoints.") from None
    for (_, _, folder), best in zip(shares, best_ones, strict=True):
        print(f"{folder}: best return {best['return']:.4g} after {best['steps']} steps")
    print(f"figures: {PROGRAM} report {' '.join(folder for _, _, folder in shares)} --out {out / 'report'}")
    return 0


def _say_done(bar: Any, group: list[Any], k: int) -> None:
    """Say which training of a group is done."""
    bar.write(f"done: {group[k][2]}")
