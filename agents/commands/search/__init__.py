"""Commands that search: numbers of the baselines, and what could be reached at most."""
