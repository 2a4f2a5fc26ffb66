"""`hil export`: a run record for other programs."""

from __future__ import annotations

from pathlib import Path

import click

from hil.cli.options import OutFile
from hil.core.text import visible


@click.command("export")
@click.argument("run", type=click.Path(path_type=Path))
@click.option("--to", "form", type=click.Choice(["csv", "mcap", "ulog"]), required=True,
              help="csv: the table; mcap: all of it (Foxglove); ulog: signals (PX4's tools).")  # fmt: skip
@click.option("--out", type=OutFile(), required=True,
              metavar="FILE", help="File to write; one that is there is replaced.")  # fmt: skip
def command(run: Path, form: str, out: Path) -> int:
    """Write RUN, the folder of a run record, as a file of another format.

    mcap and ulog need the packages of the extra `logs`: pip install 'skid-steer-hil[logs]'.
    """
    from hil.record.export import export
    from hil.record.reader import read_run

    record = read_run(run)
    for problem in record.problems:
        click.echo(f"note: {visible(problem)}", err=True)
    export(record, form, out)
    click.echo(visible(str(out)))
    return 0
