"""The commands of `python -m agents`, one file each."""
