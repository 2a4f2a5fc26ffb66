"""Comparison of recorded runs: text, JSON, and an HTML report that needs no network."""
