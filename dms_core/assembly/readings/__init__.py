"""Sensors of an assembled system, those too that are composed of several elements' loads."""
