"""The robot's plate with its two colour marks, to print at true size, cut out and glue on."""

from __future__ import annotations

from hil.config.camera import CameraConfig, Colour
from hil.core.errors import BadInput
from vision.calibration.boards import Rect
from vision.calibration.printing import (
    FOOT_MM,
    MARGIN_MM,
    RULER_MM,
    Disc,
    Sheet,
    page_for,
    ruler,
)

LINES_MM = 12.0
RIM_MM = 3.0
CROSS_MM, STROKE_MM = 8.0, 0.3


def marks_sheet(camera: CameraConfig, paper: str) -> Sheet:
    """Return the plate face up, forward to the right, with what a builder has to know below it.

    Raises BadInput where a mark does not lie on the plate with a dark rim, or the paper is too small.
    """
    marks, look = camera.marks, camera.robot_look
    length, width = look.plate_length_m * 1e3, look.plate_width_m * 1e3
    radius = 0.5e3 * marks.diameter_m
    need = (max(length, RULER_MM) + 2 * MARGIN_MM, width + 2 * MARGIN_MM + FOOT_MM + LINES_MM)
    what = f"plate of {length:g} x {width:g} mm"
    page = page_for(need, paper, what, "smaller plate and marks")
    left = 0.5 * (page[0] - length)
    bottom = 0.5 * (page[1] - FOOT_MM - LINES_MM - width) + FOOT_MM + LINES_MM
    centre = (left + 0.5 * length, bottom + 0.5 * width)
    discs = []
    for name, mark in (("front", marks.front), ("rear", marks.rear)):
        x, y = mark.x_m * 1e3, mark.y_m * 1e3
        if abs(x) + radius + RIM_MM > 0.5 * length or abs(y) + radius + RIM_MM > 0.5 * width:
            raise BadInput(
                f"marks: the {name} mark of {2 * radius:g} mm at ({x:g}, {y:g}) mm reaches over the"
                f" {what} or within {RIM_MM:g} mm of its edge; make it smaller, or the plate larger"
                " (camera.marks, camera.robot_look)"
            )
        discs.append(Disc(centre[0] + x, centre[1] + y, radius, printed(mark.colour)))
    ruler_left = 0.5 * (page[0] - RULER_MM)
    plate: Rect = (left, bottom, length, width)
    cross: list[Rect] = [
        (centre[0] - 0.5 * CROSS_MM, centre[1] - 0.5 * STROKE_MM, CROSS_MM, STROKE_MM),
        (centre[0] - 0.5 * STROKE_MM, centre[1] - 0.5 * CROSS_MM, STROKE_MM, CROSS_MM),
    ]
    return Sheet(
        page[0],
        page[1],
        [plate, *ruler(ruler_left, bottom - LINES_MM - 9.0)],
        [
            *((left, bottom - 4.0 * (k + 1), line) for k, line in enumerate(lines(camera))),
            (ruler_left, bottom - LINES_MM - 13.0, f"this line is {RULER_MM:g} mm"),
        ],
        discs,
        cross,
    )


def lines(camera: CameraConfig) -> list[str]:
    """Return what a builder has to know of the marks, as short lines."""
    marks, look = camera.marks, camera.robot_look
    places = [
        f"{name} mark at x {mark.x_m * 1e3:g}, y {mark.y_m * 1e3:g} mm"
        for name, mark in (("front", marks.front), ("rear", marks.rear))
    ]
    apart = (
        (marks.front.x_m - marks.rear.x_m) ** 2 + (marks.front.y_m - marks.rear.y_m) ** 2
    ) ** 0.5
    return [
        f"{places[0]}, {places[1]} from the cross (centre of mass):"
        " x forward, here to the right; y left, here up",
        f"diameter {marks.diameter_m * 1e3:g} mm, {apart * 1e3:g} mm apart, face up"
        f" {marks.height_m * 1e3:g} mm over the floor; plate {look.plate_length_m * 1e3:g} x"
        f" {look.plate_width_m * 1e3:g} mm, matt black",
    ]


def printed(colour: Colour) -> tuple[float, float, float]:
    """Return (r, g, b) to print, sRGB, of a reflectance (b, g, r) (IEC 61966-2-1)."""
    blue, green, red = (
        12.92 * c if c <= 0.0031308 else 1.055 * c ** (1.0 / 2.4) - 0.055 for c in colour
    )
    return red, green, blue
