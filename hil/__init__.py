"""Hardware-in-the-loop test harness for a four-wheel skid-steer robot."""

__version__ = "0.1.0"
