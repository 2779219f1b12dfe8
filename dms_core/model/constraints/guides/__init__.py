"""Guides: a point on a line or a plane of another body."""
