"""Policies on the same patients: measures, statistics, tables, figures, and what could be reached at most."""
