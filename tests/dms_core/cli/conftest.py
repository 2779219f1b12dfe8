"""The command line, called as a function, and places where its outputs find no room."""

from __future__ import annotations

import errno
import os
from pathlib import Path
from typing import NamedTuple

import pytest

from dms_core.__main__ import main
from dms_core.files import output_place


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


@pytest.fixture
def elsewhere(tmp_path, monkeypatch):
    """The folder for temporary files."""
    folder = tmp_path / "temporary"
    folder.mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(folder))
    return folder


@pytest.fixture
def full(tmp_path, monkeypatch):
    """A folder on which there is no room for more than 8000 bytes a file, as on a full disk."""
    folder = tmp_path / "full"
    folder.mkdir()
    known = os.fdopen

    def fdopen(handle, *arguments, **options):
        file = known(handle, *arguments, **options)
        if folder in Path(os.readlink(f"/proc/self/fd/{handle}")).parents:
            write = file.write

            class Full:
                def __getattr__(self, name):
                    return getattr(file, name)

                def __enter__(self):
                    return self

                def __exit__(self, *error):
                    file.close()

                def write(self, content):
                    if file.tell() + len(content) > 8000:
                        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
                    return write(content)

            return Full()
        return file

    monkeypatch.setattr(output_place.os, "fdopen", fdopen)
    return folder
