"""The head of the vehicle network that tells whether a box shows a vehicle at all."""
