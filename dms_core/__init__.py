"""dms_core."""
