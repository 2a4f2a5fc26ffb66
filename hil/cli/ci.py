"""What `run`, `experiment` and `compare` tell a CI: a JUnit file, and the summary of its step."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import click

from hil.cli.options import OutFile
from hil.core.errors import BadInput, RigFault
from hil.core.text import visible

if TYPE_CHECKING:
    from hil.record.reader import RunRecord

junit_option = click.option(
    "--junit", type=OutFile(), metavar="FILE.xml",
    help="Write the verdict on each requirement as a JUnit test case, for a CI.",
)  # fmt: skip


@contextmanager
def junit_file(path: Path | None, name: str) -> Iterator[None]:
    """Refuse a file that cannot be written before anything runs; write a rig fault without record.

    `name` is the suite of such a fault. Raises BadInput.
    """
    if path is not None and not (path.parent.is_dir() and os.access(path.parent, os.W_OK)):
        raise BadInput(f"--junit {path}: {path.parent} is no folder that can be written; make it")
    try:
        yield
    except RigFault as error:
        if path is not None:
            from hil.report.junit import write_fault

            write_fault(path, name, str(error))
        raise


def tell_ci(
    records: Sequence[RunRecord], title: str, *, junit: Path | None, report: Path | None = None
) -> None:
    """Write the JUnit file that was asked for and the step summary the environment names.

    A summary that cannot be written is a line on stderr: it decides nothing. Raises BadInput when
    the JUnit file cannot be written.
    """
    from hil.report.step_summary import VARIABLE, append_summary

    try:
        append_summary(records, title, report)
    except OSError as error:
        where = visible(os.environ[VARIABLE])
        click.echo(
            f"hil: no summary: {VARIABLE}={where} cannot be written: {error.strerror}", err=True
        )
    if junit is not None:
        from hil.report.junit import write_junit  # XML is for those who ask for it

        write_junit(junit, records, report)
