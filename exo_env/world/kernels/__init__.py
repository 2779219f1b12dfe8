"""The compiled functions of one world: a reset, a control period, a change of load, and the numbers they go by."""
