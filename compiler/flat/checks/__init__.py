"""What is told of a whole model that is right as it stands: oversights, cycles, what nothing uses."""
