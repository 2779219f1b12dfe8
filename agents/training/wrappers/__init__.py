"""Wrappers of the vector environment that only training uses."""
