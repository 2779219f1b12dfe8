"""How an analysis ends on the command line: what it prints, and its exit status."""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from dms_core.command_line import FAILED_RUN
from dms_core.files.output_place import descriptor
from dms_core.files.outputs import OutputFile, Outputs


def output_files(**files: Path | None) -> list[OutputFile]:
    """Those of the options that are given, by name of the option."""
    return [OutputFile(f"--{name.replace('_', '-')}", path) for name, path in files.items() if path is not None]


def ended(
    outputs: Outputs, out: Path, summary: Mapping[str, Any], sentences: Sequence[str] = (), failure: str = ""
) -> int:
    """Print numbers and sentences, say where the table is; gives the exit status.

    Args:
        outputs: of the command.
        out: its table; where that is standard output, nothing else is printed there.
        summary: numbers and words by name.
        sentences: what there is to say.
        failure: why there is no more in the table; printed on standard error.
    """
    with contextlib.redirect_stdout(sys.stdout if descriptor(out) is None else sys.stderr):
        for key, value in summary.items():
            print(f"{key.replace('_', ' ')}: {f'{value:.6g}' if isinstance(value, float) else value}")
        for sentence in sentences:
            print(sentence)
        print(f"written: {outputs.where(out)}")
    if failure:
        print(f"The analysis failed: {failure} '{outputs.where(out)}' holds the part before.", file=sys.stderr)
        return FAILED_RUN
    return FAILED_RUN if outputs.failed else 0


def gave_up(error: Exception) -> int:
    """Say why there is no result; gives the exit status."""
    print(f"The analysis failed: {error}", file=sys.stderr)
    return FAILED_RUN
