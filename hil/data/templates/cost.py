"""A tuning cost of your own: what `hil tune` makes small.

    hil tune --cost ./my-thing.py
    hil check cost my-thing.py

A figure of your own is among the figures where the command also has --figure ./FILE.py.
"""

from collections.abc import Mapping

import hil


@hil.tuning_cost(
    "my-thing",
    meaning="error over time, and what the motors are made to do",
    failed=50.0,  # of a run that ends early, and the most that any run costs
)
def my_thing(figures: Mapping[str, float]) -> float:
    """Return the cost of one run; less is better. Figures and units: `hil list figures`."""
    error, rest = figures["iae_m_s"], figures["delta1_worst_last_second_m"]
    return error + 50.0 * rest + 1e-4 * figures["pwm_variation_counts"]
