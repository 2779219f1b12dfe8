"""How a patient's intention becomes excitations: command, prediction, effort, fatigue, slacking, stretch reflex."""
