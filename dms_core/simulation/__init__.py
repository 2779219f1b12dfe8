"""Initial conditions, Newton, BDF2, step control: solving the compiled system in time (paper sect. 2.3)."""
