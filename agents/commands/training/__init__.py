"""Commands that train, once or many times, and give a trained policy away."""
