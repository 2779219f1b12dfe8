"""Searches: the best numbers of a baseline for a population or a patient, and the most that any schedule reaches."""
