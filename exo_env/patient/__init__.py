"""Who is assisted: fields and populations, the motor command, effort, fatigue and slacking."""
