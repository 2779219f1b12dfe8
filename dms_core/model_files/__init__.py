"""Model files: their reader, their tables and their reference."""
