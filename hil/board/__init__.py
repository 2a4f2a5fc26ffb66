"""The firmware: its compiled core, builds, uploads, generated code."""
