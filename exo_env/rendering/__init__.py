"""Pictures of an episode, without GL."""
