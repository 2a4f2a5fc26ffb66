"""`hil config`: every key of the files, with unit, bounds, default, source and meaning."""

from __future__ import annotations

import math
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from hil.cli.options import json_option, plain_console, print_json
from hil.core.errors import BadInput
from hil.core.text import visible

if TYPE_CHECKING:
    from collections.abc import Sequence

    from hil.config.fields import Setting

# The word in KEY's place that asks for the schemas; no table has this name.
SCHEMA = "schema"


@click.command("config")
@click.argument("key", required=False)
@json_option
@click.option("--markdown", is_flag=True, help="As the tables of docs/settings.md.")
@click.option("--out", type=click.Path(path_type=Path), metavar="DIR",
              help="With `schema`: folder for the JSON Schemas.")  # fmt: skip
def command(key: str | None, as_json: bool, markdown: bool, out: Path | None) -> None:
    """Show what is known of KEY, or of every key of the table it names: unit, bounds, default, source.

    Keys are dotted names as --set takes them; those of campaigns and decks begin with `campaign.` and
    `deck.`. Defaults are the values of scenario-1. Without KEY: all of them.

    `hil config schema --out DIR` writes a JSON Schema for each kind of file, for editors.
    """
    from hil.study import file_kinds

    if key == SCHEMA:
        if out is None:
            raise BadInput("config schema: needs a folder: --out DIR")
        for file in file_kinds.write_schemas(out):
            click.echo(f"written: {visible(str(file))}")
        return
    if out is not None:
        raise BadInput("config: --out goes with `hil config schema` only")
    if as_json and markdown:
        raise BadInput("config: --json and --markdown are two answers; choose one")
    found = file_kinds.settings_of(key)
    if as_json:
        print_json({"settings": [as_document(setting) for setting in found]})
    elif markdown:
        click.echo(as_markdown(found), nl=False)
    else:
        _print(found)


def as_document(setting: Setting) -> dict[str, Any]:
    """Return what is known of a key for a JSON document; null where there is none."""
    return {
        "key": setting.key,
        "meaning": setting.meaning,
        "unit": setting.unit,
        "low": setting.low,
        "high": setting.high,
        "above_low": setting.above,
        "below_high": setting.below,
        "choices": list(setting.choices),
        "default": _plain(setting.default),
        "source": setting.source,
        "of_kind": setting.kind,
    }


def _plain(value: Any) -> Any:
    """Return a default as JSON has it: lists for tuples, text for what is infinite."""
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    if isinstance(value, dict):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, float) and not math.isfinite(value):
        return str(value)
    return value if isinstance(value, str | bool | int | float) or value is None else str(value)


def limits(setting: Setting) -> str:
    """Return bounds or choices in words."""
    return setting.bounds() or ", ".join(setting.choices)


def default(setting: Setting) -> str:
    """Return the default as a TOML file has it, "" where a value must be given."""
    value = _plain(setting.default)
    if value is None or value in ({}, []):
        return ""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, float):
        return f"{value:g}" if float(f"{value:g}") == value else repr(value)
    return str(value)


def as_markdown(found: Sequence[Setting]) -> str:
    """Return one table for each table of the files."""
    parts = []
    for (table, kind), group in groupby(found, key=_table):
        of_kind = f" of kind {kind}" if kind else ""
        lines = [
            f"## {table.replace('*', 'N') or 'top level'}{of_kind}",
            "",
            "| key | unit | bounds | default | meaning | source |",
            "| --- | --- | --- | --- | --- | --- |",
        ]
        for one in group:
            cells = (one.unit, limits(one), default(one), one.meaning, one.source)
            row = " | ".join(cell.replace("|", "\\|").replace("\n", " ") for cell in cells)
            lines.append(f"| `{one.key.rpartition('.')[2]}` | {row} |")
        parts.append("\n".join(lines) + "\n")
    return "\n".join(parts)


def _table(setting: Setting) -> tuple[str, str]:
    """Return the table of a key, and its kind where it has several."""
    return setting.key.rpartition(".")[0], setting.kind


def _print(found: Sequence[Setting]) -> None:
    console = plain_console()
    for one in found:
        console.print(visible(one.key), style="bold")
        rows = (
            ("", one.meaning),
            ("kind", one.kind if not one.key.endswith(".kind") else ""),
            ("unit", one.unit),
            ("bounds", limits(one)),
            ("default", default(one)),
            ("source", one.source),
        )
        for name, text in rows:
            if text:
                console.print(visible(f"  {f'{name}: ' if name else ''}{text}"))
