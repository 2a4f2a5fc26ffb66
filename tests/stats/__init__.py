"""Tests of repeats and their statistics."""
