"""What an evaluation leaves: its file, and tables of it."""
