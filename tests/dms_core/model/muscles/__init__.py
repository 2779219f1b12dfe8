"""Tests of dms_core.model.muscles."""
