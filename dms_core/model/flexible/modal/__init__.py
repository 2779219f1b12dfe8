"""Modal bodies in a floating frame."""
