"""What an agent is shown: readings, channels, and how sensors and electrodes spoil them."""
