"""Figures of a run and statistics over runs."""
