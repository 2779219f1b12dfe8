"""Training with Stable-Baselines3: configuration, algorithms, folders that survive a kill."""
