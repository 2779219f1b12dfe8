"""The assembled system: scatter maps, start, composed sensors."""
