"""The commands `hil twin ...`."""

from __future__ import annotations

import math
import time
from pathlib import Path
from typing import TYPE_CHECKING

import click

from hil.cli.options import seed_option, set_option

if TYPE_CHECKING:
    from hil.core.rig import Rig as TwinRig
    from hil.tools.serve_twin import TwinServer


@click.group()
def command() -> None:
    """Serve the digital twin to other programs, or film it."""


@command.command()
@click.argument("scenario", default="scenario-1")
@click.option("--pty", type=click.Path(path_type=Path), metavar="PATH",
              help="Name of the pseudo-terminal that stands for the board's port.  "
              "[default: in a folder of your own]")  # fmt: skip
@click.option("--frames", type=click.Path(path_type=Path), metavar="PATH",
              help="Unix socket that gives the camera's frames.  [default: beside the port]")  # fmt: skip
@click.option("--camera", default="rendered", show_default=True, metavar="SOURCE",
              help="rendered or pose.")  # fmt: skip
@click.option("--usb", is_flag=True,
              help="The port stands for the board's USB port, where its signing key is set; else for the "
              "Bluetooth one.")  # fmt: skip
@click.option("--duration", "duration_s", type=click.FloatRange(0.1), metavar="SECONDS",
              help="End by itself after this time. [default: at Ctrl-C]")  # fmt: skip
@seed_option
@set_option
def serve(
    scenario: str,
    pty: Path | None,
    frames: Path | None,
    camera: str,
    usb: bool,
    duration_s: float | None,
    seed: int,
    overrides: tuple[str, ...],
) -> None:
    """Run the twin of SCENARIO in real time on a pseudo-terminal.

    Another program meets it as it would meet the board, for example

    \b
    hil run scenario-1 --on serial:PORT --camera twin:SOCKET

    with the names that it prints. A second twin takes names of its own.

    Timed disturbances and faults of the scenario count from each arming.
    """  # noqa: D301 - \b is click's mark for a verbatim paragraph
    # `hil --help` must not load the twin.
    from hil.config.load import load_scenario
    from hil.rigs.opening import open_rig

    rig = open_rig("twin", load_scenario(scenario, overrides), camera, seed, usb=usb)
    server, names = _serving(rig, pty, frames)
    try:
        click.echo(f"board on {names[0]}, camera on {names[1]}; Ctrl-C ends it", err=True)
        server.run(time.monotonic() + (duration_s or math.inf))
    finally:
        server.close()
        rig.close()
        slipped = f", {server.slipped_s:.2f} s behind by now" if server.slipped_s else ""
        lag_ms = 1e3 * server.worst_lag_s
        click.echo(f"ended; kept real time within {lag_ms:.0f} ms{slipped}", err=True)


@command.command()
@click.option("--out", type=click.Path(path_type=Path), required=True, metavar="FILE",
              help="The film to write, .avi or .mkv; the true poses go into a .csv beside it.")  # fmt: skip
@click.option("--duration", "duration_s", type=click.FloatRange(0.1, 600.0), default=6.0,
              show_default=True, metavar="SECONDS", help="How long.")  # fmt: skip
@seed_option
def film(out: Path, duration_s: float, seed: int) -> None:
    """Film the robot driving a figure of eight, as the laboratory's camera sees it.

    About 0.6 MB a second of film. `hil localise` reads it with the camera file of `hil twin samples`.
    """
    from hil.config.camera import CameraConfig
    from sim_twin.samples import write_film

    truth = write_film(out, CameraConfig(), duration_s, seed)
    click.echo(f"{out}: {duration_s:g} s; the true poses are in {truth}")


@command.command()
@click.option("--out", type=click.Path(path_type=Path), required=True, metavar="FOLDER",
              help="A new folder to fill.")  # fmt: skip
@click.option("--duration", "duration_s", type=click.FloatRange(0.1, 600.0), default=6.0,
              show_default=True, metavar="SECONDS", help="Of the film.")  # fmt: skip
@seed_option
def samples(out: Path, duration_s: float, seed: int) -> None:
    """Draw all that the calibration page asks for: boards, tags on the floor, robot, a film.

    With them every command of docs/calibration.md can be tried without a camera.
    """
    from hil.config.camera import CameraConfig
    from sim_twin.samples import write_samples

    lines = write_samples(out, CameraConfig(), duration_s, seed)
    click.echo("\n".join([*lines, f"written to {out}"]))


def _serving(
    rig: TwinRig, pty: Path | None, frames: Path | None
) -> tuple[TwinServer, tuple[Path, Path]]:
    """Return the server and its names: those given, else the first pair that nobody uses."""
    from hil.core.errors import BadInput
    from hil.tools.serve_folder import default_names
    from hil.tools.serve_twin import TwinServer

    if pty is not None and frames is not None:
        return TwinServer(rig, pty, frames), (pty, frames)
    refused: BadInput | None = None
    for port, socket in default_names():
        names = pty or port, frames or socket
        try:
            return TwinServer(rig, *names), names
        except BadInput as error:
            if "in use" not in str(error):
                raise
            refused = error
    assert refused is not None
    raise refused
