"""Episodes: how one is played, what a policy may see of it, and what is measured of it, at its end or over time."""
