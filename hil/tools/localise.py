"""A recorded video through localisation alone: a row per frame, an overlay, a summary."""

from __future__ import annotations

import csv
import io
import math
import time
from collections import Counter, deque
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from hil.config.camera import CameraConfig, TagConfig
from hil.core.errors import BadInput
from hil.core.types import Pose, PoseMeasurement
from vision.calibration import figures
from vision.calibration.files import read_camera, require_size
from vision.camera import CameraModel
from vision.camera_setup import camera_model
from vision.cv_compat import dictionary_size, require_place, write_atomic
from vision.localisers.marks import MarkLocaliser
from vision.localisers.tags import TagLocaliser
from vision.sources import ImageFolder, VideoFile
from vision.tracker import Localiser, Tracker

Image = NDArray[np.uint8]
Look = Callable[[float, Image], PoseMeasurement]

COLUMNS = (
    "frame", "t_s", "seen", "x_m", "y_m", "theta_rad", "quality", "sigma_xy_m", "sigma_theta_rad",
    "window", "contrast_dn", "reason",
)  # fmt: skip
TRAIL_POSES = 300
STILLS_HZ = 1.0  # of an overlay made of stills
OVERLAY_SUFFIXES = (".avi", ".mkv")


@dataclass(frozen=True, slots=True)
class Outputs:
    """Where to write rows and overlay; None for not at all."""

    rows: Path | None
    overlay: Path | None


def localise(
    source: Path,
    camera_file: Path,
    tag_text: str | None,
    outputs: Outputs,
    rate_hz: float | None = None,
) -> dict[str, Any]:
    """Localise every frame and return the summary; raises BadInput and then leaves no file.

    The images of a folder are stills, each localised for itself; with `rate_hz` they are the frames
    of a video, in which a pose is expected near the one before.
    """
    require_place(outputs.rows)
    require_place(outputs.overlay, OVERLAY_SUFFIXES)
    if rate_hz is not None and not source.is_dir():
        raise BadInput(
            f"--rate {rate_hz:g}: {source} has stamps of its own; --rate is for a folder"
        )
    config = read_camera(camera_file)
    stills = source.is_dir() and rate_hz is None
    frames = ImageFolder(source, rate_hz or STILLS_HZ) if source.is_dir() else VideoFile(source)
    require_size(config, (frames.width_px, frames.height_px), str(camera_file), str(source))
    model = camera_model(config)
    look = _looker(_localiser(config, model, tag_text), config.search_radius_m, stills)
    rows: list[tuple[Any, ...]] = []
    measured: list[PoseMeasurement] = []
    times_s: list[float] = []
    height_m, trail_poses = config.marks.height_m, 1 if stills else TRAIL_POSES
    overlay_hz = math.nan if outputs.overlay is None else frames.rate_hz
    with _Overlay(outputs.overlay, model, overlay_hz, height_m, trail_poses) as overlay:
        for frame in frames.frames():
            assert frame.image is not None
            begin_s = time.perf_counter()
            seen = look(frame.t_cam_s, frame.image)
            times_s.append(time.perf_counter() - begin_s)
            measured.append(seen)
            rows.append(_row(frame.index, None if stills else frame.t_cam_s, seen))
            overlay.add(frame.index, frame.image, seen)
        document = _summary(source, measured, times_s) | {
            "taken_as": _taken_as(frames, stills),
            "unstamped": frames.unstamped,
        }
        overlay.keep()
    frames.close()
    if outputs.rows is not None:
        write_atomic(outputs.rows, _csv(rows).encode("utf-8"))
    return document | {
        "rows": outputs.rows and str(outputs.rows),
        "overlay": outputs.overlay and str(outputs.overlay),
    }


def _looker(localiser: Localiser, radius_m: float, stills: bool) -> Look:
    """Return what finds the robot in a frame: each for itself, or near where it was before."""
    if stills:
        return lambda _, image: localiser.locate(image, None, radius_m)
    return Tracker(localiser, radius_m).step


def _taken_as(frames: ImageFolder | VideoFile, stills: bool) -> str:
    """Return what was assumed of the time between frames."""
    if stills:
        return f"{frames.count} stills, each for itself (--rate HZ: frames of a video)"
    if isinstance(frames, ImageFolder):
        return f"a video of {frames.rate_hz:g} Hz"
    return f"a video of about {frames.rate_hz:.4g} Hz"


def _localiser(config: CameraConfig, model: CameraModel, tag_text: str | None) -> Localiser:
    """Return the colour-mark localiser, or that of the tag `ID:SIZE_MM`."""
    if tag_text is None:
        return MarkLocaliser(model, config.marks)
    try:
        number, size_mm = tag_text.split(":")
        tag_id, size_m = int(number), float(size_mm) * 1e-3
    except ValueError:
        raise BadInput(f"--tag {tag_text!r}: give ID:SIZE_MM, for example 7:70") from None
    known = dictionary_size(TagConfig().dictionary)
    if not (0 <= tag_id < known and 0.005 <= size_m <= 0.5):
        raise BadInput(f"--tag {tag_text}: limits are ids 0 to {known - 1} and 5 to 500 mm")
    near = (config.robot_look.tag or TagConfig()).model_dump()
    tag = TagConfig(**(near | {"tag_id": tag_id, "size_m": size_m}))
    return TagLocaliser(model, tag, config.marks.height_m)


