"""`hil reproduce`: the numerical studies of chapters 4 to 8, and how far their claims hold."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import click

from hil.cli.options import OutFile, json_option, out_option, print_json
from hil.cli.progress import Stage, stage_progress

if TYPE_CHECKING:
    from hil.study.chapters.reproduction import Section

Update = Callable[[int, int], None]


@click.command("reproduce")
@click.argument("chapter", required=False)
@click.option("--law", "law_file", type=click.Path(path_type=Path), metavar="FILE",
              help="Add rows with the law of a Python file, in every stage of chapters 4 to 7.")  # fmt: skip
@click.option("--set", "overrides", multiple=True, metavar="PARAMETER=VALUE",
              help="Change a parameter of the study, for example disturbance=0.25.")  # fmt: skip
@click.option("--quick", is_flag=True,
              help="Rows and claims alone, without the sweeps over assumed values and starts.")  # fmt: skip
@click.option("--markdown", "markdown_file", type=OutFile(), metavar="FILE",
              help="Also write claims and rows as Markdown.")  # fmt: skip
@out_option
@json_option
def command(
    chapter: str | None,
    law_file: Path | None,
    overrides: tuple[str, ...],
    quick: bool,
    markdown_file: Path | None,
    out: Path | None,
    as_json: bool,
) -> int:
    """Reproduce the studies of CHAPTER (4, 5, 6, 7 or 8), or of all of them, and write a report.

    CHAPTER may also be a TOML file like those of hil/data/chapters. The report has the figures
    redrawn, the printed values beside ours, a table of claims, and what each assumed value is
    worth. A run that tumbles, diverges or meets NaN is a row that says so.

    \b
    A law of your own is a class Law(stage, axes) with reset(p, q) and
    output(t_s, p, q, dt_s) -> w, where dp/dt = q and w is the wanted dq/dt.

    Exit status 1: a row misses its limit, or a negative control holds.
    """  # noqa: D301 - \b is click's mark for a verbatim paragraph
    from hil.record.manifest import command_line
    from hil.runs.execute import new_folder
    from hil.study.chapters.document import markdown
    from hil.study.chapters.laws import OwnLaw
    from hil.study.chapters.report import refuse_used, write_all, write_markdown
    from hil.study.chapters.reproduction import check_request, reproduce, to_json

    check_request(chapter, law_file)
    own = OwnLaw(law_file) if law_file else None
    folder = out or new_folder("reproduce")
    refuse_used(folder)
    with bars() as begin:
        sections = reproduce(chapter, begin, own=own, overrides=overrides, sweeps=not quick)
    report = write_all(folder, sections, command_line())
    if markdown_file is not None:
        write_markdown(markdown_file, markdown(sections))
    document = to_json(sections, command_line(), report)
    if as_json:
        print_json(document)
    else:
        print_sections(sections)
        click.echo(f"report: {report}")
    return 1 if document["unexpected"] else 0


@contextmanager
def bars() -> Iterator[Callable[[str], Update]]:
    """Show one bar after the other on stderr; `begin(name)` returns the update of the next."""
    with stage_progress() as stage:

        def begin(name: str) -> Update:
            bar: list[Stage] = []

            def update(_done: int, total: int) -> None:
                if not bar:
                    bar.append(stage(name, total))
                bar[0].advance()

            return update

        yield begin


def print_sections(sections: Sequence[Section]) -> None:
    """Print rows and claims, one line each."""
    from hil.study.chapters.claims import shown

    for section in sections:
        click.echo(f"\n{section.title} (chapter {', '.join(section.chapters)})")
        for row in section.rows:
            end = "" if row.end == "complete" else f"  {row.end} at {row.end_s:.1f} s"
            ise, worst = (shown(row.figures[name]) for name in ("ise_m2_s", "worst_m"))
            click.echo(
                f"  {row.name:20s} ISE {ise:>9s} m² s  worst {worst:>8s} m  {row.label}{end}"
            )
        for item in section.claims:
            click.echo(f"  claim: {item.claim.claim}")
            click.echo(
                f"    printed {item.claim.printed}, here {shown(item.value)}: {item.verdict}"
            )
        for line in section.unexpected:
            click.echo(f"  {line}")
