"""`python -m agents adaptation`: how fast policies get used to a patient, window by window, and their regret."""

from __future__ import annotations

import shlex
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path

from dms_core.command_line import FAILED_RUN, FolderOut
from dms_core.errors import InputError, counted, printable
from dms_core.figures import require_matplotlib
from dms_core.files.output_file import markdown_cell, write_text
from dms_core.files.outputs import Outputs

from ...environment import PROGRAM
from ...evaluation.comparison.evaluate import Plan
from ...evaluation.comparison.opponents import with_opponents
from ...evaluation.figures.line_figures import Curve, draw_panels, line_titles
from ...evaluation.results.tables import cell, records_text
from ...evaluation.sharing.kept_shares import forget
from ...evaluation.studies.adaptation import Adaptation, best_of, hindsight_set, window_returns, windows_of
from ...evaluation.studies.adaptation import adaptation as adapted
from ...policies.policy import Policy
from ..options import EnvironmentId, PolicyNames, check_hides_plan, different_policies, given_folders
from .kept_cells import run_cells

USUAL = "exo/NewPatient-v0"


def adaptation(
    policy_names: PolicyNames,
    out: FolderOut,
    population: str = "evaluation",
    patients: int = 40,
    tries: int = 1,
    seed: int = 1,
    workers: int = 1,
    address: str | None = None,
    environment: EnvironmentId = USUAL,
    overwrite: bool = False,
) -> int:
    """Run policies with new patients: return and regret of each window in adaptation.csv, .md and .png.

    The best classical policy with the same sensors and the oracle take part, too. Episodes are kept beside the folder
    as they are done. After a stop the same command goes on from there.

    Args:
        policy_names: names of the command `policies`, folders of trained ones, or module:Class.
        out: folder for the results; made where it is missing.
        population: of the patients, by name or YAML file.
        patients: how many.
        tries: numbers of each classical policy among which hindsight picks, the tuned ones first.
        seed: of the patients, of the tries and of the bootstrap.
        workers: processes.
        address: of a Ray cluster that does the episodes, or 'local' for one of this machine; processes where not given.
        environment: in which, by id; one whose task hides the patient's plan, with several windows in an episode.
        overwrite: replace files in the folder that others wrote or changed.
    """
    if not policy_names or tries < 1:
        raise InputError("expected one or more names with --policy, and --tries from 1.")
    check_hides_plan(environment, USUAL)
    windows = windows_of(environment)
    require_matplotlib()
    used = with_opponents(different_policies(policy_names, environment), environment)
    plan, behind = Plan(population, patients, seed, (), environment), hindsight_set(environment, tries, seed)
    inputs: list[str | Path] = [population, *given_folders(policy_names)]
    command = f"{PROGRAM} adaptation --policy {shlex.join(policy_names)} --population {shlex.quote(population)}"
    command += f" --patients {patients} --tries {tries} --seed {seed} --env {environment}"
    with Outputs("adaptation", folder=out, inputs=inputs, overwrite=overwrite) as outputs:
        everyone = [*used, *behind]
        done = run_cells(window_returns, [(one, plan) for one in everyone], out, workers, address)
        best = best_of([those for one, those in zip(everyone, done, strict=True) if not one.informed])
        found = {one.name: adapted(those, best, seed) for one, those in zip(used, done, strict=False)}
        write_text(out / "adaptation.csv", _numbers(found, patients, command))
        write_text(out / "adaptation.md", _text(found, plan, len(behind), windows, command))
        whom = f"{counted(patients, 'patient')} of '{plan.title}'"
        draw_panels(out / "adaptation.png", _panels(found, used), whom)
        forget(out)
    print("\n".join(_lines(found)))
    print(f"written: {outputs.where(out)} (adaptation.csv, adaptation.md, adaptation.png)")
    return FAILED_RUN if outputs.failed else 0


def _lines(found: Mapping[str, Adaptation]) -> list[str]:
    """What is printed: a line a policy."""
    return [
        f"{name:20} windows to nine tenths of the last return: {cell(one.return_windows)}, return of "
        f"the last: {cell(one.returns[-1])}, its regret: {cell(one.regrets[-1])}"
        for name, one in found.items()
    ]


def _numbers(found: Mapping[str, Adaptation], patients: int, command: str) -> str:
    """A row a policy and window, below a line with the command."""
    ends = [f"{name}{end}" for name in ("return", "regret") for end in ("", "_low", "_high")]
    records = []
    for name, one in found.items():
        for k, (returned, regret) in enumerate(zip(one.returns, one.regrets, strict=True), 1):
            numbers = [f"{x:.5g}" for e in (returned, regret) for x in (e.value, e.low, e.high)]
            records.append({"policy": name, "patients": patients, "window": k, **dict(zip(ends, numbers, strict=True))})
    return records_text(records, command)


def _text(found: Mapping[str, Adaptation], plan: Plan, tried: int, windows: int, command: str) -> str:
    """Markdown: return of each window, its regret, and a row a policy with what it needs."""
    heads = ["policy", *(f"window {k + 1}" for k in range(windows))]
    lines = [
        "# A new patient", "", printable(
            f"{counted(plan.patients, 'patient')} of '{plan.title}', seed {plan.seed}, in {plan.id}. Means over the "
            "patients [95 % bootstrap interval]. An episode that an event ended gives 0 for the windows that are left. "
            f"Regret: to the best of {tried} sets of numbers of the classical policies and of the policies "
            "below that are not told the plan, picked with hindsight for each patient and window."
        ), "", f"`{printable(command)}`", "",
    ]  # fmt: skip
    for title, kind in (("Return", "returns"), ("Regret", "regrets")):
        lines += [f"## {title} of each window", "", f"| {' | '.join(heads)} |", f"|{'---|' * len(heads)}"]
        for name, one in found.items():
            texts = [name, *(cell(e) for e in getattr(one, kind))]
            lines.append(f"| {' | '.join(markdown_cell(x) for x in texts)} |")
        lines.append("")
    lines += ["## Windows that a policy needs", "",
              "| policy | to nine tenths of the last return | until the regret has come nine tenths of its way to the "
              "last | unsafe episodes |", "|---|---|---|---|"]  # fmt: skip
    for name, one in found.items():
        texts = [name, *(cell(e) for e in (one.return_windows, one.regret_windows, one.unsafe))]
        lines.append(f"| {' | '.join(markdown_cell(x) for x in texts)} |")
    return "\n".join([*lines, "", "![Return and regret over the windows](adaptation.png)", ""])


def _panels(found: Mapping[str, Adaptation], policies: Sequence[Policy]) -> list[tuple[str, str, list[Curve]]]:
    """Two panels over the windows, a line a policy."""
    titles, panels = line_titles(policies), []
    for label, kind in (("return of a window [-]", "returns"), ("regret of a window [-]", "regrets")):
        curves = [
            Curve(titles[name], [(float(k), asdict(e)) for k, e in enumerate(getattr(one, kind), 1)])
            for name, one in found.items()
        ]
        panels.append(("window with the same patient", label, curves))
    return panels
