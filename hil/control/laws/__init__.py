"""Outer laws: from reference and estimate to body speeds; each a module that registers itself."""
