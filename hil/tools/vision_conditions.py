"""Frames with known truth for the vision bench: the renderer's geometry, a light path of its own.

The twin's renderer draws sharp frames without noise at several instants of an exposure; here they
are averaged (blur of any length), darkened, defocused, made noisy, given a gamma and packed as
JPEG. So what the bench measures does not rest on the renderer's own blur, light and noise.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from hil.config.camera import (
    BarConfig,
    CameraConfig,
    CameraPoseConfig,
    ClutterConfig,
    MarkConfig,
    MarksConfig,
    RobotLookConfig,
    SceneConfig,
    ShadowEdgeConfig,
)
from hil.core.types import Pose
from sim_twin.camera_sim import RenderedCamera

Image = NDArray[np.uint8]
Colour = tuple[float, float, float]

INSTANTS = 9
PLATE_ROOM_M = 0.1  # of the plate beyond the marks' centres, both ends together
RED, GREEN, BLUE = (0.07, 0.06, 0.62), (0.12, 0.42, 0.08), (0.55, 0.12, 0.05)
VIEWS = {
    "ceiling": CameraPoseConfig(eye_m=(0.0, 0.0, 2.4), target_m=(0.0, 0.0, 0.0)),
    "oblique": CameraPoseConfig(eye_m=(0.0, -1.6, 1.6), target_m=(0.0, 0.0, 0.0)),
}
# Prediction errors of the bench, 1 sigma: m, m, rad.
PREDICTION_SIGMA = (0.008, 0.008, 0.04)


@dataclass(frozen=True, slots=True)
class Condition:
    """Light, motion and sensor of one line of the bench.

    `noise_dn` is read noise, `electrons` those of a white pixel, `gradient` the light lost from one
    side to the other, `defocus_px` the radius of the disc of confusion, `optics_px` the RMS of the
    lens, `jpeg` a quality from 1 to 100 or 0 for none, `gamma` the exponent of the sensor's curve.
    """

    speed_m_s: float = 0.3
    turn_rad_s: float = 0.5
    exposure_s: float = 0.006
    noise_dn: float = 1.5
    electrons: float = 6000.0
    gradient: float = 0.2
    defocus_px: float = 0.0
    optics_px: float = 0.6
    jpeg: int = 0
    gamma: float = 1.0
    light: float = 1.0
    white_balance: Colour = (1.0, 1.0, 1.0)
    scene: SceneConfig = field(default_factory=SceneConfig)
    cover_m: float = 0.0
    edge: bool = False


_SHADOW = ShadowEdgeConfig(through_m=(0.1, 0.0), azimuth_rad=1.2, depth_ratio=0.5)
CONDITIONS: dict[str, Condition] = {
    "clean": Condition(0.0, 0.0, noise_dn=0.5, electrons=20000.0, gradient=0.0),
    "moderate": Condition(),
    "severe": Condition(
        0.5, 1.0, 0.0167, noise_dn=4.0, electrons=2000.0, gradient=0.5, optics_px=0.9, light=0.7,
        jpeg=80, gamma=1 / 2.2,
    ),
    "extreme": Condition(
        1.0, 2.0, 0.0333, noise_dn=7.0, electrons=700.0, gradient=0.6, optics_px=1.2, light=0.5,
        jpeg=60, gamma=1 / 2.2, white_balance=(1.1, 1.0, 0.92),
    ),
    "blur": Condition(1.0, 2.0, 0.0333),
    "noise": Condition(noise_dn=8.0, electrons=700.0),
    "gradient": Condition(gradient=0.85),
    "shadow": Condition(scene=SceneConfig(shadow_edge=_SHADOW)),
    "covered": Condition(cover_m=0.012),
    "edge": Condition(edge=True),
    "defocus": Condition(defocus_px=4.0),
    "jpeg": Condition(jpeg=50, gamma=1 / 2.2),
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class Frame:
    """One picture with the pose at the middle of its exposure and a prediction of it."""

    image: Image
    truth: Pose
    prediction: Pose


def camera_of(
    view: str, size_px: tuple[int, int], condition: Condition, marks: MarksConfig | None = None,
    clutter: tuple[ClutterConfig, ...] = (), cover: tuple[BarConfig, ...] = (), tag: Any = None,
) -> CameraConfig:  # fmt: skip
    """Return the camera that draws a condition without noise, blur or gradient of its own."""
    scene = condition.scene.model_copy(update={
        "gradient_ratio": 0.0, "read_noise_dn": 0.0, "full_well_e": 1e9, "blur_px": 0.0,
        "clutter": (*condition.scene.clutter, *clutter), "bars": (*condition.scene.bars, *cover),
    })  # fmt: skip
    marks = marks or MarksConfig()
    look = RobotLookConfig(tag=tag, plate_length_m=marks.front.x_m - marks.rear.x_m + PLATE_ROOM_M)
    return CameraConfig(
        width_px=size_px[0], height_px=size_px[1], pose=VIEWS[view], scene=scene,
        exposure_s=condition.exposure_s, marks=marks, robot_look=look,
    )  # fmt: skip


def marks_of(front: Colour, rear: Colour, half_distance_m: float = 0.08) -> MarksConfig:
    """Return two marks of given colours (b, g, r), fore and aft of the centre of mass."""
    return MarksConfig(
        front=MarkConfig(colour=front, x_m=half_distance_m),
        rear=MarkConfig(colour=rear, x_m=-half_distance_m),
    )


@lru_cache(maxsize=4)
def _renderer(key: str) -> RenderedCamera:
    return RenderedCamera(CameraConfig.model_validate_json(key), 1)


def exposure(pose: Pose, condition: Condition) -> list[Pose]:
    """Return the poses at the instants of an exposure; `pose` is that of its middle."""
    half = 0.5 * condition.exposure_s
    steps = np.linspace(-half, half, INSTANTS) if condition.speed_m_s else [0.0]
    poses = []
    for t in steps:
        theta = pose.theta_rad + 0.5 * condition.turn_rad_s * float(t)
        way = condition.speed_m_s * float(t)
        poses.append(Pose(
            pose.x_m + way * math.cos(theta), pose.y_m + way * math.sin(theta),
            pose.theta_rad + condition.turn_rad_s * float(t),
        ))  # fmt: skip
    return poses


def _lens(radius_px: float) -> NDArray[np.float32]:
    size = 2 * math.ceil(radius_px) + 1
    at = np.arange(size) - size // 2
    away = np.hypot(at[:, None], at)
    disc = np.clip(radius_px + 0.5 - away, 0.0, 1.0)
    return np.asarray(disc / disc.sum(), np.float32)


def develop(sharp: NDArray[np.float32], condition: Condition, rng: np.random.Generator) -> Image:
    """Return what the sensor gives for a sharp linear picture, (H, W, 3) DN."""
    height, width = sharp.shape[:2]
    azimuth = float(rng.uniform(-math.pi, math.pi))
    across = math.cos(azimuth) * np.arange(width) / width
    down = math.sin(azimuth) * np.arange(height)[:, None] / height
    span = across + down
    light = 1.0 - condition.gradient * (span - span.min()) / (span.max() - span.min())
    picture = sharp * (condition.light * light[..., None]).astype(np.float32)
    picture *= np.asarray(condition.white_balance, np.float32)
    if condition.optics_px:
        picture = np.asarray(cv2.GaussianBlur(picture, (0, 0), condition.optics_px), np.float32)
    if condition.defocus_px:
        picture = np.asarray(
            cv2.filter2D(picture, -1, _lens(condition.defocus_px), borderType=cv2.BORDER_REFLECT),
            np.float32,
        )
    variance = condition.noise_dn**2 + picture * (255.0 / condition.electrons)
    picture = picture + rng.standard_normal(picture.shape, np.float32) * np.sqrt(variance)
    if condition.gamma != 1.0:
        picture = 255.0 * np.power(np.clip(picture / 255.0, 0.0, 1.0), condition.gamma)
    image: Image = np.clip(np.rint(picture), 0, 255).astype(np.uint8)
    if condition.jpeg:
        _, packed = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, condition.jpeg])
        image = np.asarray(cv2.imdecode(packed, cv2.IMREAD_COLOR), np.uint8)
    return image


def _cover(width_m: float, rng: np.random.Generator) -> tuple[BarConfig, ...]:
    """Return a cable along the robot over one side of a mark."""
    y_m = float(rng.uniform(0.012, 0.02)) * float(rng.choice((-1.0, 1.0)))
    return (
        BarConfig(
            frame="body", start_m=(0.02, y_m), end_m=(0.16, y_m), width_m=width_m, height_m=0.12
        ),
    ) if width_m else ()  # fmt: skip


def _pose(view: str, edge: bool, rng: np.random.Generator) -> Pose:
    x, y = rng.uniform(-0.7, 0.7), rng.uniform(-0.35, 0.35)
    theta = float(rng.uniform(-math.pi, math.pi))
    if edge and view == "ceiling":
        # The centre line of the marks runs along the picture's border, which cuts their rims.
        y, theta = 0.55 * float(rng.choice((-1.0, 1.0))), float(rng.choice((0.0, math.pi)))
    return Pose(float(x), float(y), theta)


def frames(
    view: str, size_px: tuple[int, int], condition: Condition, count: int, *, seed: int = 1,
    marks: MarksConfig | None = None, clutter: tuple[ClutterConfig, ...] = (), tag: Any = None,
    robot: bool = True,
) -> Iterator[Frame]:  # fmt: skip
    """Yield frames of a robot at random places, moving, each with a prediction that is off."""
    rng = np.random.default_rng(seed)
    cover = _cover(condition.cover_m, rng)
    camera = camera_of(view, size_px, condition, marks, clutter, cover, tag)
    renderer = _renderer(camera.model_dump_json())
    for index in range(count):
        pose = _pose(view, condition.edge, rng)
        total = np.zeros((size_px[1], size_px[0], 3), np.float32)
        poses = exposure(pose, condition) if robot else []
        for at in poses:
            total += renderer.make(index, [(at.x_m, at.y_m, at.theta_rad)] * 2)
        if not poses:
            total += renderer.make(index, ())
        total /= max(len(poses), 1)
        dx, dy, turn = (float(d) for d in rng.normal(0.0, PREDICTION_SIGMA))
        guess = Pose(pose.x_m + dx, pose.y_m + dy, pose.theta_rad + turn)
        yield Frame(develop(total, condition, rng), pose, guess)


def coloured_floor(marks: MarksConfig) -> tuple[ClutterConfig, ...]:
    """Return tape, a disc of the marks' size and a box in the marks' colours."""
    front, rear = marks.front.colour, marks.rear.colour
    return (
        ClutterConfig(x_m=-0.35, y_m=-0.1, size_m=(marks.diameter_m,) * 2, colour=front),
        _box(0.4, 0.1, (0.08, 0.08), rear, height_m=0.05),
        _box(0.0, 0.5, (1.4, 0.02), front),
        _box(-0.2, 0.15, (0.3, 0.015), rear, theta_rad=0.6),
    )


def _box(
    x_m: float, y_m: float, size_m: tuple[float, float], colour: Colour,
    height_m: float = 1e-4, theta_rad: float = 0.0,
) -> ClutterConfig:  # fmt: skip
    return ClutterConfig(
        shape="box", x_m=x_m, y_m=y_m, size_m=size_m, height_m=height_m, theta_rad=theta_rad,
        colour=colour,
    )  # fmt: skip
