"""The filter in compiled code: its arrays, one period of it, one filter and many side by side."""
