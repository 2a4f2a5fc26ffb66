"""`hil view`: recorded runs in the Rerun viewer."""

from __future__ import annotations

from pathlib import Path

import click

from hil.core.text import visible


@click.command("view")
@click.argument("runs", nargs=-1, required=True, type=click.Path(path_type=Path), metavar="RUN...")
def command(runs: tuple[Path, ...]) -> None:
    """Open one or several run records in the viewer, on a common timeline."""
    from hil.record.viewer import open_viewer

    click.echo(visible(open_viewer(list(runs))), err=True)
