"""What a patient intends to do: the contract of a movement (movement.py), repetitions, and changing intentions."""
