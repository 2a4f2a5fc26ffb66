"""`hil console`: the rig in a browser."""

from __future__ import annotations

from pathlib import Path

import click

from hil.core.errors import BadInput


@click.command("console")
@click.option("--port", type=click.IntRange(0, 65535), default=8700, show_default=True,
              help="Port to serve on; 0 takes any that is free.")  # fmt: skip
@click.option("--host", default="127.0.0.1", show_default=True, metavar="ADDRESS",
              help="Address to serve on. Any other than a loopback one lets this network in.")  # fmt: skip
@click.option("--records", type=click.Path(path_type=Path, file_okay=False), default="runs",
              show_default=True, metavar="DIR", help="Folder of the records.")  # fmt: skip
@click.option("--on", "target", default="twin", show_default=True, metavar="TARGET",
              help="Target that the Run page begins with: twin, pil, serial:DEV[@BAUD].")  # fmt: skip
@click.option("--camera", default="", metavar="SOURCE",
              help="Camera that the Run page begins with, as for `hil run`.")  # fmt: skip
@click.option("--no-browser", is_flag=True, help="Do not open the page.")
def command(
    port: int, host: str, records: Path, target: str, camera: str, no_browser: bool
) -> None:
    """Show the rig in a browser: run a scenario and watch it, STOP it, look at records.

    The page's address, with the token that opens it, is printed; Ctrl-C ends it, and stops a run.
    Everything comes from this machine.
    """
    try:
        from hil.console.serve import start
    except ModuleNotFoundError as error:
        if (error.name or "").startswith("hil"):
            raise
        raise BadInput(
            f"console: {error.name} is not installed; pip install 'skid-steer-hil[console]'"
        ) from None
    start(host, port, records, (target, camera), browser=not no_browser)