def _row(index: int, t_s: float | None, seen: PoseMeasurement) -> tuple[Any, ...]:
    pose = seen.pose
    place = ("", "", "") if pose is None else (pose.x_m, pose.y_m, pose.theta_rad)
    sigma = ("", "") if pose is None else (seen.sigma_xy_m, seen.sigma_theta_rad)
    details = (seen.details.get("window", ""), seen.details.get("contrast_dn", ""))
    stamp = "" if t_s is None else t_s
    return (
        index,
        stamp,
        int(pose is not None),
        *place,
        seen.quality,
        *sigma,
        *details,
        seen.reason,
    )


def _csv(rows: list[tuple[Any, ...]]) -> str:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(COLUMNS)
    writer.writerows(rows)
    return text.getvalue()


def _summary(source: Path, seen: list[PoseMeasurement], times_s: list[float]) -> dict[str, Any]:
    """Return the figures of the whole sequence; raises BadInput when the robot is in no frame."""
    good = [m for m in seen if m.pose is not None]
    reasons = Counter(m.reason for m in seen if m.pose is None)
    if not good:
        most, count = reasons.most_common(1)[0]
        raise BadInput(
            f"{source}: robot not seen in any of {len(seen)} frames ({count} times: {most}); are the"
            " camera file, colours or tag those of this video?"
        )
    return {
        "source": str(source),
        "frames": len(seen),
        "seen": len(good),
        "seen_ratio": len(good) / len(seen),
        "in_window_ratio": sum(m.details.get("window", 0.0) for m in good) / len(good),
        "quality_median": float(np.median([m.quality for m in good])),
        "sigma_xy_median_m": float(np.median([m.sigma_xy_m for m in good])),
        "time_median_ms": float(np.median(times_s)) * 1e3,
        "time_p99_ms": float(np.quantile(times_s, 0.99)) * 1e3,
        "not_seen": dict(reasons),
    }


def summary_text(document: dict[str, Any]) -> str:
    """Return the summary as a person reads it."""
    d = document
    lines = [
        f"{d['source']}: robot seen in {d['seen']} of {d['frames']} frames ({d['seen_ratio']:.1%}),"
        f" {d['in_window_ratio']:.0%} of them in the predicted window; taken as {d['taken_as']}",
        f"median quality {d['quality_median']:.2f}, sigma {d['sigma_xy_median_m'] * 1e3:.2f} mm;"
        f" {d['time_median_ms']:.1f} ms a frame, 99 % within {d['time_p99_ms']:.1f} ms",
    ]
    if d["unstamped"]:
        lines.append(f"{d['unstamped']} frames with the stamp of the one before were left out")
    lines += [f"not seen in {count}: {reason}" for reason, count in d["not_seen"].items()]
    lines += [f"written to {d[key]}" for key in ("rows", "overlay") if d[key]]
    return "\n".join(lines)


class _Overlay:
    """Writes frames with the pose and its trail beside the wanted file; `keep` moves it there."""

    def __init__(
        self,
        path: Path | None,
        model: CameraModel,
        rate_hz: float,
        height_m: float,
        trail_poses: int,
    ) -> None:
        self._path = path
        self._model = model
        self._height_m = height_m
        self._trail: deque[Pose | None] = deque(maxlen=trail_poses)
        self._writer: cv2.VideoWriter | None = None
        if path is None:
            return
        self._part = path.with_name(f".{path.stem}.part{path.suffix}")
        code = cv2.VideoWriter.fourcc(*"MJPG")
        size = (model.width_px, model.height_px)
        self._writer = cv2.VideoWriter(str(self._part), code, rate_hz, size)
        if not self._writer.isOpened():
            raise BadInput(f"{path}: cannot be written as motion JPEG")

    def __enter__(self) -> _Overlay:
        return self

    def add(self, index: int, image: Image, seen: PoseMeasurement) -> None:
        """Write one frame."""
        if self._writer is None:
            return
        drawn = image.copy()
        self._trail.append(seen.pose)
        trail = [(p.x_m, p.y_m, self._height_m) if p else (np.nan,) * 3 for p in self._trail]
        figures.polyline(drawn, self._model.project(trail), figures.BLUE)
        text = f"{index}: not seen: {seen.reason}"
        if seen.pose is not None:
            figures.draw_pose(drawn, self._model, seen.pose, self._height_m)
            for mark, colour in (("front", figures.RED), ("rear", figures.GREEN)):
                if f"{mark}_u_px" in seen.details:
                    px = (seen.details[f"{mark}_u_px"], seen.details[f"{mark}_v_px"])
                    figures.dot(drawn, px, colour)
            text = (
                f"{index}: ({seen.pose.x_m:.3f}, {seen.pose.y_m:.3f}) m"
                f" {np.degrees(seen.pose.theta_rad):.1f} deg, quality {seen.quality:.2f}"
            )
        figures.label(drawn, text, (8, 20))
        self._writer.write(drawn)

    def keep(self) -> None:
        """Finish the video and move it to its place."""
        if self._writer is not None and self._path is not None:
            self._writer.release()
            self._writer = None
            self._part.replace(self._path)

    def __exit__(self, *_: object) -> None:
        if self._writer is not None:
            self._writer.release()
            self._part.unlink(missing_ok=True)
