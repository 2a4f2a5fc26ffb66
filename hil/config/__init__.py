"""Typed, bounded sections of scenario, robot and gain files."""
