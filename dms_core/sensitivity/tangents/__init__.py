"""Tangents of one step: through each stage, in all coordinates and in independent ones."""
