"""Bodies (paper sect. 3.1): what owns coordinates and inertia."""
