"""Tests of dms_core.model.sensors."""
