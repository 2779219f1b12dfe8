"""Random closed mechanisms that can move: what the solver is stressed with."""
