"""One run: its specification, its parts, the session, its record."""
