"""The commands `hil calibrate board|marks|camera|floor|colours|latency`."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import click

from hil.cli.calibrate_print import FILE, board, board_option, marks
from hil.cli.options import json_option, print_json
from hil.core.errors import BadInput
from vision.camera_setup import camera_model

if TYPE_CHECKING:
    from vision.calibration.boards import Board
    from vision.calibration.colours import Sample
    from vision.calibration.lens_fit import Kind
    from vision.calibration.points import PointPairs
    from vision.calibration.views import Views

detector_option = click.option(
    "--detector", type=click.Choice(["sector", "classic"]), default="sector", show_default=True,
    help="Chessboard corners: sector fits the checker pattern, classic the gradients.",
)  # fmt: skip
file_option = click.option(
    "--camera-file", type=FILE, default="camera.toml", show_default=True, metavar="FILE",
    help="The calibration; made, or the tables concerned replaced in it.",
)  # fmt: skip
picture_option = click.option("--picture", type=FILE, metavar="FILE",
                              help="Also draw the result, as .png or .jpg.")  # fmt: skip


@click.group()
def command() -> None:
    """Calibrate a real camera: print a board, then lens, floor and mark colours.

    \b
    hil calibrate board --out board.pdf
    hil calibrate marks --out marks.pdf
    hil calibrate camera images/ --camera-file lab.toml
    hil calibrate floor floor.png --board charuco:8x6:30:22 --camera-file lab.toml
    hil calibrate colours robot.png --front 312,207 --rear 355,240 --camera-file lab.toml
    """  # noqa: D301 - \b is click's mark for a verbatim paragraph


command.add_command(board)
command.add_command(marks)


@command.command()
@click.argument("source")
@board_option
@detector_option
@file_option
@click.option("--views", "wanted", type=click.IntRange(5, 200), default=20, show_default=True,
              help="Views to take from a live camera.")  # fmt: skip
@click.option("--lens", "kind", type=click.Choice(["auto", "pinhole", "fisheye", "rational"]), default="auto",
              show_default=True, help="auto: what fits views it was not fitted to.")  # fmt: skip
@picture_option
@json_option
def camera(
    source: str,
    board_text: str,
    detector: str,
    camera_file: Path,
    kind: Kind | Literal["auto"],
    wanted: int,
    picture: Path | None,
    as_json: bool,
) -> None:
    """Find lens and distortion from views of a board.

    SOURCE is a folder of images, a video, or a camera INDEX. Hold the board still in all parts of
    the image, near and far, tilted by 20 to 40 degrees both ways.
    """
    from vision.calibration import figures, files, summary
    from vision.calibration.boards import parse_board
    from vision.calibration.intrinsics import VIEWS_MIN, calibrate_lens
    from vision.cv_compat import PICTURE_SUFFIXES, require_place, write_image

    require_place(camera_file)
    require_place(picture, PICTURE_SUFFIXES)
    views = _views(source, parse_board(board_text, detector), wanted)
    result = calibrate_lens(views.require(VIEWS_MIN).views, views.size_px, kind)
    files.update_camera(camera_file, files.lens_tables(result))
    if picture is not None:
        write_image(picture, figures.coverage_picture(result))
    if as_json:
        print_json(summary.lens_document(result, views, camera_file))
    else:
        click.echo(summary.lens_text(result, views, camera_file))


# A camera whose cable was pulled while the board was carried about is waited for so long.
UNPLUGGED_S = 20.0


def _views(source: str, board: Board, wanted: int) -> Views:
    """Return the board's views of a folder, a video or a live camera."""
    from vision.calibration.views import views_of_camera, views_of_folder, views_of_video
    from vision.sources import LiveCamera

    def report(line: str) -> None:
        click.echo(line, err=True)

    if source.isdigit():
        live = LiveCamera(int(source), patience_s=UNPLUGGED_S)
        try:
            return views_of_camera(board, live, wanted, report)
        finally:
            live.close()
    path = Path(source)
    if not path.exists():
        raise BadInput(f"{source}: no such folder or video, and no camera index")
    return (
        views_of_folder(board, path, report)
        if path.is_dir()
        else views_of_video(board, path, report)
    )


@command.command()
@click.argument("source", type=FILE, required=False)
@click.option("--board", "board_text", metavar="BOARD",
              help="A board lies on the floor, face up; as for `hil calibrate camera`.")  # fmt: skip
@click.option("--at", "places", multiple=True, metavar="X,Y,DEG",
              help="Where the board's origin lies (m, m, deg), once per image. [default: it is "
              "the world's origin]")  # fmt: skip
@click.option("--fiducials", type=FILE, metavar="CSV",
              help="Tags lie at known points: columns id, x_m, y_m of their centres.")  # fmt: skip
@click.option("--dictionary", default="DICT_4X4_50", show_default=True, help="That of the tags.")
@click.option("--points", type=FILE, metavar="CSV",
              help="Listed pairs: columns x_m, y_m, u_px, v_px, if wanted z_m.")  # fmt: skip
