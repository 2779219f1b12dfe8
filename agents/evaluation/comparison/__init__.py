"""Policies on the same patients: their opponents, the gap they close, and the statistics of few runs."""
