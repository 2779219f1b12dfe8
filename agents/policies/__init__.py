"""Policies: the contract, the classical ones, and trained ones that run on NumPy."""
