"""Errors of dms_core: what a user did wrong, which thing it was, and what would be right."""

MOST_CHARACTERS = 4000
"""Length of a message; what it quotes may be of any length."""


def both_ends(text: str, most: int) -> str:
    """A text without its middle where it is longer than `most` characters: what is wrong, and what would be right."""
    return text if len(text) <= most else f"{text[: most // 2]} [...] {text[-most // 2 :]}"


def printable(text: str, kept: str = "") -> str:
    """A text with escapes in place of what is not printed, but for the characters that are kept."""
    if text.isprintable():
        return text
    return "".join(c if c.isprintable() or c in kept else repr(c)[1:-1] for c in text)


class DmsError(Exception):
    """Base of every error that dms_core raises on purpose.

    Of a long message both ends are kept, and what it quotes cannot control a terminal.
    """

    def __init__(self, message: str = "") -> None:
        super().__init__(both_ends(printable(message, kept="\n"), MOST_CHARACTERS))


class ModelError(DmsError, ValueError):
    """A declaration is wrong in itself or does not fit the others.

    Attributes:
        element: name of the element whose declaration it is, "" where it is not known.
    """

    def __init__(self, message: str, element: str = "") -> None:
        super().__init__(message)
        self.element = element


class AssemblyError(DmsError, ValueError):
    """The declared bodies and joints admit no consistent start."""


class InputError(DmsError, ValueError):
    """A value given to an input, a table or an option is not usable."""


class SimulationError(DmsError, RuntimeError):
    """A run failed and the caller asked for an exception instead of a result code."""


class Stopped(KeyboardInterrupt):
    """The user stopped a command (Ctrl-C); the message says what was done and what is kept."""


class ModelWarning(UserWarning):
    """A model that can be run, but is hardly what its author meant."""


MOST_NAMES = 60
"""Names in a message; a file may hold any number of them."""


def choices(names) -> str:
    """A readable list of what would have been right."""
    names = sorted(names)
    if len(names) > MOST_NAMES:
        return f"{', '.join(names[:MOST_NAMES])} and {len(names) - MOST_NAMES} others"
    return ", ".join(names) if names else "none are declared"


def counted(number: int, name: str) -> str:
    """A number of things: '1 patient', '2 patients'."""
    return f"{number} {name}" if number == 1 else f"{number} {name}s"


def extra(name: str) -> str:
    """What to do where a package of an optional extra is missing."""
    return f'Install the extra "{name}"; in a checkout: pip install -c constraints.txt -e ".[{name}]"'
