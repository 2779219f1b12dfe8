"""Section 4.2 of the paper: scenarios, tuning, figures and statements."""
