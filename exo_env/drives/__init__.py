"""Drives: what an action does to the device (contract: drive.py)."""
