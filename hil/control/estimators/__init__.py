"""Estimators: delayed poses and wheel reports to the state at the actuation time."""
