"""What an episode is worth and what ends it: reward terms, and limits of anatomy and safety."""
