"""The commands `hil twin ...`."""

from __future__ import annotations

import math
import time
from pathlib import Path

import click

from hil.cli.options import seed_option, set_option


@click.group()
def command() -> None:
    """Serve the digital twin to other programs."""


@command.command()
@click.argument("scenario", default="scenario-1")
@click.option("--pty", type=click.Path(path_type=Path), default="/tmp/hil-twin", show_default=True,
              help="Name of the pseudo-terminal that stands for the board's port.")  # fmt: skip
@click.option("--frames", type=click.Path(path_type=Path), default="/tmp/hil-twin.sock",
              show_default=True, help="Unix socket that gives the camera's frames.")  # fmt: skip
@click.option("--camera", default="rendered", show_default=True, metavar="SOURCE",
              help="rendered or pose.")  # fmt: skip
@click.option("--duration", "duration_s", type=click.FloatRange(0.1), metavar="SECONDS",
              help="End by itself after this time. [default: at Ctrl-C]")  # fmt: skip
@seed_option
@set_option
def serve(
    scenario: str,
    pty: Path,
    frames: Path,
    camera: str,
    duration_s: float | None,
    seed: int,
    overrides: tuple[str, ...],
) -> None:
    """Run the twin of SCENARIO in real time on a pseudo-terminal.

    Another program meets it as it would meet the board, for example

    \b
    hil run scenario-1 --on serial:/tmp/hil-twin --camera twin:/tmp/hil-twin.sock

    Timed disturbances and faults of the scenario count from each arming.
    """  # noqa: D301 - \b is click's mark for a verbatim paragraph
    # `hil --help` must not load the twin.
    from hil.config.load import load_scenario
    from hil.rigs.opening import open_rig
    from hil.tools.serve_twin import TwinServer

    rig = open_rig("twin", load_scenario(scenario, overrides), camera, seed)
    server = TwinServer(rig, pty, frames)
    try:
        click.echo(f"board on {pty}, camera on {frames}; Ctrl-C ends it", err=True)
        server.run(time.monotonic() + (duration_s or math.inf))
    finally:
        server.close()
        rig.close()
        slipped = f", {server.slipped_s:.2f} s behind by now" if server.slipped_s else ""
        lag_ms = 1e3 * server.worst_lag_s
        click.echo(f"ended; kept real time within {lag_ms:.0f} ms{slipped}", err=True)
