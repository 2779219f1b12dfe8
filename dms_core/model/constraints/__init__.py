"""Constraints (paper sect. 3.2): intrabody and interbody equations phi = 0."""
