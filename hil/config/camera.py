"""The camera over the floor, the marks on the robot, and (twin only) what the camera looks at.

Frames: world X right, Y up on the floor, z up; body x forward, y left, origin at the centre of
mass. Colours are (blue, green, red) reflectances from 0 to 1; the sensor is linear, so a surface's
pixel value is its reflectance times the local light. DN is the sensor's 8-bit step, 0 to 255.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from hil.config.base import Section, known_name
from hil.core.registries import LOCALISERS

Reflectance = Annotated[float, Field(ge=0.0, le=1.0)]
Colour = tuple[Reflectance, Reflectance, Reflectance]
Vec2 = tuple[float, float]
Vec3 = tuple[float, float, float]


class LensConfig(Section):
    """Intrinsics at a reference width; other resolutions scale by width and crop rows evenly."""

    at_width_px: int = Field(640, ge=16, description="px, width the figures below belong to")
    at_height_px: int = Field(480, ge=16, description="px, height the figures below belong to")
    fx_px: float = Field(
        620.0, gt=10.0, description="px, 54 deg across: an ordinary webcam cropped to 4:3, assumed"
    )
    fy_px: float = Field(620.0, gt=10.0, description="px, square pixels")
    cx_px: float = Field(323.4, description="px, a few px off the middle (319.5) as lenses are")
    cy_px: float = Field(236.8, description="px, a few px off the middle (239.5) as lenses are")
    k1: float = Field(-0.16, ge=-1.0, le=1.0, description="barrel, half that of OpenCV's samples")
    k2: float = Field(0.04, ge=-2.0, le=2.0, description="assumed, keeps the map monotonic")
    p1: float = Field(0.0008, ge=-0.1, le=0.1, description="decentring, of the usual size")
    p2: float = Field(-0.0005, ge=-0.1, le=0.1, description="decentring, of the usual size")
    k3: float = Field(0.0, ge=-2.0, le=2.0, description="not needed below 60 deg")
    shift_degree: int = Field(
        0, ge=0, le=7, description="of the pixel correction by `hil calibrate floor --correct`"
    )
    shift_u: tuple[float, ...] = Field((), description="its terms in half widths, for u")
    shift_v: tuple[float, ...] = Field((), description="its terms in half widths, for v")

    @model_validator(mode="after")
    def _check_shift(self) -> LensConfig:
        """Refuse a correction whose terms do not fit its degree."""
        degree = self.shift_degree
        terms = (degree + 1) * (degree + 2) // 2 if degree else 0
        if not len(self.shift_u) == len(self.shift_v) == terms:
            raise ValueError(
                f"shift_u and shift_v have {len(self.shift_u)} and {len(self.shift_v)} terms; a"
                f" shift_degree of {degree} has {terms}"
            )
        return self


class CameraPoseConfig(Section):
    """Where the camera hangs: eye and look-at point, or a measured rotation in their place."""

    eye_m: Vec3 = Field(
        (0.0, -0.75, 2.15),
        description="m, world: a boom under the ceiling, 19 deg off vertical; 2.0 m x 1.5 m of"
        " floor and the marks above it stay in view with some 5 % to spare",
    )
    target_m: Vec3 = Field((0.0, 0.03, 0.0), description="m, world point in the image centre")
    R_world_cam: tuple[Vec3, Vec3, Vec3] | None = Field(
        None, description="measured rotation, camera to world; overrides target_m"
    )

    @model_validator(mode="after")
    def _check_rotation(self) -> CameraPoseConfig:
        """Refuse a look-at without a direction and a matrix that is no rotation."""
        if self.R_world_cam is None:
            if self.eye_m == self.target_m:
                raise ValueError("eye_m and target_m are the same point; move one of them")
            return self
        for i, a in enumerate(self.R_world_cam):
            for j, b in enumerate(self.R_world_cam):
                dot = sum(x * y for x, y in zip(a, b, strict=True))
                if abs(dot - (i == j)) > 1e-6:
                    raise ValueError(
                        f"R_world_cam is no rotation: rows {i} and {j} have the product {dot:.6f},"
                        f" limit {int(i == j)} +- 1e-6"
                    )
        return self


class MarkConfig(Section):
    """One round colour mark on the robot's plate."""

    colour: Colour = Field(description="reflectance (b, g, r)")
    x_m: float = Field(ge=-1.0, le=1.0, description="m, body frame, forward of the centre of mass")
    y_m: float = Field(
        0.0, ge=-1.0, le=1.0, description="m, body frame, left of the centre of mass"
    )


