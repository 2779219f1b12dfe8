"""Tests of dms_core, exo_env and agents; the tree mirrors the packages."""
