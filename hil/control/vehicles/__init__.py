"""Vehicles: what is known of a robot's wheels, on the host and on the simulated floor."""
