"""Tasks: what is observed, rewarded and ended, and along which movement (contract: task.py)."""