@file_option
@click.option("--fit-lens", metavar="WIDTHxHEIGHT",
              help="Fit the lens along with the pose, for images of this size.")  # fmt: skip
@click.option("--camera-height", "height_m", type=click.FloatRange(0.1, 50.0), metavar="M",
              help="Lens centre over the floor by tape; wanted with --fit-lens.")  # fmt: skip
@click.option("--correct", "degree", type=click.IntRange(0, 7), default=0, show_default=True,
              help="Degree of a polynomial pixel correction, for wide lenses.")  # fmt: skip
@picture_option
@json_option
def floor(
    source: Path | None,
    board_text: str | None,
    places: tuple[str, ...],
    fiducials: Path | None,
    dictionary: str,
    points: Path | None,
    camera_file: Path,
    fit_lens: str | None,
    height_m: float | None,
    degree: int,
    picture: Path | None,
    as_json: bool,
) -> None:
    """Find where the camera hangs over the floor.

    SOURCE is an image or a folder of them; it may be left out with --points. Give exactly one of
    --board, --fiducials and --points.
    """
    from vision.calibration import figures, files, summary, views
    from vision.calibration.floor import FloorOptions, calibrate_floor, require_fit
    from vision.cv_compat import PICTURE_SUFFIXES, require_place, write_image

    require_place(picture, PICTURE_SUFFIXES)
    if sum(option is not None for option in (board_text, fiducials, points)) != 1:
        raise BadInput("floor: give exactly one of --board, --fiducials and --points")
    images = list(views.floor_images(source)) if source is not None else []
    if points is None and not images:
        raise BadInput("floor: an image is needed to find a board or tags in")
    size_px, lens = _lens_for(camera_file, fit_lens, images)
    pairs = _pairs(images, board_text, places, (fiducials, dictionary), points)
    result = calibrate_floor(pairs, size_px, FloorOptions(lens, height_m, degree))
    require_fit(result)
    tables = files.floor_tables(result, with_lens=lens is None)
    config = files.update_camera(camera_file, tables)
    if picture is not None:
        blank = views.blank_image(size_px)
        drawn = figures.floor_picture(
            images[0][1] if images else blank, result, config.marks.height_m
        )
        write_image(picture, drawn)
    document = summary.floor_document(result, config.marks.height_m, camera_file)
    if lens is None and height_m is None:
        document["advice"].append(summary.HEIGHT_ADVICE)
    if as_json:
        print_json(document)
    else:
        click.echo(summary.floor_text(document))


def _lens_for(
    file: Path, fit_lens: str | None, images: list[tuple[str, Any]]
) -> tuple[tuple[int, int], Any]:
    """Return image size and known lens, None for a lens to fit; images must have that size."""
    from vision.calibration import files

    if fit_lens is not None:
        try:
            width, height = (int(n) for n in fit_lens.lower().split("x"))
        except ValueError:
            raise BadInput(f"--fit-lens {fit_lens!r}: give WIDTHxHEIGHT, such as 640x480") from None
        if not (64 <= width <= 4096 and 64 <= height <= 4096):
            raise BadInput(f"--fit-lens {fit_lens}: the limit is 64 to 4096 px each way")
        size_px, lens = (width, height), None
        for name, image in images:
            if image.shape[1::-1] != size_px:
                raise BadInput(
                    f"{name}: {image.shape[1]} x {image.shape[0]} px, --fit-lens says {fit_lens}"
                )
        return size_px, lens
    config = files.read_camera(file)
    for name, image in images:
        files.require_size(config, image.shape[1::-1], str(file), name)
    return (config.width_px, config.height_px), camera_model(config)


def _pairs(
    images: list[tuple[str, Any]],
    board_text: str | None,
    places: tuple[str, ...],
    tags: tuple[Path | None, str],
    points: Path | None,
) -> PointPairs:
    """Return the world-image pairs by whichever method was asked for."""
    from vision.calibration.boards import not_seen_hint, parse_board
    from vision.calibration.points import (
        PointPairs,
        pairs_of_board,
        pairs_of_fiducials,
        read_pairs,
    )

    if points is not None:
        return read_pairs(points)
    table, dictionary = tags
    if table is not None:
        return PointPairs.joined(
            [pairs_of_fiducials(image, name, table, dictionary) for name, image in images]
        )
    assert board_text is not None
    known = parse_board(board_text)
    where = [_place(text) for text in places] or [(0.0, 0.0, 0.0)]
    if len(where) not in {1, len(images)}:
        raise BadInput(f"floor: {len(where)} --at for {len(images)} images; give one each")
    parts = []
    for k, (name, image) in enumerate(images):
        view = known.find(image, name)
        if view is None:
            hint = not_seen_hint(known, image) or "; is it whole, flat and in focus?"
            raise BadInput(f"{name}: board {board_text} not seen{hint}")
        if view.fault:
            raise BadInput(
                f"{name}: another board than {board_text}: {view.fault}; count its squares, not its"
                " corners"
            )
        parts.append(pairs_of_board(known, view, where[k if len(where) > 1 else 0]))
    return PointPairs.joined(parts)


