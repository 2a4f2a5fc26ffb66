"""How well and how fast the colour marks are found, on rendered frames with known truth.

Each condition is a level and a view of `sim_twin.camera_levels` at one resolution. Frames are
independent: pose, motion and the prediction's error are drawn anew for each.
"""

from __future__ import annotations

import math
import statistics
import time
from collections import Counter
from dataclasses import dataclass
from random import Random

from hil.config.camera import CameraConfig, Colour, SceneConfig
from hil.types import Pose, PoseMeasurement, wrap_pi
from sim_twin.camera_levels import LEVELS, VIEWS, camera_config, drive, litter
from sim_twin.camera_sim import RenderedCamera
from vision.marks import MarkLocaliser

SIZES_PX = ((1280, 720), (640, 480))
# An error of the prediction as a fused estimate has it a frame ahead.
PREDICTION_SIGMA_M = 0.004
PREDICTION_SIGMA_RAD = 0.03
# Beyond these a pose is not inaccurate but wrong.
GROSS_M = 0.01
GROSS_RAD = 0.1
FRAMES_PER_SCENE = 25


@dataclass(frozen=True, slots=True)
class Accuracy:
    """Errors of a number of frames: RMS of the planar distance and of the heading.

    `sigma_ratio` is the RMS error per axis over the deviation claimed (1: honest claims), `gross`
    counts poses that are wrong, `reasons` the frames in which the robot was not found.
    """

    frames: int
    found: int
    gross: int
    rms_mm: float
    rms_deg: float
    worst_mm: float
    sigma_ratio: float
    time_ms: float
    reasons: dict[str, int]


@dataclass(frozen=True, slots=True)
class Condition:
    """Figures of one level and view at one resolution, with and without a prediction."""

    level: str
    view: str
    size_px: tuple[int, int]
    tracking: Accuracy
    acquisition: Accuracy


class _Tally:
    """Collects one kind of search over the frames of a condition."""

    def __init__(self) -> None:
        self.errors: list[tuple[float, float, float]] = []
        self.claims: list[float] = []
        self.reasons: Counter[str] = Counter()
        self.times_s: list[float] = []

    def add(self, truth: Pose, seen: PoseMeasurement, took_s: float) -> None:
        self.times_s.append(took_s)
        if seen.pose is None:
            self.reasons[seen.reason] += 1
            return
        pose = seen.pose
        turn = wrap_pi(pose.theta_rad - truth.theta_rad)
        self.errors.append((pose.x_m - truth.x_m, pose.y_m - truth.y_m, turn))
        self.claims.append(seen.sigma_xy_m)

    def accuracy(self) -> Accuracy:
        distances = [math.hypot(x, y) for x, y, _ in self.errors]
        wrong = [
            d > GROSS_M or abs(turn) > GROSS_RAD
            for d, (_, _, turn) in zip(distances, self.errors, strict=True)
        ]
        fair = [d for d, bad in zip(distances, wrong, strict=True) if not bad]
        turns = [t for (_, _, t), bad in zip(self.errors, wrong, strict=True) if not bad]
        claims = [c for c, bad in zip(self.claims, wrong, strict=True) if not bad]
        ratios = [d / (c * math.sqrt(2.0)) for d, c in zip(fair, claims, strict=True)]
        return Accuracy(
            frames=len(self.times_s),
            found=len(self.errors),
            gross=sum(wrong),
            rms_mm=_rms(fair) * 1e3,
            rms_deg=math.degrees(_rms(turns)),
            worst_mm=max(fair, default=math.nan) * 1e3,
            sigma_ratio=_rms(ratios),
            time_ms=statistics.median(self.times_s) * 1e3,
            reasons=dict(self.reasons),
        )


def _rms(values: list[float]) -> float:
    return math.sqrt(sum(v * v for v in values) / len(values)) if values else math.nan


def measure(level: str, view: str, size_px: tuple[int, int], frames: int, seed: int) -> Condition:
    """Return the figures of one condition over `frames` rendered frames."""
    config = camera_config(level, view, size_px)
    camera = RenderedCamera(config, seed)
    localiser = MarkLocaliser(config.model(), config.marks)
    rng = Random(seed)
    tracking, acquisition = _Tally(), _Tally()
    for index in range(frames):
        poses = drive(rng, config.exposure_s)
        truth = Pose(*poses[len(poses) // 2])
        image = camera.make(index, poses)
        predicted = Pose(
            truth.x_m + rng.gauss(0.0, PREDICTION_SIGMA_M),
            truth.y_m + rng.gauss(0.0, PREDICTION_SIGMA_M),
            truth.theta_rad + rng.gauss(0.0, PREDICTION_SIGMA_RAD),
        )
        for tally, guess in ((tracking, predicted), (acquisition, None)):
            begin_s = time.perf_counter()
            seen = localiser.locate(image, guess, config.search_radius_m)
            tally.add(truth, seen, time.perf_counter() - begin_s)
    return Condition(level, view, size_px, tracking.accuracy(), acquisition.accuracy())


def measure_all(frames: int, seed: int) -> list[Condition]:
    """Return the figures of every condition."""
    return [
        measure(level, view, size_px, frames, seed)
        for size_px in SIZES_PX
        for view in VIEWS
        for level in LEVELS
    ]


def false_acceptances(frames: int, seed: int) -> tuple[int, int]:
    """Return (poses reported, frames) of littered floors without the robot.

    The litter has the marks' colours; half of the frames are searched near a prediction.
    """
    rng = Random(seed)
    marks = CameraConfig().marks
    colours: tuple[Colour, Colour] = (marks.front.colour, marks.rear.colour)
    reported = done = 0
    while done < frames:
        scene = SceneConfig(clutter=litter(rng, colours))
        config = CameraConfig(scene=scene)
        camera = RenderedCamera(config, rng.randrange(2**31))
        localiser = MarkLocaliser(config.model(), config.marks)
        for index in range(min(FRAMES_PER_SCENE, frames - done)):
            pose = drive(rng, config.exposure_s)[0]
            guess = Pose(*pose) if index % 2 else None
            seen = localiser.locate(camera.make(index, []), guess, config.search_radius_m)
            reported += seen.pose is not None
            done += 1
    return reported, done
