"""The conformance kit: what a law, an estimator, a localiser or a robot of one's own must do.

Each `check_*` returns the report when all holds and raises AssertionError that names every check that
does not, so that a test is one line; each `*_report` returns the report either way.
"""

from hil.tools.conformance.estimators import check_estimator, estimator_report
from hil.tools.conformance.laws import check_law, law_report
from hil.tools.conformance.localisers import check_localiser, localiser_report
from hil.tools.conformance.report import Finding, Report
from hil.tools.conformance.robots import check_robot, robot_report

__all__ = [
    "Finding",
    "Report",
    "check_estimator",
    "check_law",
    "check_localiser",
    "check_robot",
    "estimator_report",
    "law_report",
    "localiser_report",
    "robot_report",
]
