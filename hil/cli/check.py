"""`hil check`: the conformance kit for what a lab brings along."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from hil.cli.options import (
    figure_option,
    json_option,
    plain_console,
    print_json,
    set_option,
    with_figures,
)
from hil.core.text import visible

if TYPE_CHECKING:
    from hil.tools.conformance import Report

KINDS = ("law", "estimator", "localiser", "robot", "figure", "cost")


@click.command("check")
@click.argument("kind", type=click.Choice(KINDS))
@click.argument("thing", metavar="FILE")
@click.option("--scenario", default=None, metavar="SCENARIO",
              help="What it must do (a robot: the three experiments).  [default: scenario-1]")  # fmt: skip
@set_option
@figure_option
@json_option
def command(
    kind: str,
    thing: str,
    scenario: str | None,
    overrides: tuple[str, ...],
    own_figures: tuple[str, ...],
    as_json: bool,
) -> int:
    """Check what is in FILE (FILE.py, FILE.py:NAME, a robot's FILE.toml) or has this name.

    A law must be finite, deterministic, as new after a reset, share no state, read no clock and no
    random number without a seed, keep to its limits, mirror with the scene, be quick, hold the
    scenario, differ from itself by exactly nothing, and fail with its turn the other way. A figure or
    a cost must be finite, deterministic, and tell a run from one with its turn the other way. Exit
    status: 0 all checks hold, 1 one does not, 2 no such thing. In a test of your own:
    hil.check_law("FILE.py").
    """
    from hil.tools import conformance

    overrides = with_figures(overrides, own_figures)
    if kind == "robot":
        if scenario is not None:
            raise click.UsageError("--scenario: a robot is checked in the three experiments")
        report = conformance.robot_report(thing, overrides=overrides)
    else:
        make = {
            "law": conformance.law_report,
            "estimator": conformance.estimator_report,
            "localiser": conformance.localiser_report,
            "figure": conformance.figure_report,
            "cost": conformance.cost_report,
        }[kind]
        report = make(thing, scenario=scenario or "scenario-1", overrides=overrides)
    if as_json:
        print_json(report.to_json())
    else:
        _print(report)
    return 0 if report.passed else 1


def _print(report: Report) -> None:
    from rich.text import Text

    console = plain_console()
    console.print(visible(f"{report.kind} {report.name} ({report.origin})"))
    for finding in report.findings:
        mark = ("holds", "green") if finding.holds else ("FAILS", "red")
        console.print(Text.assemble("  ", mark, f"  {finding.name}: {visible(finding.said)}"))
    wrong = len(report.failures)
    total = len(report.findings)
    console.print(f"all {total} checks hold" if not wrong else f"{wrong} of {total} checks fail")
