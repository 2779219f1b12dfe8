"""`python -m agents shift`: the return of policies over the size of shifts away from training."""

from __future__ import annotations

import shlex
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any

from tyro.conf import arg

from dms_core.command_line import FAILED_RUN, FolderOut
from dms_core.errors import InputError, choices, counted, printable
from dms_core.figures import require_matplotlib
from dms_core.files.output_file import markdown_cell, write_text
from dms_core.files.outputs import Outputs

from ...environment import HIDDEN_PLAN, PROGRAM
from ...evaluation.comparison.evaluate import Plan
from ...evaluation.comparison.opponents import opponent_of, oracle_name, with_opponents
from ...evaluation.figures.line_figures import Curve, draw_panels, line_titles
from ...evaluation.results.key_figures import FIGURES, HEADS, MEANS, cells, columns, key_figures, measured_episodes
from ...evaluation.results.tables import records_text
from ...evaluation.sharing.kept_shares import Cell, forget
from ...evaluation.studies.shift import SHIFTS
from ...policies.policy import Policy
from ..options import EnvironmentId, PolicyNames, check_hides_plan, different_policies, given_folders
from .kept_cells import run_cells

FAULTS = "Faults of sensors reach the policies that read these sensors; to others it is the same episode again."
ShiftNames = Annotated[
    tuple[str, ...],
    arg(metavar="NAME [NAME ...]", help=f"{', '.join(SHIFTS)}; all of them where none is given."),
]
Row = tuple[str, float, Policy, dict[str, dict[str, Any]]]
"""Shift, size, policy and its figures."""


def shift(
    policy_names: PolicyNames,
    out: FolderOut,
    shifts: ShiftNames = (),
    population: str = "mixed",
    patients: int = 20,
    seed: int = 1,
    workers: int = 1,
    address: str | None = None,
    environment: EnvironmentId = HIDDEN_PLAN,
    overwrite: bool = False,
) -> int:
    """Run policies under shifts away from training, of several sizes each: shift.csv, shift.md and shift.png.

    The best classical policy with the same sensors and the oracle take part, too. Episodes are kept beside the folder
    as they are done. After a stop the same command goes on from there.

    Args:
        policy_names: names of the command `policies`, folders of trained ones, or module:Class.
        out: folder for the results; made where it is missing.
        shifts: by name; all of them where none is given.
        population: of the patients without a shift, by name or YAML file.
        patients: how many, the same in every cell.
        seed: of the patients and of the bootstrap; another one than that of a training.
        workers: processes.
        address: of a Ray cluster that does the episodes, or 'local' for one of this machine; processes where not given.
        environment: in which, by id; one whose task hides the patient's plan.
        overwrite: replace files in the folder that others wrote or changed.
    """
    _check(policy_names, shifts)
    check_hides_plan(environment, HIDDEN_PLAN)
    require_matplotlib()
    used = with_opponents(different_policies(policy_names, environment), environment)
    plan = Plan(population, patients, seed, (), environment)
    keys = [(name, size, one) for name in shifts or SHIFTS for size in SHIFTS[name].sizes for one in used]
    planned: list[Cell] = [(one, SHIFTS[name].plan(plan, one, size)) for name, size, one in keys]
    inputs: list[str | Path] = [population, *given_folders(policy_names)]
    command = f"{PROGRAM} shift --policy {shlex.join(policy_names)} --population {shlex.quote(population)}"
    command += f" --shifts {' '.join(shifts)}" if shifts else ""
    command += f" --patients {patients} --seed {seed} --env {environment}"
    with Outputs("shift", folder=out, inputs=inputs, overwrite=overwrite) as outputs:
        episodes = run_cells(measured_episodes, planned, out, workers, address)
        rows = _rows(keys, episodes, plan)
        write_text(out / "shift.csv", _numbers(rows, patients, command))
        write_text(out / "shift.md", _text(rows, plan, command))
        whom = f"{counted(patients, 'patient')} of '{plan.title}'"
        draw_panels(out / "shift.png", _panels(rows, used), whom, [FAULTS])
        forget(out)
    print(f"written: {outputs.where(out)} (shift.csv, shift.md, shift.png)")
    return FAILED_RUN if outputs.failed else 0


def _check(policy_names: Sequence[str], shifts: Sequence[str]) -> None:
    """Refuse a run of no policy, and names that are no shifts or stand there twice."""
    if not policy_names:
        raise InputError("--policy: expected one or more names.")
    for name in shifts:
        if name not in SHIFTS or shifts.count(name) > 1:
            raise InputError(f"--shifts {name}: expected different ones of {choices(SHIFTS)}.")


def _rows(
    keys: Sequence[tuple[str, float, Policy]], episodes: Sequence[list[dict[str, Any]]], plan: Plan
) -> list[Row]:  # fmt: skip
    """The figures of each cell; opponent and oracle are those under the same shift."""
    found = {(name, size, one.name): those for (name, size, one), those in zip(keys, episodes, strict=True)}
    rows = []
    for name, size, one in keys:
        opponent, oracle = (found[name, size, other] for other in (opponent_of(one), oracle_name()))
        rows.append((name, size, one, key_figures(found[name, size, one.name], opponent, oracle, plan.seed)))
    return rows


def _numbers(rows: Sequence[Row], patients: int, command: str) -> str:
    """A row a shift, size and policy, below a line with the command."""
    records = [
        {"shift": name, "size": f"{size:g}", "policy": one.name, "patients": patients, **columns(found)}
        for name, size, one, found in rows
    ]
    return records_text(records, command)


def _text(rows: Sequence[Row], plan: Plan, command: str) -> str:
    """Markdown with a table a shift."""
    lines = [
        "# Shifts away from training", "", printable(f"{counted(plan.patients, 'patient')} of '{plan.title}', seed "
        f"{plan.seed}, in {plan.id}. {MEANS} {FAULTS}"), "", f"`{printable(command)}`", "",
    ]  # fmt: skip
    for name in dict.fromkeys(row[0] for row in rows):
        heads = ["size", "policy", *(HEADS[figure] for figure in FIGURES)]
        lines += [f"## {name}: {SHIFTS[name].label}", "", f"| {' | '.join(heads)} |", f"|{'---|' * len(heads)}"]
        for other, size, one, found in rows:
            if other == name:
                cells_of = [f"{size:g}", one.name, *cells(found)]
                lines.append(f"| {' | '.join(markdown_cell(x) for x in cells_of)} |")
        lines.append("")
    return "\n".join([*lines, "![Return over the size of each shift](shift.png)", ""])


def _panels(rows: Sequence[Row], policies: Sequence[Policy]) -> list[tuple[str, str, list[Curve]]]:
    """A panel a shift, a line a policy: the return over the size."""
    titles, panels = line_titles(policies), []
    for name in dict.fromkeys(row[0] for row in rows):
        points: dict[str, list[tuple[float, Mapping[str, Any]]]] = {}
        for other, size, one, found in rows:
            if other == name:
                points.setdefault(one.name, []).append((size, found["return"]))
        panels.append(
            (SHIFTS[name].label, "return of an episode [-]", [Curve(titles[n], x) for n, x in points.items()])
        )
    return panels
