"""What the command lines of both packages share: exit statuses, the progress bar, errors as one message."""

from __future__ import annotations

import contextlib
import io
import os
import shutil
import signal
import sys
import threading
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Annotated, Any

import tyro
from tqdm import tqdm
from tyro.constructors import PrimitiveConstructorSpec

from dms_core.errors import DmsError, InputError, ModelWarning
from dms_core.files.output_place import REMEDIES

USER_MISTAKE, FAILED_RUN, STOPPED = 2, 1, 130
"""Exit statuses."""


def _place(kind: str, metavar: str) -> PrimitiveConstructorSpec[Path]:
    """How an option is read that says where to write."""

    def read(given: list[str]) -> Path:
        (text,) = given
        if not text or "\0" in text:
            raise InputError(f"Expected the name of a {kind}, got {text!r}.")
        if text == "-":
            raise InputError(f"Expected the name of a {kind}, got '-'; standard output is /dev/stdout.")
        if kind == "file" and text.endswith(("/", os.sep)):
            raise InputError(f"Expected the name of a file, got that of a folder, '{text}'.")
        return Path(text)

    return PrimitiveConstructorSpec(1, metavar, read, lambda x: isinstance(x, Path), lambda x: [str(x)])


FileOut = Annotated[Path, _place("file", "FILE")]
"""Option that names a file to write."""
FolderOut = Annotated[Path, _place("folder", "DIR")]
"""Option that names a folder to write into."""
NARROWEST = 40
"""Columns of the narrowest terminal that help is written for."""
LONG_RUN = 2.0
"""Seconds after which a run shows a progress bar."""
BAR = "{percentage:3.0f}% |{bar}| {n:.3g} of {total:.3g} s simulated, {elapsed} passed, {remaining} left"


def bar_of_run(seconds: float) -> tqdm:
    """A bar over simulated time that appears on long runs only."""
    return tqdm(total=seconds, unit="s", delay=LONG_RUN, leave=False, disable=None, bar_format=BAR)


def moves(bar: tqdm, before: float = 0.0) -> Callable[[float], None]:
    """Progress callback that moves the bar to `before` plus the time reached [s]."""

    def progress(t: float) -> None:
        bar.update(before + t - bar.n)

    return progress


def run_command(
    commands: dict[str, Callable[..., Any]], prog: str, description: str, arguments: list[str] | None
) -> int:
    """Run one of the commands; a mistake of the user is one message on stderr and status 2."""
    _open_streams()
    _widen()
    try:
        _check_current_folder()
        _check_options(sys.argv[1:] if arguments is None else arguments)
        with _sentences_of_warnings(), _terminated_as_interrupted():
            status = tyro.extras.subcommand_cli_from_dict(commands, prog=prog, description=description, args=arguments)
        sys.stdout.flush()
        return status
    except DmsError as error:
        print(f"error: {error}", file=sys.stderr)
        return USER_MISTAKE
    except KeyboardInterrupt as stop:
        print(f"stopped: {str(stop) or 'nothing was written.'}", file=sys.stderr)
        return STOPPED
    except BrokenPipeError:
        # The reader (head, less) has seen enough.
        _close_stdout()
        return 0
    except OSError as error:
        # Files are written under their names; what has none is printed.
        where = f"'{error.filename}'" if error.filename is not None else "standard output"
        advice = f"; {REMEDIES[error.errno]}" if error.errno in REMEDIES else ""
        print(f"error: {where}: {error.strerror or error}{advice}.", file=sys.stderr)
        _check_stdout()
        return FAILED_RUN


def _open_streams() -> None:
    """What is closed goes nowhere; what the terminal's encoding has no sign for is replaced, as stderr does it."""
    for name in ("stdout", "stderr"):
        stream = getattr(sys, name)
        if stream is None:
            setattr(sys, name, open(os.devnull, "w", encoding="utf-8"))  # noqa: SIM115
        elif name == "stdout" and isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")


def _check_current_folder() -> None:
    """Refuse to run where the current folder is gone: no relative path means anything there."""
    try:
        os.getcwd()
    except FileNotFoundError:
        raise InputError("the current folder was deleted; change to another one.") from None


def _widen() -> None:
    """Write help for a terminal of some width; tyro does not come to an end in one of a few columns."""
    if shutil.get_terminal_size().columns < NARROWEST:
        os.environ["COLUMNS"] = str(NARROWEST)


def _check_stdout() -> None:
    """Close standard output if what was printed cannot be written."""
    try:
        sys.stdout.flush()
    except OSError:
        _close_stdout()


def _close_stdout() -> None:
    """What is left to flush at exit goes nowhere: it cannot be written, and must not complain again."""
    with contextlib.suppress(OSError, ValueError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


@contextlib.contextmanager
def _terminated_as_interrupted() -> Iterator[None]:
    """Within, SIGTERM stops as Ctrl-C does: what is done is kept, and nothing half written is left."""
    main = threading.current_thread() is threading.main_thread()
    if not main or signal.getsignal(signal.SIGTERM) != signal.SIG_DFL:
        yield
        return

    def stop(number: int, frame: Any) -> None:
        raise KeyboardInterrupt

    signal.signal(signal.SIGTERM, stop)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, signal.SIG_DFL)


@contextlib.contextmanager
def _sentences_of_warnings() -> Iterator[None]:
    """Within, a ModelWarning is one sentence on stderr, without a line of Python."""
    usual = warnings.showwarning

    def show(
        message: Warning | str, category: type[Warning], filename: str, lineno: int, file: Any = None, line: Any = None
    ) -> None:
        if issubclass(category, ModelWarning):
            print(f"warning: {message}", file=sys.stderr)
        else:
            usual(message, category, filename, lineno, file, line)

    with warnings.catch_warnings():
        warnings.showwarning = show
        yield


def _check_options(arguments: list[str]) -> None:
    """Refuses an option that stands twice, of which only the last one would count."""
    given = arguments[: arguments.index("--")] if "--" in arguments else arguments
    options = [a.partition("=")[0].replace("_", "-") for a in given if a.startswith("--")]
    for option in options:
        count = options.count(option)
        if count > 1:
            raise InputError(f"{option} stands {count} times; write it once, with all its values behind.")
