"""`hil firmware`: generate, build and upload the sketch; parameters of a board."""

from __future__ import annotations

from pathlib import Path

import click

from hil.core.errors import BadInput
from hil.core.text import visible

_FILE = click.Path(path_type=Path, dir_okay=False)
_port_option = click.option(
    "--on", "target", required=True, metavar="DEV[@BAUD]", help="Port of the board."
)


@click.group("firmware")
def command() -> None:
    """Generate, build, upload and configure the firmware of the Mega 2560."""


@command.command()
@click.option(
    "--out", type=click.Path(path_type=Path), metavar="DIR",
    help="[default: build/firmware of the checkout, the user's cache without one]",
)  # fmt: skip
@click.option("--fresh", is_flag=True, help="Compile even when nothing has changed.")
def build(out: Path | None, fresh: bool) -> int:
    """Compile the sketch to ELF and HEX and print its size."""
    from hil.board import build

    made = build.build(out, fresh=fresh)
    click.echo(f"build {made.build_id}: {visible(str(made.elf))} and {made.hex.name}")
    click.echo(f"flash {made.flash_bytes} bytes, static RAM {made.ram_bytes} bytes")
    for line in made.over_budget():
        click.echo(f"over budget: {line}")
    return 1 if made.over_budget() else 0


@command.command()
@click.argument("port")
def upload(port: str) -> None:
    """Build the sketch and write it to the board on PORT."""
    from hil.board import build

    build.require_upload(port)
    made = build.build()
    build.upload(made, port)
    click.echo(f"build {made.build_id} is on the board at {port}")


@command.command()
@click.option("--check", is_flag=True, help="Change nothing; status 1 when a file is stale.")
@click.option(
    "--out", type=click.Path(path_type=Path), metavar="DIR",
    help="Folder to generate into (or to check).  [default: the checkout]",
)  # fmt: skip
def codegen(check: bool, out: Path | None) -> int:
    """Generate the MAVLink dialect for both worlds from hil/wire/hil.xml.

    An installed package is not written into: there --out is needed.
    """
    from hil.board import codegen as generator

    folder = generator.project_folder(out)
    if check:
        stale = generator.differences(folder)
        for line in stale:
            click.echo(line)
        return 1 if stale else 0
    for path in generator.write(folder):
        click.echo(f"written: {visible(str(path if out is None else out / path))}")
    return 0


@command.group()
def key() -> None:
    """Make a signing key; set it on a board, or erase it there, over its USB port."""


@key.command("new")
@click.argument("file", type=_FILE)
@click.option("--passphrase", is_flag=True,
              help="Ask for a passphrase, and make the key of it as MAVProxy does.")  # fmt: skip
def new_key(file: Path, passphrase: bool) -> None:
    """Write a new key to FILE, for you alone to read."""
    from hil.rigs import key_file

    asked = ""
    if passphrase:
        asked = click.prompt("passphrase", hide_input=True, confirmation_prompt=True)
    key_file.new_key(file, asked)
    click.echo(f"written: {visible(str(file))}; set it on a board: hil firmware key set")


@key.command("set")
@click.argument("file", type=_FILE)
@_port_option
def set_key(file: Path, target: str) -> None:
    """Give the board the key in FILE; from then on it acts on nothing else than what is signed with it."""
    from hil.rigs.key_file import read_key
    from hil.tools.board_key import set_board_key

    set_board_key(target, read_key(file))
    click.echo("set and stored; name the file from now on: --key FILE, or HIL_KEY=FILE")


@key.command("clear")
@_port_option
def clear_key(target: str) -> None:
    """Erase the board's key; from then on it acts on whatever reaches it."""
    from hil.tools.board_key import clear_board_key

    clear_board_key(target)
    click.echo("erased: the board takes unsigned frames")


@command.group()
def params() -> None:
    """List, set, save and compare the parameters of a board."""


@params.command("list")
@_port_option
def list_parameters(target: str) -> None:
    """Print every parameter with value, bounds, unit and meaning."""
    from rich.console import Console
    from rich.table import Table

    from hil.board._firmware import parameter_table
    from hil.tools.board_parameters import open_board

    known = {entry.name: entry for entry in parameter_table()}
    table = Table("name", "value", "from", "to", "unit", "meaning")
    with open_board(target) as board:
        for name, value in board.parameters.items():
            entry = known.get(name)
            rest = (
                (f"{entry.minimum:g}", f"{entry.maximum:g}", entry.unit, entry.doc)
                if entry
                else ("", "", "", "not known to this version")
            )
            table.add_row(name, f"{value:g}", *rest)
    Console().print(table)


@params.command("set")
@_port_option
@click.argument("settings", nargs=-1, required=True, metavar="NAME=VALUE...")
@click.option("--store", is_flag=True, help="Keep them in the EEPROM as well.")
def set_parameters(target: str, settings: tuple[str, ...], store: bool) -> None:
    """Set parameters within their bounds; all are checked before the first is sent."""
    from hil.config.limits import check_board
    from hil.tools.board_parameters import open_board

    values: dict[str, float] = {}
    for text in settings:
        name, _, number = text.partition("=")
        try:
            values[name.strip()] = float(number)
        except ValueError:
            raise BadInput(f"{text!r}: needs NAME=NUMBER, for example PID_KP=0.1") from None
    check_board(values)
    with open_board(target) as board:
        board.set(values)
        if store:
            board.store()
    click.echo(f"{len(values)} set{' and stored' if store else ''}")


@params.command("save")
@_port_option
@click.argument("file", type=_FILE)
def save_parameters(target: str, file: Path) -> None:
    """Write the board's parameters to FILE, as the [board] table of a scenario."""
    from hil.tools.board_parameters import open_board, write_file

    with open_board(target) as board:
        write_file(file, board.parameters)
    click.echo(f"written: {visible(str(file))}")


@params.command("compare")
@_port_option
@click.argument("file", type=_FILE)
def compare_parameters(target: str, file: Path) -> int:
    """Print what differs between the board and FILE; status 1 when anything does."""
    from hil.tools.board_parameters import compare, open_board, read_file

    wanted = read_file(file)
    with open_board(target) as board:
        found = compare(board.parameters, wanted)
    for item in found:
        values = ("missing" if value is None else f"{value:g}" for value in (item.board, item.file))
        click.echo(f"{item.name}: board {next(values)}, file {next(values)}")
    return 1 if found else 0
