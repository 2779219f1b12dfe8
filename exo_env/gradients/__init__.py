"""Gradients through an environment: control periods and whole episodes as functions that torch differentiates.

The world's equations are differentiated as they were solved, step by step (dms_core.sensitivity); drive and patient, a
compiled function each, by central differences of that function on the few numbers it reads (docs/sensitivities.md).
"""
