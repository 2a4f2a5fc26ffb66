"""Campaigns: many short runs over grids, lists and distributions of values (docs/statistics.md)."""
