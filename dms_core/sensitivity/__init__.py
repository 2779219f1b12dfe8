"""Derivatives of steps and of whole runs: tangents carried forward, adjoints carried back (docs/sensitivities.md)."""
