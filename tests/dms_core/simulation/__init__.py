"""Runs in time: order of the method, events, results."""
