"""The command `hil localise`."""

from __future__ import annotations

from pathlib import Path

import click

from hil.cli.options import json_option, print_json

FILE = click.Path(path_type=Path)


@click.command()
@click.argument("source", type=FILE)
@click.option("--camera-file", type=FILE, default="camera.toml", show_default=True, metavar="FILE",
              help="The calibration of the camera the video is from.")  # fmt: skip
@click.option("--tag", "tag_text", metavar="ID:SIZE_MM",
              help="Find a 4x4 ArUco tag on the plate in place of the colour marks.")  # fmt: skip
@click.option("--rate", "rate_hz", type=click.FloatRange(0.01, 1000.0), metavar="HZ",
              help="Take a folder of images as a video of this rate. [default: as stills]")  # fmt: skip
@click.option("--out", type=FILE, metavar="CSV", help="One row per frame.")
@click.option("--overlay", type=FILE, metavar="VIDEO",
              help="The frames with the poses drawn in: .avi or .mkv.")  # fmt: skip
@json_option
def command(
    source: Path,
    camera_file: Path,
    tag_text: str | None,
    rate_hz: float | None,
    out: Path | None,
    overlay: Path | None,
    as_json: bool,
) -> None:
    """Run a video, or a folder of images, through localisation alone.

    Says in how many frames the robot was seen, why not in the others, and how well it fitted.
    The images of a folder are stills, each localised for itself, unless --rate is given.
    A video that is cut off in mid-frame is refused, and nothing is written.
    """
    from hil.tools.localise import Outputs, localise, summary_text

    document = localise(source, camera_file, tag_text, Outputs(out, overlay), rate_hz)
    if as_json:
        print_json(document)
    else:
        click.echo(summary_text(document))
