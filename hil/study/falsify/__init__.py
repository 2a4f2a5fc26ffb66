"""Searching for the run that most violates a requirement (docs/verdict.md)."""
