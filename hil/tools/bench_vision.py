"""`hil bench vision`: the colour marks found on rendered sequences with known truth.

The robot drives an ellipse at 0.5 m/s under two camera poses, at three resolutions and in four
conditions; the errors are against the pose at the middle of the exposure. A second part shows the
localiser scenes with coloured things and no robot.
"""

from __future__ import annotations

import math
import statistics
import time
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from typing import Any, Literal

import cv2

from hil.config.camera import (
    BarConfig,
    CameraConfig,
    CameraPoseConfig,
    ClutterConfig,
    GlareConfig,
    SceneConfig,
    ShadowEdgeConfig,
)
from hil.core.types import Pose, PoseMeasurement, wrap_pi
from hil.tools.look_alikes import GREEN, RED, Empty
from sim_twin.camera_sim import RenderedCamera
from vision.camera_setup import camera_model
from vision.localisers.marks import MarkLocaliser
from vision.tracker import Tracker

View = Literal["ceiling", "oblique"]
Progress = Callable[[str], None]

VIEWS: dict[View, CameraPoseConfig] = {
    "ceiling": CameraPoseConfig(eye_m=(0.0, 0.0, 2.4), target_m=(0.0, 0.0, 0.0)),
    "oblique": CameraPoseConfig(eye_m=(0.0, -1.9, 1.9), target_m=(0.0, 0.0, 0.0)),
}
SIZES_PX = ((640, 480), (1280, 720), (1920, 1080))
SPEED_M_S = 0.5
HALF_AXES_M = (0.60, 0.30)
GROSS_M, GROSS_RAD = 0.02, math.radians(5.0)
POSES_PER_EXPOSURE = 9
ACQUIRE_EVERY = 5

