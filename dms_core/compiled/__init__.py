"""How compiled code is handed a model: packed arrays, calls by address, machine code kept on disk."""
