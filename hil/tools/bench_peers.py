"""`hil bench vision`: the colour marks beside what others use, all on the same frames.

The robot carries its two marks and, between them, a tag of family 36h11 that cv2.aruco and the
AprilTag library both read. What each finds is brought to the floor by the same camera model, so
that the detectors alone are compared. A plain threshold stands for the simplest that could work.
"""

from __future__ import annotations

import base64
import html
import math
import statistics
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import asdict, dataclass, field
from functools import cache
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from hil.config.camera import CameraConfig, MarksConfig, TagConfig
from hil.core.types import Pose, PoseMeasurement, wrap_pi
from hil.tools import vision_conditions as scenes
from vision import cv_compat
from vision.camera import CameraModel
from vision.camera_setup import camera_model
from vision.localisers.marks import MarkLocaliser
from vision.localisers.tags import TagLocaliser
from vision.mark_search import CHROMA_BASIS
from vision.pose_fit import fit_pose

Image = NDArray[np.uint8]
Find = Callable[[Image, scenes.Frame], PoseMeasurement]

TAG = TagConfig(dictionary="DICT_APRILTAG_36h11", tag_id=7)
GROSS_M, GROSS_RAD = 0.02, math.radians(5.0)
SIZE_PX = (1280, 720)
THRESHOLD_COS, THRESHOLD_DN = 0.9, 20.0
SEARCH_M = 0.06
HALF_DISTANCE_M = 0.1  # between the marks' centres: room for the tag and for blur beside it
# Corners of a tag in its own frame, x forward and y left: as OpenCV gives them, clockwise from the
# top left, where the top of the tag's picture is the robot's left.
CORNERS = np.array([(-1.0, 1.0), (1.0, 1.0), (1.0, -1.0), (-1.0, -1.0)])


@dataclass(frozen=True, slots=True)
class Line:
    """One line of the table; RMS over frames that are found and not wrong, per axis.

    `slope` is that of the error of place on the prediction's; `nees` the mean squared error in
    units of the claimed covariance, 3 when claims are true; NaN where there is none.
    """

    view: str
    condition: str
    method: str
    frames: int
    found_ratio: float
    wrong_ratio: float
    rms_mm: float
    rms_deg: float
    slope: float
    nees: float
    median_ms: float

    def as_data(self) -> dict[str, str | int | float | None]:
        """Return the line for JSON, which has no NaN: null there."""
        return {
            name: None if isinstance(value, float) and math.isnan(value) else value
            for name, value in asdict(self).items()
        }

    @classmethod
    def of_data(cls, data: Mapping[str, Any]) -> Line:
        """Return the line that `as_data` has written."""
        values: dict[str, Any] = {k: math.nan if v is None else v for k, v in data.items()}
        return cls(**values)


@dataclass(slots=True)
class Worst:
    """The frame of a condition in which the marks were furthest off, or not seen."""

    view: str
    condition: str
    frame: scenes.Frame | None = None
    camera: CameraConfig | None = None
    off_m: float = -1.0
    text: str = ""


@dataclass(slots=True)
class _Tally:
    """What one method did on the frames of one condition."""

    errors: list[NDArray[np.float64]] = field(default_factory=list)
    guesses: list[NDArray[np.float64]] = field(default_factory=list)
    nees: list[float] = field(default_factory=list)
    times_ms: list[float] = field(default_factory=list)
    wrong: int = 0


def _not_seen(reason: str) -> PoseMeasurement:
    return PoseMeasurement(None, 0.0, reason)


def _square_pose(camera: CameraModel, height_m: float, corners_px: Any) -> PoseMeasurement:
    """Return the pose of the robot from the four corners of its tag."""
    world = camera.floor_points(np.asarray(corners_px, np.float64).reshape(4, 2), height_m)
    body = 0.5 * TAG.size_m * CORNERS + (TAG.x_m, TAG.y_m)
    if not np.isfinite(world).all():
        return _not_seen("corners over the horizon")
    return PoseMeasurement(fit_pose(body, world)[0], 1.0)


