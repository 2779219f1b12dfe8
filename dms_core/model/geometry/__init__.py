"""Geometry that several elements share; it knows no force."""
