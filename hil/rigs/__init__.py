"""Rigs: the twin, its board under simavr, a real robot on a port, a record."""
