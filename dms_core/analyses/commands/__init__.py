"""The commands static, kinematic, inverse and modes of `python -m dms_core`."""
