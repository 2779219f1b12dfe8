"""From a model of Stable-Baselines3 to the numbers of a policy, and back."""
