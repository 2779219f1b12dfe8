"""The sparse patterns of a system: what is eliminated, in which order, and what reads what."""
