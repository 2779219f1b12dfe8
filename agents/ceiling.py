"""The table of what could be reached is now made by a command: `python -m agents upper-bound`."""

from .environment import PROGRAM

SAID = f"'{PROGRAM}.ceiling' is now '{PROGRAM} upper-bound', with the same options."
if __name__ == "__main__":
    raise SystemExit(SAID)
raise ImportError(SAID)
