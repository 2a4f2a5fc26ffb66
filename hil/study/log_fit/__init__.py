"""A twin of one's own robot from a log: what the log can tell, with intervals, and what it cannot."""
