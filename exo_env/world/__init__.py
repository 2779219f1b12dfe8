"""One world or many: the arrays of an episode, a control period, a reset, the batch."""
