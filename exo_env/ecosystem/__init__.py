"""Section 4.1 of the paper: person and arm, exoskeleton, gym machine, joined into one system."""
