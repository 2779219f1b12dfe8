"""The methods of integration: BDF2, SDIRK2 and Radau IIA, each with its step and its local error."""
