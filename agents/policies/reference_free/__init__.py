"""Policies that are told no reference, and those that stand for what knowing it is worth."""
