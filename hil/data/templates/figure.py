"""A figure of merit of your own: one number that says how well a run went.

    hil run scenario-1 --figure ./my-thing.py
    hil check figure my-thing.py
    hil experiment --figure ./my-thing.py

In a scenario: figures = ["./my-thing.py"], or as a requirement: metric = "./my-thing.py" with min or max.
"""

import numpy as np

import hil


@hil.figure(
    "my_thing",
    unit="s",
    meaning="time with |delta1| at or below 50 mm",
    smaller_is_better=False,  # True, False, or None for neither
    label="time within 50 mm",
)
def my_thing(run: hil.RunData) -> float:
    """Return the figure; NaN where a run has none. Columns: docs/run-record.md."""
    within = run.error_m <= 0.05
    return float(np.diff(run.t_s)[within[:-1]].sum())
