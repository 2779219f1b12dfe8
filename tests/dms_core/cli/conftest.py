"""The command line, called as a function."""

from __future__ import annotations

from typing import NamedTuple

import pytest

from dms_core.__main__ import main


class Outcome(NamedTuple):
    """What a command gave back."""

    status: int
    out: str
    err: str


@pytest.fixture
def command(capsys):
    """Function that runs one command and gives status, standard output and standard error."""

    def call(*arguments: object) -> Outcome:
        try:
            status = main([str(a) for a in arguments])
        except SystemExit as end:  # help, and arguments that cannot be read
            status = end.code
        return Outcome(status, *capsys.readouterr())

    return call
