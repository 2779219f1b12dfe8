"""One episode of a world: who is in the device, what is read of it, and an episode that is put by."""
