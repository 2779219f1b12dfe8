"""Tests of dms_core.model.ropes, and of what is made of paths."""