def aruco(camera: CameraModel, height_m: float) -> Find:
    """Return OpenCV's detector with corners refined to fractions of a pixel."""
    settings = cv2.aruco.DetectorParameters()
    settings.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_SUBPIX
    detector = cv2.aruco.ArucoDetector(cv_compat.dictionary(TAG.dictionary), settings)

    def find(image: Image, _: scenes.Frame) -> PoseMeasurement:
        corners, ids, _rejected = detector.detectMarkers(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY))
        for square, number in zip(corners, [] if ids is None else ids.ravel(), strict=False):
            if int(number) == TAG.tag_id:
                return _square_pose(camera, height_m, square)
        return _not_seen("no tag")

    return find


@cache
def _apriltag_detector() -> Any:
    """Return the one detector of the process, None where the library is not installed."""
    try:
        from pupil_apriltags import Detector  # noqa: PLC0415 - an extra of the tests
    except ImportError:
        return None

    class Kept(Detector):  # type: ignore[misc]
        """A detector that is never taken down: version 1.0.4 crashes the process when it is."""

        def __del__(self) -> None:
            """Leave it to the end of the process."""

    return Kept(families="tag36h11", nthreads=1, quad_decimate=1.0)


def apriltag(camera: CameraModel, height_m: float) -> Find | None:
    """Return the AprilTag library's detector at full resolution; None where it is not installed."""
    detector = _apriltag_detector()
    if detector is None:
        return None

    def find(image: Image, _: scenes.Frame) -> PoseMeasurement:
        for tag in detector.detect(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY)):
            if tag.tag_id == TAG.tag_id:
                # Its pixels have their centres at halves, and its corners start at the bottom left.
                corners_px = np.roll(tag.corners[::-1], 2, axis=0) - 0.5
                return _square_pose(camera, height_m, corners_px)
        return _not_seen("no tag")

    return find


def threshold(camera: CameraModel, marks: MarksConfig) -> Find:
    """Return the largest blob of each mark's hue and its centroid."""
    colours = np.array([marks.front.colour, marks.rear.colour]) @ CHROMA_BASIS.T
    hues = colours / np.linalg.norm(colours, axis=1, keepdims=True)
    body = [(marks.front.x_m, marks.front.y_m), (marks.rear.x_m, marks.rear.y_m)]

    def find(image: Image, _: scenes.Frame) -> PoseMeasurement:
        chroma = cv2.transform(image.astype(np.float32), CHROMA_BASIS)
        strength = np.hypot(chroma[..., 0], chroma[..., 1])
        centres = []
        for hue in hues:
            along = chroma @ hue.astype(np.float32)
            mask = (along > THRESHOLD_DN) & (along > THRESHOLD_COS * strength)
            count, _labels, stats, centroids = cv2.connectedComponentsWithStats(
                mask.astype(np.uint8)
            )
            if count < 2:
                return _not_seen("no blob")
            centres.append(centroids[1 + int(np.argmax(stats[1:, cv2.CC_STAT_AREA]))])
        world = camera.floor_points(np.array(centres), marks.height_m)
        if not np.isfinite(world).all():
            return _not_seen("blob over the horizon")
        return PoseMeasurement(fit_pose(body, world)[0], 1.0)

    return find


def methods(camera: CameraConfig) -> dict[str, Find]:
    """Return what is compared, by name."""
    model, marks = camera_model(camera), camera.marks
    own, tags = MarkLocaliser(model, marks), TagLocaliser(model, TAG, marks.height_m)
    found: dict[str, Find | None] = {
        "marks, first find": lambda image, _: own.locate(image, None, SEARCH_M),
        "marks, tracking": lambda image, frame: own.locate(image, frame.prediction, SEARCH_M),
        "tags, tracking": lambda image, frame: tags.locate(image, frame.prediction, SEARCH_M),
        "cv2.aruco": aruco(model, marks.height_m),
        "AprilTag": apriltag(model, marks.height_m),
        "threshold": threshold(model, marks),
    }
    return {name: find for name, find in found.items() if find is not None}


