"""The environments, one file an id, and what all of them share."""
