"""`hil list`: what there is to choose from, built in, installed, or in a file."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from hil.cli.options import json_option, plain_console, print_json
from hil.core.text import visible

if TYPE_CHECKING:
    from hil.tools.inventory import Item, Listing

KINDS = (
    "laws", "wheel-laws", "estimators", "localisers", "references", "vehicles", "targets",
    "figures", "costs", "scenarios", "robots", "decks", "campaigns",
)  # fmt: skip


@click.command("list")
@click.argument("kind", type=click.Choice(KINDS), required=False)
@click.argument("files", nargs=-1, metavar="[FILE.py]...")
@json_option
def command(kind: str | None, files: tuple[str, ...], as_json: bool) -> int:
    """List what there is of KIND, or of every kind: name, from where, settings with bounds and units.

    With FILE.py what that file registers is listed too. Packages whose plug-ins could not be loaded
    are told with their own error.
    """
    from hil.tools.inventory import listing

    if files and kind is None:
        raise click.UsageError("FILE.py: say of which KIND")
    found = [listing(name, files) for name in ([kind] if kind else KINDS)]
    if as_json:
        document: dict[str, Any] = {item.kind: item.to_json() for item in found}
        print_json(document)
        return 0
    for item in found:
        _print(item, brief=kind is None)
    return 0


def _print(found: Listing, *, brief: bool) -> None:
    from rich.text import Text

    console = plain_console()
    if brief:
        console.print(Text(found.kind, "bold"))
    margin = "  " if brief else ""
    for item in found.items:
        console.print(Text.assemble(margin, (item.name, "bold"), f"  {visible(_about(item))}"))
        if not brief:
            for line in item.lines():
                console.print(f"    {visible(line)}")
    for where, why in found.failed.items():
        console.print(Text.assemble(margin, ("could not be loaded", "red"), f"  {where}: {why}"))


def _about(item: Item) -> str:
    return f"{item.summary}  ({item.origin})" if item.summary else f"({item.origin})"
