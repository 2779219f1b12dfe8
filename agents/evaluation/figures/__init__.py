"""Figures of evaluations, trainings and patients."""
