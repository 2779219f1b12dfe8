"""`python -m agents hindsight`: the best of each family of policies for each patient, with hindsight."""

from __future__ import annotations

import shlex
from collections.abc import Mapping, Sequence

from dms_core.command_line import FAILED_RUN, FileOut
from dms_core.errors import counted
from dms_core.files.output_file import write_text
from dms_core.files.outputs import OutputFile, Outputs

from ...environment import HIDDEN_PLAN, PROGRAM
from ...evaluation.results.tables import records_text
from ...evaluation.search.hindsight import hindsight as tried
from ...evaluation.search.hindsight import summed_up, tuned_difference
from ...evaluation.search.tries import KeptTries, Try, beside
from ...evaluation.search.tuning import tunable
from ..options import EnvironmentId, check_hides_plan
from .kept_search import kept_search

CLOCK, ANGLE = "mean_clock", "mean_angle"
"""Policies whose difference says what a clock is worth."""


def hindsight(
    out: FileOut,
    population: str = "evaluation",
    patients: int = 40,
    tries: int = 200,
    seed: int = 0,
    workers: int = 1,
    address: str | None = None,
    environment: EnvironmentId = HIDDEN_PLAN,
    overwrite: bool = False,
) -> int:
    """Try many numbers of each classical policy on each patient, and write what the best of them reach.

    Tries are kept beside the output as they are done. After a stop the same command goes on from there.

    Args:
        out: CSV file, a row for each policy and patient.
        population: of the patients, by name or YAML file.
        patients: how many.
        tries: of each policy, the tuned numbers among them.
        seed: of the patients and of the tries.
        workers: processes.
        address: of a Ray cluster that does the tries, or 'local' for one of this machine; processes where not given.
        environment: in which, by id; one whose task hides the patient's plan.
        overwrite: replace a file of this name.
    """
    check_hides_plan(environment, HIDDEN_PLAN)
    command = f"{PROGRAM} hindsight --population {shlex.quote(population)} --patients {patients} --tries {tries}"
    command += f" --seed {seed} --env {environment}"
    done: dict[str, list[Try]] = {}
    with Outputs("hindsight", files=[OutputFile("--out", out)], inputs=[population], overwrite=overwrite) as outputs:
        kept, names = KeptTries(beside(out), command), tunable(environment)
        with kept_search(kept, len(names) * tries, workers, address) as (share_out, progress):
            for name in names:
                done[name] = tried(
                    name, tries, patients, seed, population=population, environment=environment,
                    share_out=share_out, known=list(kept.done.get(name, ())), progress=progress,
                )  # fmt: skip
        write_text(out, _table(done, command))
        kept.remove()
    print(f"{counted(patients, 'patient')} of '{population}', {tries} tries each; mean return [95 % interval]")
    print("\n".join(_lines(done, seed)))
    print(f"written: {outputs.where(out)}")
    return FAILED_RUN if outputs.failed else 0


def _lines(done: Mapping[str, Sequence[Try]], seed: int) -> list[str]:
    """What is printed: a line a policy, and what a clock is worth."""
    lines = [f"{'':22}{'tuned':>24}{'with hindsight':>24}{'gain':>24}"]
    for row in summed_up(done, seed):
        cells = "".join(f"{_cell(row[key]):>24}" for key in ("tuned", "hindsight", "gain"))
        lines.append(f"{row['policy']:22}{cells}")
    worth = tuned_difference(done[CLOCK], done[ANGLE], seed)
    return [*lines, f"{CLOCK} - {ANGLE}, tuned, patient by patient: {_cell(worth)}"]


def _cell(estimate: Mapping[str, float]) -> str:
    return f"{estimate['value']:.1f} [{estimate['low']:.1f}, {estimate['high']:.1f}]"


def _table(done: Mapping[str, Sequence[Try]], command: str) -> str:
    """A row for each policy and patient, below a line with the command."""
    records = []
    for name, ones in done.items():
        for seed in ones[0].measures:
            best = max(ones, key=lambda one: one.measures[seed])
            numbers = " ".join(f"{key}={value:g}" for key, value in best.numbers.items())
            tuned, most = (f"{one.measures[seed]:.4g}" for one in (ones[0], best))
            records.append({
                "policy": name, "seed": seed, "tuned_return": tuned, "hindsight_return": most, "numbers": numbers
            })  # fmt: skip
    return records_text(records, command)
