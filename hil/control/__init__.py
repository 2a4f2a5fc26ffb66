"""Laws, estimators and references."""