class MarksConfig(Section):
    """The two colour marks; both lie flat at one height above the floor."""

    front: MarkConfig = Field(
        MarkConfig(colour=(0.07, 0.06, 0.62), x_m=0.08), description="matt red paper, front"
    )
    rear: MarkConfig = Field(
        MarkConfig(colour=(0.12, 0.42, 0.08), x_m=-0.08), description="matt green paper, rear"
    )
    diameter_m: float = Field(
        0.06, ge=0.005, le=0.5, description="m, 16 px at 640 px: edge enough for 0.01 px of noise"
    )
    height_m: float = Field(
        0.10,
        ge=0.0,
        le=1.0,
        description="m over the floor: top of the wheels (2 r = 96 mm) + plate",
    )
    ground_ratio_max: float = Field(
        0.85,
        gt=0.0,
        le=100.0,
        description="brightness of the ground about a mark over its own, at most: on a dark plate"
        " 0.25, in a lamp's reflection 0.7; coloured things on the floor have 1.5 and more",
    )
    swapped_marks: bool = Field(
        False, description="fault: colours changed over on the robot, the host not told"
    )


class TagConfig(Section):
    """An ArUco tag on the plate between the marks, x axis of the tag along body x."""

    dictionary: str = Field("DICT_4X4_50", description="name of the OpenCV dictionary")
    tag_id: int = Field(7, ge=0, description="id in the dictionary")
    size_m: float = Field(0.07, gt=0.0, le=0.5, description="m, black edge to black edge")
    margin_ratio: float = Field(0.15, ge=0.0, le=1.0, description="white border over size")
    x_m: float = Field(0.0, ge=-1.0, le=1.0, description="m, body frame")
    y_m: float = Field(0.0, ge=-1.0, le=1.0, description="m, body frame")


class RobotLookConfig(Section):
    """What the camera sees of the robot besides its marks (twin only)."""

    plate_length_m: float = Field(0.26, gt=0.0, le=1.0, description="m, covers both wheels' length")
    plate_width_m: float = Field(0.16, gt=0.0, le=1.0, description="m, between the wheels")
    body_bottom_m: float = Field(0.03, ge=0.0, le=1.0, description="m, ground clearance, assumed")
    wheel_radius_m: float = Field(0.0482, gt=0.0, le=0.5, description="m, thesis table 8.3")
    wheel_width_m: float = Field(0.042, gt=0.0, le=0.5, description="m, common toy wheel, assumed")
    track_m: float = Field(0.2166, gt=0.0, le=1.0, description="m, thesis table 8.3")
    wheelbase_m: float = Field(0.15, gt=0.0, le=1.0, description="m, thesis table 8.3, length a")
    plate_colour: Colour = Field((0.05, 0.05, 0.05), description="matt black, as a marks' ground")
    side_colour: Colour = Field((0.09, 0.09, 0.10), description="black in its own shade")
    tyre_colour: Colour = Field((0.06, 0.06, 0.07), description="rubber")
    hub_colour: Colour = Field((0.10, 0.45, 0.55), description="yellow plastic")
    board_colour: Colour = Field((0.30, 0.26, 0.04), description="teal circuit board, Mega 2560")
    board_size_m: Vec2 = Field((0.0533, 0.1016), description="m, body x and y: a Mega 2560 across")
    tag: TagConfig | None = Field(None, description="ArUco tag in the circuit board's place")


class ClutterConfig(Section):
    """A thing on the floor that does not move."""

    shape: Literal["disc", "box"] = Field(
        "disc", description="disc is flat, box stands on the floor"
    )
    x_m: float = Field(description="m, world")
    y_m: float = Field(description="m, world")
    size_m: Vec2 = Field((0.06, 0.06), description="m, disc: diameter twice; box: along its x, y")
    height_m: float = Field(0.0, ge=0.0, le=1.5, description="m, of its upper face")
    theta_rad: float = Field(0.0, description="rad, turn of a box about z")
    colour: Colour = Field(description="reflectance (b, g, r)")


class BarConfig(Section):
    """A straight cable or rod over the robot that covers what lies below it."""

    frame: Literal["world", "body"] = Field("world", description="body: rides on the robot")
    start_m: Vec2 = Field(description="m, one end")
    end_m: Vec2 = Field(description="m, other end")
    width_m: float = Field(0.008, gt=0.0, le=0.5, description="m, a power cable")
    height_m: float = Field(0.25, ge=0.0, le=1.5, description="m over the floor")
    colour: Colour = Field((0.10, 0.10, 0.11), description="reflectance (b, g, r)")


