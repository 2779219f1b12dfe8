"""Filters: what is estimated, its charts, prediction, correction; in Python and compiled."""
