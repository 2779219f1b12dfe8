"""python -m agents tune-baselines: numbers of the baselines for the training population."""

from __future__ import annotations

import contextlib
import csv
import io
import shlex
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated

from tqdm import tqdm
from tyro.conf import arg

from dms_core.command_line import FAILED_RUN, FolderOut
from dms_core.config_files import configs
from dms_core.errors import Stopped, printable
from dms_core.files.output_file import write_text
from dms_core.files.outputs import OutputFile, Outputs, partial

from ..environment import ENVIRONMENT, PROGRAM
from ..evaluation.tuning import MEASURED, POPULATION, Try, tunable, tune
from ..policies.tuned import FILE
from .options import device_settings

TRIES = "baselines_tries.csv"


def tune_baselines(
    tries: int = 48,
    population: str = POPULATION,
    patients: int = 30,
    seed: int = 0,
    repetitions: int = 1,
    workers: int = 1,
    out: FolderOut | None = None,
    environment: Annotated[str, arg(name="env", metavar="ID")] = ENVIRONMENT,
    exoskeleton: str | None = None,
    overwrite: bool = False,
) -> int:
    """Search the baselines' numbers for the best mean return on the training population.

    Args:
        tries: of each policy, half of them spread over its ranges and half around the best.
        population: to train on, by name or YAML file.
        patients: episodes of each try.
        seed: of the patients and of the search.
        repetitions: of the movement in an episode.
        workers: processes.
        out: folder of baselines.yml, which the policies read, and of the table of tries; default: where they read it.
        environment: in which, by id.
        exoskeleton: device by name or YAML file, or changes of the default one as JSON.
        overwrite: replace files of these names.
    """
    folder = (configs() / FILE).parent if out is None else out
    best, table = folder / Path(FILE).name, folder / TRIES
    settings = device_settings(exoskeleton)
    command = f"{PROGRAM} tune-baselines --tries {tries} --patients {patients} --seed {seed}"
    command += _further(population, repetitions, environment, exoskeleton)
    best_first: dict[str, list[Try]] = {}
    files = [OutputFile("--out", best), OutputFile("--out", table)]
    with Outputs("tune-baselines", files=files, inputs=[population, exoskeleton], overwrite=overwrite) as outputs:
        tried = _Tried(tries, table, command)
        with tried.kept_when_stopped(outputs):
            for name in tunable():
                best_first[name] = tune(
                    name, tries, patients, seed, population=population, workers=workers, progress=tried.add,
                    environment=environment, repetitions=repetitions, **settings,
                )  # fmt: skip
        write_text(best, _yaml(best_first, population, command))
        write_text(table, _table(best_first, command))
    for name, ranked in best_first.items():
        print(f"{name:18} return {ranked[0].measures['return']:.1f}  {ranked[0].numbers}")
    print(f"written: {outputs.moved or folder}")
    return FAILED_RUN if outputs.failed else 0


def _further(population: str, repetitions: int, environment: str, exoskeleton: str | None) -> str:
    """Options that are not the usual ones, as they are typed."""
    options = f" --population {shlex.quote(population)}" if population != POPULATION else ""
    options += f" --repetitions {repetitions}" if repetitions > 1 else ""
    options += f" --env {environment}" if environment != ENVIRONMENT else ""
    return options + (f" --exoskeleton {shlex.quote(exoskeleton)}" if exoskeleton else "")


class _Tried:
    """Tries as they are done, with a bar.

    Args:
        tries: of each policy.
        table: file of all tries.
        command: as it stands in the table.
    """

    def __init__(self, tries: int, table: Path, command: str) -> None:
        self.total, self.table, self.command = len(tunable()) * tries, table, command
        self.done: dict[str, list[Try]] = {}
        self.bar = tqdm(total=self.total, unit="try", leave=False, disable=None, file=sys.stderr)

    def add(self, one: Try) -> None:
        """One more."""
        self.done.setdefault(one.policy, []).append(one)
        self.bar.set_description(one.policy)
        self.bar.update()

    @contextlib.contextmanager
    def kept_when_stopped(self, outputs: Outputs) -> Iterator[None]:
        """Within, Ctrl-C writes the tries so far."""
        try:
            with self.bar:
                yield
        except KeyboardInterrupt:
            if not self.done:
                raise
            write_text(part := partial(self.table), _table(self.done, self.command))
            count = sum(map(len, self.done.values()))
            raise Stopped(f"{count} of {self.total} tries are in '{outputs.where(part)}'.") from None


def _yaml(tries: dict[str, list[Try]], population: str, command: str) -> str:
    """Best numbers of each policy, with where they are from."""
    lines = [
        f"# Numbers of the baselines with the best mean return on '{printable(population)}', found by",
        f"#   {printable(command)}",
        f"# All tries stand in {TRIES}.",
    ]
    for name, ranked in tries.items():
        lines.append(f"{name}:")
        lines += [f"  {key}: {value}" for key, value in ranked[0].numbers.items()]
    return "\n".join(lines) + "\n"


def _table(tries: dict[str, list[Try]], command: str) -> str:
    """All tries, best first."""
    text = io.StringIO()
    text.write(f"# {printable(command)}; means over the patients\n")
    rows = csv.writer(text, lineterminator="\n")
    known = [m for m in MEASURED if all(m in one.measures for ranked in tries.values() for one in ranked)]
    rows.writerow(["policy", *known, "numbers"])
    for name, ranked in tries.items():
        for one in ranked:
            numbers = " ".join(f"{key}={value:g}" for key, value in one.numbers.items())
            rows.writerow([name, *(f"{one.measures[m]:.4g}" for m in known), numbers])
    return text.getvalue()