def difference(pose: Pose, truth: Pose) -> NDArray[np.float64]:
    """Return (x_m, y_m, theta_rad) of a pose less the truth."""
    turn_rad = wrap_pi(pose.theta_rad - truth.theta_rad)
    return np.array((pose.x_m - truth.x_m, pose.y_m - truth.y_m, turn_rad))


def _nees(seen: PoseMeasurement, off: NDArray[np.float64]) -> float:
    covariance = np.diag([seen.sigma_xy_m**2] * 2 + [seen.sigma_theta_rad**2])
    if seen.covariance is not None:
        covariance[np.triu_indices(3)] = seen.covariance
        covariance = covariance + covariance.T - np.diag(np.diag(covariance))
    return float(off @ np.linalg.solve(covariance, off))


def _judge(tally: _Tally, name: str, find: Find, frame: scenes.Frame) -> tuple[float, str]:
    """Take one frame into a tally; return how far off it was, m, and in words."""
    start_ns = time.process_time_ns()
    seen = find(frame.image, frame)
    tally.times_ms.append(1e-6 * (time.process_time_ns() - start_ns))
    if seen.pose is None:
        return math.inf, f"not seen: {seen.reason}"
    off = difference(seen.pose, frame.truth)
    place_m = math.hypot(off[0], off[1])
    if place_m > GROSS_M or abs(off[2]) > GROSS_RAD:
        tally.wrong += 1
    else:
        tally.errors.append(off)
        tally.guesses.append(difference(frame.prediction, frame.truth))
        if name.startswith(("marks", "tags")):
            tally.nees.append(_nees(seen, off))
    return place_m, f"{1e3 * place_m:.2f} mm off, {1e3 * seen.sigma_xy_m:.2f} mm claimed"


def compare(view: str, condition: str, frames: int) -> tuple[list[Line], Worst]:
    """Return the lines of one condition and the worst frame of the marks, when tracking."""
    name, coloured = condition.removesuffix(", coloured floor"), condition.endswith("floor")
    setting = scenes.CONDITIONS[name]
    marks = scenes.marks_of(scenes.RED, scenes.BLUE if coloured else scenes.GREEN, HALF_DISTANCE_M)
    clutter = scenes.coloured_floor(marks) if coloured else ()
    camera = scenes.camera_of(view, SIZE_PX, setting, marks, clutter, tag=TAG)
    compared = methods(camera)
    tallies = {method: _Tally() for method in compared}
    worst = Worst(view, condition)
    for frame in scenes.frames(
        view, SIZE_PX, setting, frames, marks=marks, clutter=clutter, tag=TAG
    ):
        for method, find in compared.items():
            off_m, text = _judge(tallies[method], method, find, frame)
            if method == "marks, tracking" and off_m > worst.off_m:
                worst = Worst(view, condition, frame, camera, off_m, text)
    return [
        _line(view, condition, method, frames, tally) for method, tally in tallies.items()
    ], worst


def _line(view: str, condition: str, method: str, frames: int, tally: _Tally) -> Line:
    off = np.array(tally.errors).reshape(-1, 3)
    guess = np.array(tally.guesses).reshape(-1, 3)
    tracking = method.endswith("tracking") and len(off) > 1
    slope = math.nan
    if tracking:
        slope = float(np.sum(off[:, :2] * guess[:, :2]) / np.sum(guess[:, :2] ** 2))
    rms = np.sqrt(np.mean(off**2, axis=0)) if len(off) else np.full(3, math.nan)
    return Line(
        view, condition, method, frames,
        found_ratio=len(off) / frames, wrong_ratio=tally.wrong / frames,
        rms_mm=1e3 * math.sqrt(0.5 * float(rms[0] ** 2 + rms[1] ** 2)),
        rms_deg=math.degrees(float(rms[2])), slope=slope,
        nees=statistics.fmean(tally.nees) if tally.nees else math.nan,
        median_ms=statistics.median(tally.times_ms),
    )  # fmt: skip


def conditions() -> list[str]:
    """Return the names of all conditions, those of a coloured floor last."""
    names = list(scenes.CONDITIONS)
    return names + [f"{name}, coloured floor" for name in ("moderate", "severe", "extreme")]


