"""Commands that show: a picture, a film, a report."""
