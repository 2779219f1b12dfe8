"""Recordings: files of measurements, the filter along them, the smoother, what they do not tell."""
