"""The commands `hil calibrate board|marks`: sheets to print at true size."""

from __future__ import annotations

from pathlib import Path

import click

FILE = click.Path(path_type=Path)
BOARD = "charuco:8x6:30:22"

board_option = click.option(
    "--board", "board_text", default=BOARD, show_default=True, metavar="BOARD",
    help="charuco:COLUMNSxROWS:SQUARE_MM:MARKER_MM or chess:COLUMNSxROWS:SQUARE_MM, in squares; "
    "sizes as measured on the print. charuco-old: printed before OpenCV 4.6.",
)  # fmt: skip


@click.command()
@board_option
@click.option("--paper", default="a4", show_default=True, help="a4, a3, a2, letter or fit.")
@click.option("--out", type=FILE, required=True, metavar="FILE", help="A .pdf or .svg to write.")
def board(board_text: str, paper: str, out: Path) -> None:
    """Draw a calibration board at true scale.

    Print it without scaling, measure the ruler below it, glue it to something flat, and give the
    measured sizes to the other commands.
    """
    from vision.calibration.boards import parse_board
    from vision.calibration.printing import lay_out, write_sheet

    write_sheet(out, lay_out(parse_board(board_text), paper, board_text))
    click.echo(f"{out}: {board_text} on {paper}; print at 100 % and measure the ruler")


@click.command()
@click.option("--camera-file", type=FILE, metavar="FILE",
              help="Take marks and plate from this file. [default: the usual robot]")  # fmt: skip
@click.option("--paper", default="a4", show_default=True, help="a4, a3, a2, letter or fit.")
@click.option("--out", type=FILE, required=True, metavar="FILE", help="A .pdf or .svg to write.")
def marks(camera_file: Path | None, paper: str, out: Path) -> None:
    """Draw the robot's plate with its two colour marks at true size.

    Print it without scaling on matt paper, measure the ruler, and glue it level on the robot with the
    cross over the centre of mass and the front mark forward.
    """
    from hil.config.camera import CameraConfig
    from vision.calibration import files
    from vision.calibration.marks_sheet import lines, marks_sheet
    from vision.calibration.printing import write_sheet

    config = CameraConfig() if camera_file is None else files.read_camera(camera_file)
    write_sheet(out, marks_sheet(config, paper))
    click.echo("\n".join([*lines(config), f"{out}: print at 100 % and measure the ruler"]))