def _place(text: str) -> tuple[float, float, float]:
    x, y, degrees = _numbers(text, 3, "--at", "0.5,-0.25,90 (m, m, deg)")
    return x, y, math.radians(degrees)


def _numbers(text: str, count: int, option: str, example: str) -> list[float]:
    try:
        values = [float(part) for part in text.split(",")]
    except ValueError:
        values = []
    if len(values) != count or not all(map(math.isfinite, values)):
        raise BadInput(f"{option} {text!r}: not understood; for example {example}")
    return values


@command.command()
@click.argument("image", type=FILE, required=False)
@click.option("--front", metavar="U,V", help="A pixel in the front mark.")
@click.option("--rear", metavar="U,V", help="A pixel in the rear mark.")
@click.option("--samples", type=FILE, metavar="CSV",
              help="Several images: columns image, front_u_px, front_v_px, rear_u_px, rear_v_px; "
              "image paths are relative to the CSV.")  # fmt: skip
@file_option
@json_option
def colours(
    image: Path | None,
    front: str | None,
    rear: str | None,
    samples: Path | None,
    camera_file: Path,
    as_json: bool,
) -> None:
    """Learn the two mark colours under the present light.

    Give one IMAGE with --front and --rear, or --samples. Images from the bright and the dark side
    of the floor make the colours hold everywhere.
    """
    from vision.calibration import files
    from vision.calibration.colours import learn_colours, read_samples

    if (samples is None) == (image is None):
        raise BadInput("colours: give either IMAGE with --front and --rear, or --samples")
    chosen = read_samples(samples) if samples is not None else [_sample(image, front, rear)]
    config = files.read_camera(camera_file)
    for sample in chosen:
        size_px = (sample.image.shape[1], sample.image.shape[0])
        files.require_size(config, size_px, str(camera_file), sample.name)
    result = learn_colours(chosen)
    files.update_camera(camera_file, files.colour_tables(config, result))
    document = {
        "camera_file": str(camera_file),
        "front_bgr": list(result.front.bgr),
        "rear_bgr": list(result.rear.bgr),
        "separation": result.separation,
        "alike_front_ratio": result.alike_front_ratio,
        "alike_rear_ratio": result.alike_rear_ratio,
    }
    if as_json:
        print_json(document)
        return
    click.echo(
        f"separation of the marks d' = {result.separation:.1f} (limit 6); other pixels that look"
        f" like front {result.alike_front_ratio:.2%}, like rear {result.alike_rear_ratio:.2%}\n"
        f"written to {camera_file}"
    )


def _sample(image: Path | None, front: str | None, rear: str | None) -> Sample:
    from vision.calibration.colours import Sample
    from vision.cv_compat import read_image

    assert image is not None
    if front is None or rear is None:
        raise BadInput("colours: --front U,V and --rear U,V must say where the marks are")
    at = [
        _numbers(text, 2, name, "312,207") for name, text in (("--front", front), ("--rear", rear))
    ]
    return Sample(image.name, read_image(image), (at[0][0], at[0][1]), (at[1][0], at[1][1]))


@command.command()
@click.argument("index", type=click.IntRange(0, 99))
@file_option
@click.option("--light", "light_s", type=click.FloatRange(0.0, 0.2), default=0.0, show_default=True,
              metavar="S", help="What the screen itself takes, subtracted.")  # fmt: skip
@json_option
def latency(index: int, camera_file: Path, light_s: float, as_json: bool) -> None:
    """Measure frame rate and exposure-to-host latency with this terminal as the light.

    Point camera INDEX at the screen so that the terminal fills the middle of the image; it turns
    white and black for some 12 seconds.
    """
    from vision.calibration import files
    from vision.calibration.latency import measure_latency
    from vision.calibration.screen import watch_blinking_terminal

    files.read_camera(camera_file)
    edges_s, arrivals_s, levels_dn = watch_blinking_terminal(index)
    found = measure_latency(edges_s, arrivals_s, levels_dn)
    values = {"rate_hz": found.rate_hz, "latency_s": max(0.0, found.latency_s - light_s)}
    files.update_camera(camera_file, [files.Table("", values)])
    if as_json:
        print_json({"camera_file": str(camera_file), **values, "sigma_s": found.sigma_s})
        return
    click.echo(
        f"latency {values['latency_s'] * 1e3:.1f} ms (sigma {found.sigma_s * 1e3:.1f}), frames at"
        f" {found.rate_hz:.2f} Hz; {light_s * 1e3:g} ms taken off for the screen\n"
        f"written to {camera_file}"
    )
