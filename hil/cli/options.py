"""Options and output that several commands share, each declared once."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from hil.board.wheel_laws import WHEEL_LAWS
from hil.cli.streams import takes_every_letter
from hil.core.errors import BadInput

if TYPE_CHECKING:
    from rich.console import Console

    from hil.config.scenario import Scenario


class OutFile(click.Path):
    """A file that a command writes: no folder, and none of the files that make up a run record."""

    def __init__(self) -> None:
        super().__init__(path_type=Path, dir_okay=False)

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Return the path, or fail with one line."""
        from hil.record.layout import refuse_own_file

        path = Path(os.fsdecode(super().convert(value, param, ctx)))
        if not path.name or not str(value):
            self.fail("a file's name is needed", param, ctx)
        refuse_own_file(path, param.opts[0] if param is not None else "file")
        return path


INNER_LAWS = click.Choice(sorted(WHEEL_LAWS, reverse=True))


def _not_empty(_ctx: click.Context, _param: click.Parameter, value: Any) -> Any:
    """Refuse "" of an option: a script's variable that is not set must not choose the default."""
    if value == "" or (isinstance(value, tuple) and "" in value):
        raise click.BadParameter("is empty; name one, or leave the option out for its default")
    return value


target_option = click.option(
    "--on", "target", default="twin", show_default=True, metavar="TARGET", callback=_not_empty,
    help="twin, pil, serial:DEV[@BAUD], or replay:RUN (open loop: a record answers).",
)  # fmt: skip
camera_option = click.option(
    "--camera", metavar="SOURCE", callback=_not_empty,
    help="rendered, pose (no pictures, drawn measurement errors), a camera INDEX, a video FILE, or "
    "twin:SOCKET (the camera of `hil twin serve`). "
    "[default: as the scenario says on a simulated target, 0 on a real one]",
)  # fmt: skip
outer_option = click.option(
    "--outer", metavar="LAW", callback=_not_empty,
    help="Outer law, on the host: a name that `hil list laws` shows, FILE.py or FILE.py:NAME. "
    "[default: as the scenario says: asg-ism]",
)  # fmt: skip
outers_option = click.option(
    "--outer", "outers", multiple=True, metavar="LAW", callback=_not_empty,
    help="Outer law: a name that `hil list laws` shows, FILE.py or FILE.py:NAME; may be repeated.",
)  # fmt: skip
inner_option = click.option("--inner", type=INNER_LAWS, default="asg-ism", show_default=True,
                            help="Wheel law, on the board.")  # fmt: skip
seed_option = click.option(
    "--seed", type=click.IntRange(0, 2**31 - 1), default=1, show_default=True,
    help="Draws noise, jitter, losses and random disturbances of simulated targets.",
)  # fmt: skip
set_option = click.option(
    "--set", "overrides", multiple=True, metavar="KEY=VALUE",
    help="Change any scenario or robot value by dotted name, for example robot.mass_kg=3.1.",
)  # fmt: skip
figure_option = click.option(
    "--figure", "own_figures", multiple=True, metavar="FIGURE",
    help="Figure of merit beside the built-in ones: FILE.py, FILE.py:NAME, or a name that `hil list "
    "figures` shows; may be repeated.",
)  # fmt: skip
key_option = click.option(
    "--key", "key_file", type=click.Path(path_type=Path), metavar="FILE",
    help="Signing key of the board; a simulated one is given it.  [default for ports: HIL_KEY]",
)  # fmt: skip
out_option = click.option(
    "--out", type=click.Path(path_type=Path), metavar="DIR",
    help="Folder for the record(s); must not exist or be empty. [default: a new one in runs/]",
)  # fmt: skip
figures_option = click.option(
    "--figures", type=click.Path(path_type=Path, file_okay=False), metavar="DIR",
    help="Also write each figure of the report as SVG, PDF and PNG, one and two columns wide, with "
    "its data as CSV.",
)  # fmt: skip
json_option = click.option("--json", "as_json", is_flag=True,
                           help="One JSON document on stdout, nothing else.")  # fmt: skip


def with_figures(overrides: Sequence[str], figures: Sequence[str]) -> tuple[str, ...]:
    """Return the --set texts with those of --figure among them."""
    return (*overrides, *([f"figures={json.dumps(list(figures))}"] if figures else []))


def different_files(**options: Path | None) -> None:
    """Raise BadInput where two options of a command name one file: the second would replace the first."""
    seen: dict[Path, str] = {}
    for option, path in options.items():
        if path is not None and (first := seen.setdefault(path.resolve(), option)) != option:
            raise BadInput(
                f"--{first} and --{option} both name {path}: give each a file of its own"
            )


def plain_console() -> Console:
    """Return a console for stdout that shows text as it is typed: no markup, no highlighting."""
    from rich.console import Console

    return Console(highlight=False, soft_wrap=True, markup=False)


def tell(text: str) -> None:
    """Write a line to stdout; its styles are kept on a terminal, and as NO_COLOR or FORCE_COLOR say."""
    colours = False if os.environ.get("NO_COLOR") else bool(os.environ.get("FORCE_COLOR")) or None
    click.echo(text, color=colours)


def print_json(document: dict[str, Any]) -> None:
    """Write one JSON document to stdout."""
    plain = not takes_every_letter(sys.stdout)
    click.echo(json.dumps(document, indent=1, ensure_ascii=plain, allow_nan=False))


def warn_unfinished(scenarios: Iterable[Scenario]) -> None:
    """Say on stderr where a run would end before its reference does."""
    from hil.control.references import unfinished

    for scenario in scenarios:
        told = unfinished(scenario.reference, scenario.duration_s)
        if told is not None:
            click.echo(f"note: {scenario.name}: {told}", err=True)
