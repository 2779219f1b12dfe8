"""Force elements that act about a joint's axis."""
