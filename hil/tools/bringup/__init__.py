"""Bring-up: a rig with its wheels off the ground, checked piece by piece, its robot measured."""
