"""`python -m agents ablations`: the trained variations of a list in one table, a row a variation over its seeds."""

from __future__ import annotations

import shlex
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from dms_core.command_line import FAILED_RUN, FolderOut
from dms_core.errors import InputError, counted, printable
from dms_core.files.output_file import markdown_cell, write_text
from dms_core.files.outputs import Outputs

from ...distributed.variations import folder_of, read_variations
from ...environment import HIDDEN_PLAN, PROGRAM
from ...evaluation.comparison.evaluate import Plan
from ...evaluation.comparison.opponents import opponent_of, oracle_name, with_opponents
from ...evaluation.results.key_figures import FIGURES, HEADS, MEANS, cells, columns, key_figures, measured_episodes
from ...evaluation.results.tables import records_text
from ...evaluation.sharing.kept_shares import forget
from ...policies.learned import find_policy
from ...policies.policy import Policy
from ..options import EnvironmentId, check_hides_plan
from .kept_cells import run_cells

Row = tuple[str, int, str, dict[str, dict[str, Any]]]
"""Name, number of trainings, opponent, and figures."""


def ablations(
    variations: Path,
    runs: Path,
    out: FolderOut,
    seeds: tuple[int, ...] = (0, 1),
    population: str = "evaluation",
    patients: int = 40,
    loads: tuple[float, ...] = (),
    seed: int = 1,
    workers: int = 1,
    address: str | None = None,
    environment: EnvironmentId = HIDDEN_PLAN,
    overwrite: bool = False,
) -> int:
    """Evaluate what `sweep --variations` trained, all on the same patients: ablations.csv and ablations.md.

    The opponent of each variation and the oracle are evaluated, too. Episodes are kept beside the folder as they are
    done. After a stop the same command goes on from there.

    Args:
        variations: the list that was trained.
        runs: folder of its trainings, the --out of the sweep.
        out: folder for the results; made where it is missing.
        seeds: of the trainings.
        population: of the patients, by name or YAML file.
        patients: how many.
        loads: that each patient lifts [kg]; one drawn for each patient where none is given.
        seed: of the patients and of the bootstrap.
        workers: processes.
        address: of a Ray cluster that does the episodes, or 'local' for one of this machine; processes where not given.
        environment: in which, by id.
        overwrite: replace files in the folder that others wrote or changed.
    """
    if not seeds or len(set(seeds)) < len(seeds):
        raise InputError(f"--seeds {' '.join(map(str, seeds))}: expected one or more different seeds.")
    check_hides_plan(environment, HIDDEN_PLAN)
    names = [one.name for one in read_variations(variations)]
    trained = {name: [find_policy(str(folder_of(runs, name, k))) for k in seeds] for name in names}
    everyone = with_opponents([one for ones in trained.values() for one in ones], environment)
    plan = Plan(population, patients, seed, loads, environment)
    command = f"{PROGRAM} ablations --variations {shlex.quote(str(variations))} --runs {shlex.quote(str(runs))} "
    command += f"--seeds {' '.join(map(str, seeds))} {_options(plan, population)}"
    with Outputs("ablations", folder=out, inputs=[population, variations, runs], overwrite=overwrite) as outputs:
        done = run_cells(measured_episodes, [(one, plan) for one in everyone], out, workers, address)
        episodes = {one.name: those for one, those in zip(everyone, done, strict=True)}
        rows = _rows(trained, everyone, episodes, seed)
        write_text(out / "ablations.csv", _numbers(rows, patients, command))
        write_text(out / "ablations.md", _text(rows, plan, command))
        forget(out)
    print(f"written: {outputs.where(out)} (ablations.csv, ablations.md)")
    return FAILED_RUN if outputs.failed else 0


def _options(plan: Plan, population: str) -> str:
    """Options that say what is evaluated, as they are typed."""
    options = f"--population {shlex.quote(population)} --patients {plan.patients} --seed {plan.seed}"
    options += f" --loads {' '.join(f'{x:g}' for x in plan.loads)}" if plan.loads else ""
    return options + (f" --env {plan.environment}" if plan.environment != HIDDEN_PLAN else "")


def _rows(
    trained: Mapping[str, Sequence[Policy]], everyone: Sequence[Policy], episodes: Mapping[str, list[dict[str, Any]]],
    seed: int,
) -> list[Row]:  # fmt: skip
    """A row a variation, then one for each policy that it is measured against."""
    known = {one.name for ones in trained.values() for one in ones}
    others = {one.name: [one] for one in everyone if one.name not in known}
    rows = []
    for name, ones in {**trained, **others}.items():
        opponent, joined = opponent_of(ones[0]), [e for one in ones for e in episodes[one.name]]
        found = key_figures(joined, episodes[opponent], episodes[oracle_name()], seed, len(ones))
        rows.append((name, len(ones), opponent, found))
    return rows


def _numbers(rows: Sequence[Row], patients: int, command: str) -> str:
    """A row a variation, below a line with the command."""
    records: list[Mapping[str, Any]] = [
        {"variation": name, "trainings": count, "opponent": against, "patients": patients, **columns(found)}
        for name, count, against, found in rows
    ]
    return records_text(records, command)


def _text(rows: Sequence[Row], plan: Plan, command: str) -> str:
    """One table of Markdown."""
    heads = ["variation", "trainings", "opponent", *(HEADS[figure] for figure in FIGURES)]
    lines = ["# Ablations", "", printable(f"{counted(plan.patients, 'patient')} of '{plan.title}', seed {plan.seed}, "
             f"in {plan.id}. {MEANS} Patients and trainings are resampled."), "", f"`{printable(command)}`", "",
             f"| {' | '.join(heads)} |", f"|{'---|' * len(heads)}"]  # fmt: skip
    for name, count, against, found in rows:
        texts = [name, str(count), against, *cells(found)]
        lines.append(f"| {' | '.join(markdown_cell(x) for x in texts)} |")
    return "\n".join([*lines, ""])
