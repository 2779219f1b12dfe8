"""Policies for exo/ElbowLift-v0 and their evaluation. Beside the package, not in it; see `python -m agents --help`."""
