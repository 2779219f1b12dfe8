"""From a trained model to a folder of numbers that anybody can read."""