def lines(
    frames: int, progress: Callable[[str], None] | None = None
) -> Iterator[tuple[list[Line], Worst]]:
    """Yield the lines and the worst frame of every view and condition."""
    cv2.setNumThreads(1)
    for view in scenes.VIEWS:
        for condition in conditions():
            if progress is not None:
                progress(f"peers, {view}, {condition}")
            yield compare(view, condition, frames)


def as_markdown(found: list[Line]) -> str:
    """Return the table as docs/vision.md keeps it."""
    rows = [
        "| view | condition | method | found | wrong | mm RMS | deg RMS | slope | NEES | ms |",
        "| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    for line in found:
        slope, nees = (
            "" if math.isnan(value) else f"{value:.{digits}f}"
            for value, digits in ((line.slope, 3), (line.nees, 1))
        )
        rows.append(
            f"| {line.view} | {line.condition} | {line.method} | {line.found_ratio:.0%}"
            f" | {line.wrong_ratio:.0%} | {line.rms_mm:.3f} | {line.rms_deg:.3f} | {slope}"
            f" | {nees} | {line.median_ms:.1f} |"
        )
    return "\n".join(rows)


CROP_PX, ZOOM = 96, 4


def _picture(worst: Worst) -> str:
    """Return the robot in a worst frame as a PNG in base64, the true marks drawn as crosses."""
    frame, camera = worst.frame, worst.camera
    if frame is None or camera is None:
        return ""
    model, marks, pose = camera_model(camera), camera.marks, frame.truth
    c, s = math.cos(pose.theta_rad), math.sin(pose.theta_rad)
    centres = [
        model.project_point(
            pose.x_m + c * mark.x_m - s * mark.y_m,
            pose.y_m + s * mark.x_m + c * mark.y_m,
            marks.height_m,
        )
        for mark in (marks.front, marks.rear)
    ]
    middle = np.mean(centres, axis=0)
    height, width = frame.image.shape[:2]
    left = int(np.clip(middle[0] - CROP_PX, 0, width - 2 * CROP_PX))
    top = int(np.clip(middle[1] - CROP_PX // 2, 0, height - CROP_PX))
    part = frame.image[top : top + CROP_PX, left : left + 2 * CROP_PX]
    large = cv2.resize(part, None, fx=ZOOM, fy=ZOOM, interpolation=cv2.INTER_NEAREST)
    for u, v in centres:
        at = (round((u - left + 0.5) * ZOOM), round((v - top + 0.5) * ZOOM))
        cv2.drawMarker(large, at, (255, 255, 255), cv2.MARKER_CROSS, 12, 1)
    _, packed = cv2.imencode(".png", large)
    return base64.b64encode(packed.tobytes()).decode()


def as_page(found: list[Line], worst: list[Worst]) -> str:
    """Return one HTML page: the table, and the worst frame of each condition; needs no network."""
    rows = [line.strip("|").split("|") for line in as_markdown(found).splitlines()]
    head = "".join(f"<th>{html.escape(cell.strip())}</th>" for cell in rows[0])
    body = "".join(
        "<tr>" + "".join(f"<td>{html.escape(cell.strip())}</td>" for cell in row) + "</tr>"
        for row in rows[2:]
    )
    pictures = "".join(
        f"<figure><img alt='' src='data:image/png;base64,{_picture(one)}'><figcaption>"
        f"{html.escape(f'{one.view}, {one.condition}: {one.text}')}</figcaption></figure>"
        for one in worst
    )
    return (
        "<!doctype html><html lang='en'><head><meta charset='utf-8'><title>Vision bench</title>"
        "<style>body{font:14px sans-serif;margin:2em}td,th{padding:2px 8px;text-align:left}"
        "figure{display:inline-block;margin:6px}</style></head><body><h1>Vision bench</h1>"
        f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"
        "<h2>Worst frame of each condition (marks, tracking; crosses: the truth)</h2>"
        f"{pictures}</body></html>"
    )
