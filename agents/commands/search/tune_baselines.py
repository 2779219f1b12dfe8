"""python -m agents tune-baselines: numbers of the baselines for the training population."""

from __future__ import annotations

import shlex
from collections.abc import Mapping, Sequence
from typing import Any

from dms_core.command_line import FAILED_RUN, FolderOut
from dms_core.errors import printable
from dms_core.files.config_files import configs
from dms_core.files.output_file import write_text
from dms_core.files.outputs import OutputFile, Outputs

from ...environment import ENVIRONMENT, PROGRAM, hides_plan
from ...evaluation.comparison.opponents import RETURNS
from ...evaluation.search.tries import KeptTries, Try, beside, table
from ...evaluation.search.tuning import POPULATION, tunable, tune, untuned
from ...policies.tuned import FILE, HIDDEN_INTENT
from ..options import EnvironmentId, device_settings
from .kept_search import kept_search


def tune_baselines(
    tries: int = 48,
    population: str = POPULATION,
    patients: int = 30,
    seed: int = 0,
    repetitions: int = 1,
    workers: int = 1,
    address: str | None = None,
    out: FolderOut | None = None,
    environment: EnvironmentId = ENVIRONMENT,
    exoskeleton: str | None = None,
    overwrite: bool = False,
) -> int:
    """Search the baselines' numbers for the best mean return on the training population.

    Tries are kept in the file ..._tries.partial.csv as they are done. After a stop the same command goes on from there.

    Args:
        tries: of each policy, half of them spread over its ranges and half around the best.
        population: to train on, by name or YAML file.
        patients: episodes of each try.
        seed: of the patients and of the search.
        repetitions: of the movement in an episode.
        workers: processes.
        address: of a Ray cluster that does the tries, or 'local' for one of this machine; processes where not given.
        out: folder of the numbers, which the policies read, and of the table of tries; default: where they read it.
        environment: in which, by id; its policies are tuned.
        exoskeleton: device by name or YAML file, or changes of the default one as JSON.
        overwrite: replace files of these names.
    """
    found = configs() / (HIDDEN_INTENT if hides_plan(environment) else FILE)
    best = (found.parent if out is None else out) / found.name
    every = best.with_name(f"{best.stem}_tries.csv")
    common = {"population": population, "environment": environment, "repetitions": repetitions}
    common |= device_settings(exoskeleton)
    command = f"{PROGRAM} tune-baselines --tries {tries} --patients {patients} --seed {seed}"
    command += _further(population, repetitions, environment, exoskeleton)
    files = [OutputFile("--out", best), OutputFile("--out", every)]
    with Outputs("tune-baselines", files=files, inputs=[population, exoskeleton], overwrite=overwrite) as outputs:
        kept = KeptTries(beside(every), f"{command}; means over the patients")
        best_first, others = _searched(kept, tries, patients, seed, workers, address, common)
        write_text(best, _yaml(best_first, others, population, command, every.name))
        write_text(every, table(best_first, kept.command))
        kept.remove()
    for name, ranked in best_first.items():
        print(f"{name:20} return {ranked[0].measures['return']:.1f}  {ranked[0].numbers}")
    for name, returned in others.items():
        print(f"{name:20} return {returned:.1f}")
    print(f"written: {outputs.moved or best.parent}")
    return FAILED_RUN if outputs.failed else 0


def _searched(
    kept: KeptTries, tries: int, patients: int, seed: int, workers: int, address: str | None, common: dict[str, Any]
) -> tuple[dict[str, list[Try]], dict[str, float]]:
    """Tries of each policy, best first; where the plan is hidden, mean returns of who has nothing to tune, too."""
    names, best_first = tunable(common["environment"]), dict[str, list[Try]]()
    with kept_search(kept, len(names) * tries, workers, address) as (share_out, progress):
        for name in names:
            known = list(kept.done.get(name, ()))
            best_first[name] = tune(
                name, tries, patients, seed, share_out=share_out, known=known, progress=progress, **common
            )
        return best_first, untuned(patients, seed, **common) if hides_plan(common["environment"]) else {}


def _further(population: str, repetitions: int, environment: str, exoskeleton: str | None) -> str:
    """Options that are not the usual ones, as they are typed."""
    options = f" --population {shlex.quote(population)}" if population != POPULATION else ""
    options += f" --repetitions {repetitions}" if repetitions > 1 else ""
    options += f" --env {environment}" if environment != ENVIRONMENT else ""
    return options + (f" --exoskeleton {shlex.quote(exoskeleton)}" if exoskeleton else "")


def _yaml(
    tries: Mapping[str, Sequence[Try]], others: Mapping[str, float], population: str, command: str, every: str
) -> str:
    """Best numbers of each policy, with where they are from; where opponents are chosen, the returns of all, too."""
    lines = [
        f"# Numbers of the baselines with the best mean return on '{printable(population)}', found by",
        f"#   {printable(command)}",
        f"# All tries stand in {every}.",
    ]
    for name, ranked in tries.items():
        lines.append(f"{name}:")
        lines += [f"  {key}: {value}" for key, value in ranked[0].numbers.items()]
    if others:
        returns = {**others, **{name: ranked[0].measures["return"] for name, ranked in tries.items()}}
        lines += ["# Mean return on these patients, by which opponents and the oracle are chosen.", f"{RETURNS}:"]
        lines += [f"  {name}: {returned:.4f}" for name, returned in sorted(returns.items(), key=lambda x: -x[1])]
    return "\n".join(lines) + "\n"
