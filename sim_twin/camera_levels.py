"""Camera conditions of graded difficulty on which localisers are measured, and views to see them.

Levels: clean, moderate (an ordinary laboratory), severe (what goes wrong in one, all at once) and
extreme (what no one would set up on purpose). Views: ceiling (straight down) and oblique (45 deg).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from random import Random

from hil.config.camera import (
    BarConfig,
    CameraConfig,
    CameraPoseConfig,
    ClutterConfig,
    Colour,
    GlareConfig,
    SceneConfig,
    ShadowEdgeConfig,
)

PoseTuple = tuple[float, float, float]

SPEED_M_S = 0.5
TURN_MAX_RAD_S = 1.5
# The robot's body stays in view within these of the origin, in both views and at 4:3 and 16:9.
REACH_M = (0.75, 0.40)

VIEWS = {
    "ceiling": CameraPoseConfig(eye_m=(0.0, 0.0, 2.2), target_m=(0.0, 0.0, 0.0)),
    "oblique": CameraPoseConfig(eye_m=(0.0, -1.7, 1.8), target_m=(0.0, -0.05, 0.0)),
}

# Things on the floor: one of the front mark's own colour and size, others near to the colours.
_RED, _GREEN = (0.07, 0.06, 0.62), (0.12, 0.42, 0.08)
DECOY = ClutterConfig(x_m=0.30, y_m=0.18, colour=_RED)
CLUTTER = (
    DECOY,
    ClutterConfig(shape="box", x_m=-0.55, y_m=0.30, size_m=(0.12, 0.05), height_m=0.04,
                  theta_rad=0.5, colour=(0.10, 0.30, 0.55)),
    ClutterConfig(shape="box", x_m=0.60, y_m=-0.30, size_m=(0.08, 0.08), height_m=0.10,
                  theta_rad=1.1, colour=(0.45, 0.20, 0.08)),
    ClutterConfig(x_m=-0.40, y_m=-0.25, size_m=(0.09, 0.09), colour=_GREEN),
)  # fmt: skip
_CABLE = BarConfig(
    frame="body", start_m=(0.060, -0.16), end_m=(0.078, 0.16), width_m=0.008, height_m=0.12
)
_HOSE = BarConfig(
    frame="body", start_m=(0.055, -0.16), end_m=(0.090, 0.16), width_m=0.018, height_m=0.13
)


@dataclass(frozen=True, slots=True)
class Level:
    """One difficulty: what is in view, and how long the shutter stays open."""

    scene: SceneConfig
    exposure_s: float


LEVELS = {
    "clean": Level(
        SceneConfig(gradient_ratio=0.0, read_noise_dn=0.5, full_well_e=30_000.0), exposure_s=0.001
    ),
    "moderate": Level(SceneConfig(read_noise_dn=2.0, full_well_e=3_000.0), exposure_s=0.006),
    "severe": Level(
        SceneConfig(
            read_noise_dn=4.0,
            full_well_e=1_000.0,
            gradient_ratio=0.6,
            shadow_edge=ShadowEdgeConfig(depth_ratio=0.5),
            glare=GlareConfig(peak_dn=100.0),
            clutter=CLUTTER,
            bars=(_CABLE,),
        ),
        exposure_s=0.010,
    ),
    "extreme": Level(
        SceneConfig(
            read_noise_dn=8.0,
            full_well_e=300.0,
            gradient_ratio=0.7,
            blur_px=1.0,
            white_balance=(1.15, 1.0, 0.88),
            shadow_edge=ShadowEdgeConfig(depth_ratio=0.6),
            glare=GlareConfig(peak_dn=160.0),
            clutter=CLUTTER,
            bars=(_HOSE,),
        ),
        exposure_s=0.020,
    ),
}


def camera_config(level: str, view: str, size_px: tuple[int, int]) -> CameraConfig:
    """Return the camera of a level and view at a resolution (width, height)."""
    return CameraConfig(
        width_px=size_px[0],
        height_px=size_px[1],
        exposure_s=LEVELS[level].exposure_s,
        pose=VIEWS[view],
        scene=LEVELS[level].scene,
    )


def drive(rng: Random, exposure_s: float, count: int = 5) -> list[PoseTuple]:
    """Return poses over one exposure, the true one in the middle, of a robot at 0.5 m/s."""
    x, y = (rng.uniform(-reach, reach) for reach in REACH_M)
    theta, turn = rng.uniform(-math.pi, math.pi), rng.uniform(-TURN_MAX_RAD_S, TURN_MAX_RAD_S)
    poses = []
    for i in range(count):
        t_s = exposure_s * (i / (count - 1) - 0.5)
        way_m = SPEED_M_S * t_s
        heading = theta + 0.5 * turn * t_s
        poses.append(
            (x + way_m * math.cos(heading), y + way_m * math.sin(heading), theta + turn * t_s)
        )
    return poses


def litter(rng: Random, colours: tuple[Colour, ...], count: int = 10) -> tuple[ClutterConfig, ...]:
    """Return things strewn over the floor, of the given colours in lighter and darker shades."""
    things = []
    for _ in range(count):
        shade = rng.uniform(0.5, 1.3)
        b, g, r = (min(1.0, shade * c) for c in rng.choice(colours))
        size = (rng.uniform(0.03, 0.15), rng.uniform(0.03, 0.15))
        disc = rng.random() < 0.6
        things.append(
            ClutterConfig(
                shape="disc" if disc else "box",
                x_m=rng.uniform(-0.9, 0.9),
                y_m=rng.uniform(-0.65, 0.65),
                size_m=size,
                height_m=0.0 if disc else rng.uniform(0.0, 0.15),
                theta_rad=rng.uniform(0.0, math.pi),
                colour=(b, g, r),
            )
        )
    return tuple(things)
