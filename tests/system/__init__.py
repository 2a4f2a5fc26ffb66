"""The whole loop on the twin: bytes, compiled firmware, estimator, laws, record."""
