"""Studies of policies beyond one population: patients, loads and sensors that shift, and a patient who is new."""
