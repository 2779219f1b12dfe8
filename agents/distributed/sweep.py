"""`python -m agents sweep`: trainings of several configurations and seeds, shared out by Ray."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated, Any

from tqdm import tqdm
from tyro.conf import arg

from agents.commands.train import STOPPED, checked_config, require_training
from agents.distributed.cluster import share_out
from agents.training.config import Config
from agents.training.run_folder import EVALUATIONS, RECORD, RunFolder
from dms_core.errors import InputError
from dms_core.output_file import check_writable


def sweep(
    configs: tuple[Path, ...],
    out: Path,
    seeds: tuple[int, ...] = (0, 1, 2),
    changes: Annotated[tuple[str, ...], arg(name="set", metavar="KEY=VALUE ...")] = (),
    address: str | None = None,
    cpus: int | None = None,
) -> int:
    """Train every configuration with every seed; the same command again goes on where it was stopped.

    Args:
        configs: YAML files, see configs/agents.
        out: folder of the trainings, one in each CONFIG_SEED; with a cluster, one that all its machines see.
        seeds: of the trainings.
        changes: values that replace those of all configurations.
        address: of a Ray cluster, or 'auto' for that of this machine; a local one is started where it is not given.
        cpus: processes of a local one.
    """
    require_training()
    shares = planned(configs, seeds, changes, out)
    check_writable(out / "sweep.json")
    total = sum(Config.of(content, "").n_timesteps for content, _, _ in shares)
    with tqdm(total=total, unit="step", unit_scale=True, leave=False, disable=None) as bar:

        def look() -> None:
            bar.update(min(sum(_steps(Path(folder)) for _, _, folder in shares), total) - bar.n)

        try:
            found = share_out(
                train_share, shares, address=address, cpus=cpus, waiting=look,
                done=lambda k: bar.write(f"done: {shares[k][2]}"),
            )  # fmt: skip
        except KeyboardInterrupt:
            print("stopped; the same command goes on from the last checkpoints")
            return STOPPED
    for (_, _, folder), best in zip(shares, found, strict=True):
        print(f"{folder}: best return {best['return']:.4g} after {best['steps']} steps")
    print(f"figures: python -m agents report {' '.join(folder for _, _, folder in shares)} --out {out / 'report'}")
    return 0


def planned(
    configs: tuple[Path, ...], seeds: tuple[int, ...], changes: tuple[str, ...], out: Path
) -> list[tuple[dict[str, Any], int, str]]:
    """Configuration, seed and folder of each training.

    Raises:
        InputError: a configuration is wrong, or two trainings would share a folder.
    """
    if not configs or not seeds or min(seeds) < 0:
        raise InputError("configurations, and seeds from 0, are wanted.")
    shares = []
    for path in configs:
        config = checked_config(path, changes)
        shares += [(config.content(), seed, str(out.resolve() / f"{path.stem}_{seed}")) for seed in seeds]
    folders = [folder for _, _, folder in shares]
    if len(set(folders)) < len(folders):
        raise InputError("two trainings would share a folder; give different seeds, and files of different names.")
    return shares


def train_share(content: dict[str, Any], seed: int, folder: str) -> dict[str, Any]:
    """One training, from its start or from its last checkpoint; returns its best evaluation."""
    from agents.training.run import TrainingRun

    place = RunFolder(Path(folder))
    config = Config.of(content, "")
    if (place.path / RECORD).is_file():
        found, known = place.go_on(())
        if found.content() != config.content() or known != seed:
            raise InputError(f"'{folder}' holds a training of another configuration; choose another --out.")
    else:
        place.begin(config, seed)
    with place.locked():
        run = TrainingRun(place, config, seed, lambda steps, evaluation: None)
        run.run()
    return max(run.evaluations, key=lambda e: e["return"])


def _steps(folder: Path) -> int:
    """How far a training is, as far as its last evaluation tells."""
    try:
        return int(json.loads((folder / EVALUATIONS).read_text(encoding="utf-8"))[-1]["steps"])
    except (OSError, ValueError, IndexError):
        return 0
