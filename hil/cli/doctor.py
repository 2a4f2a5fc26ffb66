"""The command `hil doctor`."""

import click

from hil.cli.options import json_option, print_json


@click.command()
@json_option
def command(as_json: bool) -> None:
    """Say what is installed and connected, what is missing and how to get it.

    Ends with status 0 whatever is missing: not every target needs every tool.
    """
    from hil.tools import doctor

    findings = doctor.examine()
    if as_json:
        print_json(doctor.as_document(findings))
        return
    from rich.console import Console

    console = Console(highlight=False)
    console.print(doctor.as_table(findings))
    missing = sum(finding.state == "missing" for finding in findings)
    console.print(f"\n{missing} missing" if missing else "\nnothing missing")
