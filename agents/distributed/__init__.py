"""Work shared out by Ray, and the environment for RLlib."""
