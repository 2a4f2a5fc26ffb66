"""The conformance kit: what a law, an estimator, a localiser, a robot, a figure, a cost must do.

Each `check_*` returns the report when all holds and raises AssertionError that names every check that
does not, so that a test is one line; each `*_report` returns the report either way.
"""

from hil.tools.conformance.estimators import check_estimator, estimator_report
from hil.tools.conformance.figures import check_cost, check_figure, cost_report, figure_report
from hil.tools.conformance.laws import check_law, law_report
from hil.tools.conformance.localisers import check_localiser, localiser_report
from hil.tools.conformance.report import Finding, Report
from hil.tools.conformance.robots import check_robot, robot_report

__all__ = [
    "Finding",
    "Report",
    "check_cost",
    "check_estimator",
    "check_figure",
    "check_law",
    "check_localiser",
    "check_robot",
    "cost_report",
    "estimator_report",
    "figure_report",
    "law_report",
    "localiser_report",
    "robot_report",
]
