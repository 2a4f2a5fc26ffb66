"""`hil import`: logs of other programs as run records."""

from __future__ import annotations

from pathlib import Path

import click

from hil.cli.options import json_option, out_option, print_json
from hil.cli.run import print_summary, summary
from hil.core.text import visible


@click.command("import")
@click.argument("log", type=click.Path(path_type=Path))
@click.option("--map", "mapping", type=click.Path(path_type=Path), metavar="FILE.toml",
              help="What the log is of, and where each column comes from (docs/run-record.md).")  # fmt: skip
@out_option
@json_option
def command(log: Path, mapping: Path | None, out: Path | None, as_json: bool) -> int:
    """Make a run record of LOG, a MAVLink .tlog or a CSV file, that compare and view accept.

    What was left out, repaired or assumed is said on stderr and kept in the record. Exit status 1
    when the log fails a requirement of its task.
    """
    from hil.record.log_import import import_log
    from hil.record.manifest import command_line
    from hil.runs.execute import judged_status, new_folder

    made = import_log(log, mapping, out or new_folder(log.stem), command_line())
    for note in made.notes:
        click.echo(f"note: {visible(note)}", err=True)
    if as_json:
        print_json(summary(made.record) | {"notes": list(made.notes)})
    else:
        print_summary(made.record)
    return judged_status([made.record])