class ShadowEdgeConfig(Section):
    """A straight shadow edge on floor and robot, as from a window frame or a cupboard."""

    through_m: Vec2 = Field((0.0, 0.0), description="m, world point on the edge")
    azimuth_rad: float = Field(0.6, description="rad, direction of the edge; shade is on its left")
    depth_ratio: float = Field(0.45, ge=0.0, le=1.0, description="share of the light taken away")
    softness_m: float = Field(0.02, ge=0.0, le=1.0, description="m, from full light to full shade")


class GlareConfig(Section):
    """A lamp mirrored by floor and marks: white light added over a round spot."""

    x_m: float = Field(0.2, description="m, world")
    y_m: float = Field(0.1, description="m, world")
    radius_m: float = Field(0.08, gt=0.0, le=2.0, description="m, standard deviation of the spot")
    peak_dn: float = Field(120.0, ge=0.0, le=1000.0, description="DN added in its middle")


class SceneConfig(Section):
    """Floor, light and sensor of the rendered camera (twin only)."""

    floor_colour: Colour = Field((0.36, 0.41, 0.44), description="warm grey laboratory floor")
    texture_ratio: float = Field(
        0.08, ge=0.0, le=0.5, description="RMS speckle of the floor, relative"
    )
    texture_seed: int = Field(1, ge=0, description="draws the floor; not tied to the run's seed")
    tile_m: float = Field(0.5, gt=0.05, le=10.0, description="m between tile joints")
    white_dn: float = Field(
        225.0,
        gt=1.0,
        le=1000.0,
        description="DN of a white surface in full light: just not clipped",
    )
    gradient_ratio: float = Field(
        0.35, ge=0.0, lt=1.0, description="light lost from the bright to the dark side of the image"
    )
    gradient_azimuth_rad: float = Field(0.5, description="rad, image direction of the bright side")
    read_noise_dn: float = Field(1.5, ge=0.0, le=10.0, description="DN RMS, webcam at low gain")
    full_well_e: float = Field(
        6000.0, ge=20.0, description="electrons at 255 DN: a 3 um pixel; sets the shot noise"
    )
    blur_px: float = Field(0.6, ge=0.0, le=3.0, description="px RMS, optics and demosaicing")
    white_balance: tuple[float, float, float] = Field(
        (1.0, 1.0, 1.0), description="gain error per channel (b, g, r)"
    )
    lamp_lean: Vec2 = Field((0.35, 0.25), description="horizontal over vertical way to the lamp")
    robot_shade_ratio: float = Field(
        0.40, ge=0.0, le=1.0, description="light the robot takes from the floor beside it"
    )
    shadow_edge: ShadowEdgeConfig | None = None
    glare: GlareConfig | None = None
    clutter: tuple[ClutterConfig, ...] = ()
    bars: tuple[BarConfig, ...] = ()


class CameraConfig(Section):
    """Frame source: resolution, timing, optics, pose, and what is in view."""

    width_px: int = Field(640, ge=64, le=4096, description="px, default condition")
    height_px: int = Field(480, ge=64, le=4096, description="px, default condition")
    rate_hz: float = Field(30.0, gt=0.0, le=500.0, description="Hz, default condition")
    exposure_s: float = Field(
        0.006, gt=0.0, le=0.1, description="s, indoor light; 3 mm of blur at 0.5 m/s"
    )
    latency_s: float = Field(
        0.060, ge=0.0, le=1.0, description="s, middle of exposure to host, default condition"
    )
    latency_jitter_s: float = Field(
        0.010, ge=0.0, le=0.5, description="s, standard deviation, default condition"
    )
    drop_ratio: float = Field(
        0.01, ge=0.0, le=1.0, description="share of frames lost, default condition"
    )
    search_radius_m: float = Field(
        0.06, gt=0.0, le=2.0, description="m, window around the prediction: 0.5 m/s over 4 frames"
    )
    localiser: Annotated[str, known_name(LOCALISERS)] = Field(
        "marks", description="what finds the robot: marks, tags, or a file"
    )
    lens: LensConfig = LensConfig()
    pose: CameraPoseConfig = CameraPoseConfig()
    marks: MarksConfig = MarksConfig()
    robot_look: RobotLookConfig = RobotLookConfig()
    scene: SceneConfig = SceneConfig()

    @property
    def tag(self) -> TagConfig | None:
        """Return the tag on the robot: the one described, or the default where tags are looked for."""
        tag = self.robot_look.tag
        return TagConfig() if tag is None and self.localiser == "tags" else tag
