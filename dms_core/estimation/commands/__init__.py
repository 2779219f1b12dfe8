"""Commands of state estimation."""