_RED_DISC = ClutterConfig(x_m=0.25, y_m=0.05, colour=RED)
_SHADOW = ShadowEdgeConfig(through_m=(0.1, 0.0), azimuth_rad=1.2, depth_ratio=0.5)
_GLARE = GlareConfig(x_m=0.35, y_m=0.22, radius_m=0.08, peak_dn=120.0)
_CABLES = (
    BarConfig(start_m=(-0.9, -0.7), end_m=(0.3, 0.9), width_m=0.008),
    BarConfig(start_m=(0.7, -0.8), end_m=(0.3, 0.8), width_m=0.012, height_m=0.4),
)
CONDITIONS: dict[str, dict[str, Any]] = {
    "clean": {
        "exposure_s": 0.001,
        "scene": SceneConfig(gradient_ratio=0.0, read_noise_dn=0.5, full_well_e=20000.0),
    },
    "moderate": {"exposure_s": 0.006, "scene": SceneConfig()},
    "severe": {
        "exposure_s": 0.012,
        "scene": SceneConfig(
            gradient_ratio=0.5, read_noise_dn=4.0, full_well_e=2000.0, blur_px=0.8,
            shadow_edge=_SHADOW, clutter=(_RED_DISC,),
        ),
    },
    "extreme": {
        "exposure_s": 0.020,
        "scene": SceneConfig(
            gradient_ratio=0.6, read_noise_dn=7.0, full_well_e=700.0, blur_px=1.0,
            white_balance=(1.1, 1.0, 0.92), shadow_edge=_SHADOW, glare=_GLARE, bars=_CABLES,
            clutter=(_RED_DISC, ClutterConfig(x_m=-0.3, y_m=-0.05, colour=GREEN)),
        ),
    },
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class Row:
    """One line of the table; RMS over the frames with a pose that is no gross error."""

    view: str
    width_px: int
    height_px: int
    condition: str
    frames: int
    rms_mm: float
    rms_deg: float
    worst_mm: float
    found_ratio: float
    gross_errors: int
    tracking_ms: float
    acquired_ratio: float
    acquisition_ms: float


def camera_in(view: View, size_px: tuple[int, int], condition: str) -> CameraConfig:
    """Return the camera of one line of the table."""
    return CameraConfig(
        width_px=size_px[0], height_px=size_px[1], pose=VIEWS[view], **CONDITIONS[condition]
    )


def drive(camera: CameraConfig, frames: int) -> Iterator[list[tuple[float, float, float]]]:
    """Yield the poses (x_m, y_m, theta_rad) over the exposure of each frame."""
    a, b = HALF_AXES_M
    phase = 0.4
    for _ in range(frames):
        poses = []
        for step in range(POSES_PER_EXPOSURE):
            rate = SPEED_M_S / math.hypot(a * math.sin(phase), b * math.cos(phase))
            at = phase + rate * camera.exposure_s * (step / (POSES_PER_EXPOSURE - 1) - 0.5)
            theta = math.atan2(b * math.cos(at), -a * math.sin(at))
            poses.append((a * math.cos(at), b * math.sin(at), theta))
        yield poses
        phase += rate / camera.rate_hz


def error(seen: Pose, truth: tuple[float, float, float]) -> tuple[float, float]:
    """Return the errors of place, m, and heading, rad."""
    place_m = math.hypot(seen.x_m - truth[0], seen.y_m - truth[1])
    return place_m, wrap_pi(seen.theta_rad - truth[2])


def _timed(call: Callable[..., PoseMeasurement], *args: Any) -> tuple[PoseMeasurement, float]:
    """Return what `call` returns and its processor time, ms."""
    start_ns = time.process_time_ns()
    result = call(*args)
    return result, 1e-6 * (time.process_time_ns() - start_ns)


def row(view: View, size_px: tuple[int, int], condition: str, frames: int) -> Row:
    """Return one line of the table; two runs differ in the times alone."""
    camera = camera_in(view, size_px, condition)
    rendered = RenderedCamera(camera, seed=1)
    localiser = MarkLocaliser(camera_model(camera), camera.marks)
    tracker = Tracker(localiser, camera.search_radius_m)
    tracked: list[tuple[float, float]] = []
    acquired: list[tuple[float, float]] = []
    tracking_ms, acquisition_ms = [], []
    for index, poses in enumerate(drive(camera, frames)):
        image, truth = rendered.make(index, poses), poses[POSES_PER_EXPOSURE // 2]
        t_s = index / camera.rate_hz
        seen, spent_ms = _timed(tracker.step, t_s, image)
        if index:
            tracking_ms.append(spent_ms)
        if seen.pose is not None:
            tracked.append(error(seen.pose, truth))
        if index % ACQUIRE_EVERY == 0:
            seen, spent_ms = _timed(localiser.locate, image, None, 0.0)
            acquisition_ms.append(spent_ms)
            if seen.pose is not None:
                acquired.append(error(seen.pose, truth))
    good = [e for e in tracked if e[0] <= GROSS_M and abs(e[1]) <= GROSS_RAD]
    whole = [e for e in acquired if e[0] <= GROSS_M and abs(e[1]) <= GROSS_RAD]
    return Row(
        view, *size_px, condition, frames,
        rms_mm=1e3 * _rms([e[0] for e in good]),
        rms_deg=math.degrees(_rms([e[1] for e in good])),
        worst_mm=1e3 * max((e[0] for e in tracked), default=math.nan),
        found_ratio=len(good) / frames,
        gross_errors=len(tracked) - len(good) + len(acquired) - len(whole),
        tracking_ms=statistics.median(tracking_ms),
        acquired_ratio=len(whole) / len(acquisition_ms),
        acquisition_ms=statistics.median(acquisition_ms),
    )  # fmt: skip


def _rms(values: list[float]) -> float:
    return math.sqrt(sum(v * v for v in values) / len(values)) if values else math.nan


def table(frames: int, progress: Progress | None = None) -> list[Row]:
    """Return every line of the table."""
    cv2.setNumThreads(1)
    rows = []
    for view in VIEWS:
        for size_px in SIZES_PX:
            for condition in CONDITIONS:
                if progress is not None:
                    progress(f"{view}, {size_px[0]} x {size_px[1]}, {condition}")
                rows.append(row(view, size_px, condition, frames))
    return rows


def as_markdown(rows: list[Row], empty: Empty) -> str:
    """Return the table as docs/vision.md keeps it."""
    lines = [
        "| view | px | condition | mm RMS | deg RMS | worst mm | found | gross | tracking ms"
        " | first find ms |",
        "| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    lines += [
        f"| {r.view} | {r.width_px} x {r.height_px} | {r.condition} | {r.rms_mm:.3f}"
        f" | {r.rms_deg:.3f} | {r.worst_mm:.2f} | {r.found_ratio:.0%} | {r.gross_errors}"
        f" | {r.tracking_ms:.2f} | {r.acquisition_ms:.1f} |"
        for r in rows
    ]
    return "\n".join([*lines, "", in_words(empty)])


def in_words(empty: Empty) -> str:
    """Return what scenes without the robot have shown, in a sentence, and which scenes were taken for it."""
    text = (
        f"Without the robot: {empty.accepted} of {empty.frames} frames accepted, in"
        f" {empty.scenes} scenes of coloured things and look-alikes; beside them the robot was found in"
        f" {empty.found} of {empty.with_robot}, wrongly in {empty.wrong}."
    )
    if empty.taken_in:
        text += f" Taken for it, or beside it, in scenes {', '.join(map(str, empty.taken_in))}."
    return text


def as_document(rows: list[Row], empty: Empty) -> dict[str, Any]:
    """Return what `hil bench vision --json` prints."""
    return {"vision": [asdict(line) for line in rows], "empty_scenes": asdict(empty)}
