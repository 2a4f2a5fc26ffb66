"""Replays: recorded inputs through the same host code, or through the board's (docs/replay.md)."""
