"""Settings of a training: a file in rl_zoo3's format, and what of it may change when the training goes on."""
