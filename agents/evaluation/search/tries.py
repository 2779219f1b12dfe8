"""Tries of a search, and the table that they stand in: a row a try, below a line with the command that made them."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from dms_core.errors import InputError, printable
from dms_core.files.input_file import decoded, read_bytes
from dms_core.files.json_text import brief
from dms_core.files.output_place import check_kind, put

EXACT, SHORT = ".17g", ".4g"
"""Formats of measures: all digits, and those for readers."""
MOST_TABLE = 64 << 20
"""Size up to which a table is read [byte]."""


@dataclass(frozen=True)
class Try:
    """Numbers of a policy, and some measures with them."""

    policy: str
    numbers: dict[str, float]
    measures: dict[str, float]


def table(tries: Mapping[str, Sequence[Try]], command: str, digits: str = SHORT) -> str:
    """Tries of each policy as CSV.

    Args:
        tries: by policy, in the order of the rows; measures that not all of them have are left out.
        command: that made them.
        digits: format of the measures.
    """
    text = io.StringIO()
    text.write(f"# {printable(command)}\n")
    rows = csv.writer(text, lineterminator="\n")
    everyone = [one for ones in tries.values() for one in ones]
    known = [m for m in (everyone[0].measures if everyone else ()) if all(m in one.measures for one in everyone)]
    rows.writerow(["policy", *known, "numbers"])
    for one in everyone:
        numbers = " ".join(f"{key}={value:g}" for key, value in one.numbers.items())
        rows.writerow([one.policy, *(format(one.measures[m], digits) for m in known), numbers])
    return text.getvalue()


def read_table(path: Path) -> tuple[str, list[Try]]:
    """The command of a table, and its tries.

    Raises:
        InputError: the file is none.
    """
    first, _, rest = decoded(path, read_bytes(path, MOST_TABLE)).partition("\n")
    rows = list(csv.reader(io.StringIO(rest)))
    try:
        (_, *names, _), *rows = rows
        tries = [
            Try(name, {k: float(x) for k, x in (pair.split("=") for pair in numbers.split())},
                dict(zip(names, map(float, measured), strict=True)))
            for name, *measured, numbers in rows
        ]  # fmt: skip
    except ValueError as error:
        raise InputError(f"file '{path}' is no table of tries: {brief(str(error), 100)}.") from None
    return first.removeprefix("# "), tries


class KeptTries:
    """Tries in a file that is whole at any time, so that a search that was killed goes on from there.

    Args:
        path: of the file.
        command: that does the tries.

    Raises:
        InputError: the file holds tries of another command, or is none.
    """

    def __init__(self, path: Path, command: str) -> None:
        self.path, self.command = path, command
        self.done: dict[str, list[Try]] = {}
        """By policy."""
        if path.exists():
            before, tries = read_table(path)
            if before != printable(command):
                raise InputError(
                    f"'{path}' holds tries of another command: {brief(before, 300)}. Go on with that one, or remove "
                    "the file."
                )
            for one in tries:
                self.done.setdefault(one.policy, []).append(one)

    @property
    def count(self) -> int:
        """Number of tries."""
        return sum(map(len, self.done.values()))

    def add(self, one: Try) -> None:
        """Keep one more.

        Raises:
            OSError: the disk is full or cannot be written; what was there before is still there.
        """
        self.done.setdefault(one.policy, []).append(one)
        content = table(self.done, self.command, EXACT).encode()
        put(check_kind(self.path), lambda file: file.write(content))

    def remove(self) -> None:
        """Remove the file, whose tries stand elsewhere now."""
        self.path.unlink(missing_ok=True)


def beside(path: Path) -> Path:
    """File for the tries of a table that is not done yet, run.partial.csv for run.csv."""
    return path.with_name(f"{path.stem}.partial{path.suffix}")
