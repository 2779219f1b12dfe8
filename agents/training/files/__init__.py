"""What a training leaves on disk, from which it goes on: its folder, its records, the state of its model."""
