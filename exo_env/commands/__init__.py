"""The commands of `python -m exo_env`, one file each."""
