"""The camera over the floor, the marks on the robot, and (twin only) what the camera looks at.

Frames: world X right, Y up on the floor, z up; body x forward, y left, origin at the centre of
mass. Colours are (blue, green, red) reflectances from 0 to 1; the sensor is linear, so a surface's
pixel value is its reflectance times the local light. DN is the sensor's 8-bit step, 0 to 255.
"""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal

from pydantic import (
    BaseModel,
    Field,
    SerializeAsAny,
    ValidationInfo,
    field_validator,
    model_validator,
)

from hil.config.base import Section, known_name, quantity
from hil.config.controls import ControlsConfig
from hil.config.own_settings import BY_NAME_KEY, own_of, validated
from hil.core.registries import LOCALISERS

Reflectance = Annotated[float, Field(ge=0.0, le=1.0)]
Colour = tuple[Reflectance, Reflectance, Reflectance]
Vec2 = tuple[float, float]
Vec3 = tuple[float, float, float]


# What the radial terms of a lens without divisor reach at most; those of a quotient may balance it.
PLAIN_LIMITS = {"k1": 1.0, "k2": 2.0, "k3": 2.0}


class LensConfig(Section):
    """Intrinsics at a reference width; other resolutions scale by width and crop rows evenly."""

    at_width_px: int = quantity("px", "width the figures below belong to", 640, ge=16)
    at_height_px: int = quantity("px", "height the figures below belong to", 480, ge=16)
    fx_px: float = quantity(
        "px", "54 deg across", 620.0, gt=10.0, source="assumed: an ordinary webcam cropped to 4:3"
    )
    fy_px: float = quantity("px", "square pixels", 620.0, gt=10.0)
    cx_px: float = quantity("px", "a few px off the middle (319.5) as lenses are", 323.4)
    cy_px: float = quantity("px", "a few px off the middle (239.5) as lenses are", 236.8)
    fisheye: bool = Field(
        False,
        description="k1 to k3 are terms of the ray's angle from the axis (a wide lens), not of its tangent",
    )
    k1: float = quantity(
        "", "barrel", -0.16, ge=-50.0, le=50.0, source="half that of OpenCV's samples"
    )
    k2: float = quantity(
        "", "radial, 4th order", 0.04, ge=-50.0, le=50.0, source="assumed: keeps the map monotonic"
    )
    p1: float = quantity(
        "", "decentring", 0.0008, ge=-0.1, le=0.1, source="assumed: of the usual size"
    )
    p2: float = quantity(
        "", "decentring", -0.0005, ge=-0.1, le=0.1, source="assumed: of the usual size"
    )
    k3: float = quantity("", "not needed below 60 deg", 0.0, ge=-50.0, le=50.0)
    k4: float = quantity(
        "", "of a rational lens (wide), as k1 but in the divisor", 0.0, ge=-50.0, le=50.0
    )
    k5: float = quantity("", "the same, 4th order", 0.0, ge=-50.0, le=50.0)
    k6: float = quantity("", "the same, 6th order", 0.0, ge=-50.0, le=50.0)
    shift_degree: int = quantity(
        "", "of the pixel correction by `hil calibrate floor --correct`", 0, ge=0, le=7
    )
    shift_u: tuple[float, ...] = quantity("half widths", "its terms in half widths, for u", ())
    shift_v: tuple[float, ...] = quantity("half widths", "its terms in half widths, for v", ())

    @model_validator(mode="after")
    def _check_kind(self) -> LensConfig:
        """Refuse a quotient for a fisheye, and radial terms that only a quotient has."""
        below = {name: getattr(self, name) for name in ("k4", "k5", "k6")}
        if self.fisheye and any(below.values()):
            name, value = next((n, v) for n, v in below.items() if v)
            raise ValueError(
                f"{name} = {value:g} with fisheye = true: a fisheye has k1, k2 and k3 alone; leave"
                " k4 to k6 at 0, or fisheye at false"
            )
        for name, limit in PLAIN_LIMITS.items():
            if not any(below.values()) and abs(getattr(self, name)) > limit:
                raise ValueError(
                    f"{name} = {getattr(self, name):g}, the limits are {-limit:g} to {limit:g} for a"
                    " lens without k4, k5 and k6"
                )
        return self

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

    eye_m: Vec3 = quantity(
        "m",
        "world: a boom under the ceiling, 19 deg off vertical; 2.0 m x 1.5 m of "
        "floor and the marks above it stay in view with some 5 % to spare",
        (0.0, -0.75, 2.15),
    )
    target_m: Vec3 = quantity("m", "world point in the image centre", (0.0, 0.03, 0.0))
    R_world_cam: tuple[Vec3, Vec3, Vec3] | None = quantity(
        "", "measured rotation, camera to world; overrides target_m", None
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

    colour: Colour = quantity("(ratio)", "reflectance (b, g, r)")
    x_m: float = quantity("m", "body frame, forward of the centre of mass", ge=-1.0, le=1.0)
    y_m: float = quantity("m", "body frame, left of the centre of mass", 0.0, ge=-1.0, le=1.0)


class MarksConfig(Section):
    """The colour marks, two or more; all lie flat at one height above the floor."""

    front: MarkConfig = Field(
        MarkConfig(colour=(0.07, 0.06, 0.62), x_m=0.08), description="matt red paper, front"
    )
    rear: MarkConfig = Field(
        MarkConfig(colour=(0.12, 0.42, 0.08), x_m=-0.08), description="matt green paper, rear"
    )
    more: tuple[MarkConfig, ...] = Field(
        (), max_length=6, description="further marks, so that a covered one does not lose the robot"
    )
    diameter_m: float = quantity(
        "m", "16 px at 640 px: edge enough for 0.01 px of noise", 0.06, ge=0.005, le=0.5
    )
    height_m: float = quantity(
        "m", "over the floor: top of the wheels (2 r = 96 mm) + plate", 0.10, ge=0.0, le=1.0
    )
    ground_ratio_max: float = quantity(
        "(ratio)",
        "brightness of the ground about a mark over its own, at most: on a dark "
        "plate 0.25, in a lamp's reflection 0.7; coloured things on the floor "
        "have 1.5 and more",
        0.85,
        gt=0.0,
        le=100.0,
    )
    which_m: Vec2 | None = quantity(
        "m",
        "world: of several robots alike ours is the one nearest to here when it is first looked "
        "for, later the one nearest to where it is expected; left out: two are one too many",
        None,
    )
    swapped_marks: bool = Field(
        False, description="fault: colours changed over on the robot, the host not told"
    )

    @property
    def all(self) -> tuple[MarkConfig, ...]:
        """Return every mark, front and rear first."""
        return (self.front, self.rear, *self.more)

    @model_validator(mode="after")
    def _more_are_told_apart(self) -> MarksConfig:
        """Refuse a further mark that lies on another or has another's colour."""
        for k in range(2, len(self.all)):
            mark = self.all[k]
            for other in self.all[:k]:
                if math.dist((mark.x_m, mark.y_m), (other.x_m, other.y_m)) <= self.diameter_m:
                    raise ValueError(
                        f"more.{k - 2} lies on the mark at ({other.x_m:g}, {other.y_m:g}) m: centres "
                        f"must be more than diameter_m = {self.diameter_m:g} m apart"
                    )
                if mark.colour == other.colour:
                    raise ValueError(
                        f"more.{k - 2} has the colour of the mark at ({other.x_m:g}, {other.y_m:g}) m; "
                        "every mark needs its own"
                    )
        return self


class TagConfig(Section):
    """An ArUco tag on the plate between the marks, x axis of the tag along body x."""

    dictionary: str = Field("DICT_4X4_50", description="name of the OpenCV dictionary")
    tag_id: int = quantity("", "id in the dictionary", 7, ge=0)
    size_m: float = quantity("m", "black edge to black edge", 0.07, gt=0.0, le=0.5)
    margin_ratio: float = quantity("(ratio)", "white border over size", 0.15, ge=0.0, le=1.0)
    x_m: float = quantity("m", "body frame", 0.0, ge=-1.0, le=1.0)
    y_m: float = quantity("m", "body frame", 0.0, ge=-1.0, le=1.0)


class RobotLookConfig(Section):
    """What the camera sees of the robot besides its marks (twin only)."""

    plate_length_m: float = quantity("m", "covers both wheels' length", 0.26, gt=0.0, le=1.0)
    plate_width_m: float = quantity("m", "between the wheels", 0.16, gt=0.0, le=1.0)
    body_bottom_m: float = quantity("m", "ground clearance", 0.03, ge=0.0, le=1.0, source="assumed")
    wheel_radius_m: float = quantity(
        "m", "radius of a wheel", 0.0482, gt=0.0, le=0.5, source="thesis table 8.3"
    )
    wheel_width_m: float = quantity(
        "m", "width of a wheel", 0.042, gt=0.0, le=0.5, source="assumed: a common toy wheel"
    )
    track_m: float = quantity(
        "m", "distance of left and right wheels", 0.2166, gt=0.0, le=1.0, source="thesis table 8.3"
    )
    wheelbase_m: float = quantity(
        "m",
        "distance of front and rear wheels; 0: one axle",
        0.15,
        ge=0.0,
        le=1.0,
        source="thesis table 8.3, length a",
    )
    axle_x_m: float = quantity(
        "m", "middle of the axles, or the one axle, in the body frame", 0.0, ge=-1.0, le=1.0
    )
    plate_colour: Colour = quantity("(ratio)", "matt black, as a marks' ground", (0.05, 0.05, 0.05))
    side_colour: Colour = quantity("(ratio)", "black in its own shade", (0.09, 0.09, 0.10))
    tyre_colour: Colour = quantity("(ratio)", "rubber", (0.06, 0.06, 0.07))
    hub_colour: Colour = quantity("(ratio)", "yellow plastic", (0.10, 0.45, 0.55))
    board_colour: Colour = quantity("(ratio)", "teal circuit board, Mega 2560", (0.30, 0.26, 0.04))
    board_size_m: Vec2 = quantity(
        "m", "body x and y", (0.0533, 0.1016), source="a Mega 2560 across"
    )
    tag: TagConfig | None = Field(None, description="ArUco tag in the circuit board's place")


class ClutterConfig(Section):
    """A thing on the floor that does not move."""

    shape: Literal["disc", "box"] = Field(
        "disc", description="disc is flat, box stands on the floor"
    )
    x_m: float = quantity("m", "world")
    y_m: float = quantity("m", "world")
    size_m: Vec2 = quantity("m", "disc: diameter twice; box: along its x, y", (0.06, 0.06))
    height_m: float = quantity("m", "of its upper face", 0.0, ge=0.0, le=1.5)
    theta_rad: float = quantity("rad", "turn of a box about z", 0.0)
    colour: Colour = quantity("(ratio)", "reflectance (b, g, r)")


class BarConfig(Section):
    """A straight cable or rod over the robot that covers what lies below it."""

    frame: Literal["world", "body"] = Field("world", description="body: rides on the robot")
    start_m: Vec2 = quantity("m", "one end")
    end_m: Vec2 = quantity("m", "other end")
    width_m: float = quantity("m", "a power cable", 0.008, gt=0.0, le=0.5)
    height_m: float = quantity("m", "over the floor", 0.25, ge=0.0, le=1.5)
    colour: Colour = quantity("(ratio)", "reflectance (b, g, r)", (0.10, 0.10, 0.11))


class ShadowEdgeConfig(Section):
    """A straight shadow edge on floor and robot, as from a window frame or a cupboard."""

    through_m: Vec2 = quantity("m", "world point on the edge", (0.0, 0.0))
    azimuth_rad: float = quantity("rad", "direction of the edge; shade is on its left", 0.6)
    depth_ratio: float = quantity("(ratio)", "share of the light taken away", 0.45, ge=0.0, le=1.0)
    softness_m: float = quantity("m", "from full light to full shade", 0.02, ge=0.0, le=1.0)


class GlareConfig(Section):
    """A lamp mirrored by floor and marks: white light added over a round spot."""

    x_m: float = quantity("m", "world", 0.2)
    y_m: float = quantity("m", "world", 0.1)
    radius_m: float = quantity("m", "standard deviation of the spot", 0.08, gt=0.0, le=2.0)
    peak_dn: float = quantity("DN", "added in its middle", 120.0, ge=0.0, le=1000.0)


class SceneConfig(Section):
    """Floor, light and sensor of the rendered camera (twin only)."""

    floor_colour: Colour = quantity("(ratio)", "warm grey laboratory floor", (0.36, 0.41, 0.44))
    texture_ratio: float = quantity(
        "(ratio)", "RMS speckle of the floor, relative", 0.08, ge=0.0, le=0.5
    )
    texture_seed: int = quantity("", "draws the floor; not tied to the run's seed", 1, ge=0)
    tile_m: float = quantity("m", "between tile joints", 0.5, gt=0.05, le=10.0)
    white_dn: float = quantity(
        "DN", "of a white surface in full light: just not clipped", 225.0, gt=1.0, le=1000.0
    )
    gradient_ratio: float = quantity(
        "(ratio)", "light lost from the bright to the dark side of the image", 0.35, ge=0.0, lt=1.0
    )
    gradient_azimuth_rad: float = quantity("rad", "image direction of the bright side", 0.5)
    read_noise_dn: float = quantity(
        "DN", "RMS", 1.5, ge=0.0, le=10.0, source="a webcam at low gain"
    )
    full_well_e: float = quantity(
        "electrons", "at 255 DN; sets the shot noise", 6000.0, ge=20.0, source="a 3 um pixel"
    )
    blur_px: float = quantity("px", "RMS, optics and demosaicing", 0.6, ge=0.0, le=3.0)
    white_balance: tuple[float, float, float] = quantity(
        "(ratio)", "gain error per channel (b, g, r)", (1.0, 1.0, 1.0)
    )
    lamp_lean: Vec2 = quantity("(ratio)", "horizontal over vertical way to the lamp", (0.35, 0.25))
    robot_shade_ratio: float = quantity(
        "(ratio)", "light the robot takes from the floor beside it", 0.40, ge=0.0, le=1.0
    )
    shadow_edge: ShadowEdgeConfig | None = None
    glare: GlareConfig | None = None
    clutter: tuple[ClutterConfig, ...] = ()
    bars: tuple[BarConfig, ...] = ()


class CameraConfig(Section):
    """Frame source: resolution, timing, optics, pose, and what is in view."""

    width_px: int = quantity(
        "px", "width of a frame", 640, ge=64, le=4096, source="default condition"
    )
    height_px: int = quantity(
        "px", "height of a frame", 480, ge=64, le=4096, source="default condition"
    )
    rate_hz: float = quantity(
        "Hz", "frames per second", 30.0, gt=0.0, le=500.0, source="default condition"
    )
    exposure_s: float = quantity(
        "s", "3 mm of blur at 0.5 m/s", 0.006, gt=0.0, le=0.1, source="indoor light"
    )
    line_time_s: float = quantity(
        "s",
        "rolling shutter: from one row's exposure to the next below, some 30 us; a frame's time is "
        "that of its middle row; 0: all rows at once",
        0.0,
        ge=0.0,
        le=1e-4,
        source="default condition",
    )
    latency_s: float = quantity(
        "s", "middle of exposure to host", 0.060, ge=0.0, le=1.0, source="default condition"
    )
    latency_jitter_s: float = quantity(
        "s", "standard deviation", 0.010, ge=0.0, le=0.5, source="default condition"
    )
    drop_ratio: float = quantity(
        "(ratio)", "share of frames lost", 0.01, ge=0.0, le=1.0, source="default condition"
    )
    search_radius_m: float = quantity(
        "m", "window around the prediction: 0.5 m/s over 4 frames", 0.06, gt=0.0, le=2.0
    )
    localiser: Annotated[str, known_name(LOCALISERS)] = Field(
        "marks", description="what finds the robot: marks, tags, or a file"
    )
    localiser_settings: SerializeAsAny[BaseModel] = Field(
        default_factory=dict, validate_default=True, description="values of the localiser's own"
    )
    controls: ControlsConfig = ControlsConfig()
    lens: LensConfig = LensConfig()
    pose: CameraPoseConfig = CameraPoseConfig()
    marks: MarksConfig = MarksConfig()
    robot_look: RobotLookConfig = RobotLookConfig()
    scene: SceneConfig = SceneConfig()

    @field_validator("localiser_settings", mode="plain")
    @classmethod
    def _of_the_localiser(cls, table: Any, info: ValidationInfo) -> BaseModel:
        return validated(BY_NAME_KEY["camera.localiser"], table, info)

    @property
    def own_settings(self) -> Any:
        """Return the settings of the localiser's own, None where it has none."""
        return own_of(self.localiser_settings)

    @property
    def tag(self) -> TagConfig | None:
        """Return the tag on the robot: the one described, or the default where tags are looked for."""
        tag = self.robot_look.tag
        return TagConfig() if tag is None and self.localiser == "tags" else tag
