"""Localisers: what finds the robot in one picture. Each is a module of its own."""
