"""The scenario: everything a run needs to know, in one validated tree."""

from __future__ import annotations

from typing import Literal, Self

from pydantic import Field, field_validator, model_validator

from hil.config.base import Section
from hil.config.camera import CameraConfig
from hil.config.control import ControlConfig, ReferenceConfig
from hil.config.events import Disturbance, Fault
from hil.config.link import LinkConfig
from hil.config.robot import RobotConfig
from hil.core.errors import BadInput
from hil.text import is_plain_name


class StartPose(Section):
    """Where the robot stands, at rest, when the run begins (world frame, centre of mass)."""

    x_m: float = Field(ge=-50, le=50, description="world X of the centre of mass")
    y_m: float = Field(ge=-50, le=50, description="world Y of the centre of mass")
    theta_rad: float = Field(ge=-7, le=7, description="heading, counter-clockwise from world +X")


class Requirement(Section):
    """One figure of the run that must hold; the verdict is pass when min <= value <= max."""

    metric: str = Field(description="name of a figure of metrics.json")
    min: float | None = Field(None, description="lowest value that holds, in the figure's unit")
    max: float | None = Field(None, description="highest value that holds, in the figure's unit")

    @field_validator("metric")
    @classmethod
    def _is_a_figure(cls, name: str) -> str:
        # Here and not above: numpy costs the command line a tenth of a second it seldom needs.
        from hil.analysis.metrics import require_known  # noqa: PLC0415

        try:
            return require_known(name)
        except BadInput as error:
            raise ValueError(str(error)) from None

    @model_validator(mode="after")
    def _can_hold_and_fail(self) -> Self:
        if self.min is None and self.max is None:
            raise ValueError(
                f"{self.metric} has neither min nor max: it would always hold; give one"
            )
        if self.min is not None and self.max is not None and self.min > self.max:
            raise ValueError(
                f"{self.metric}: min = {self.min:g} is above max = {self.max:g}: it could never hold"
            )
        return self


class SafetyConfig(Section):
    """When the host stops the robot by itself."""

    pose_lost_s: float = Field(0.7, gt=0, le=10, description="no accepted pose for this long")
    link_lost_s: float = Field(0.5, gt=0, le=10, description="no wheel report for this long")
    fence_x_min_m: float = Field(-1.0, description="geofence of the centre of mass, world X")
    fence_x_max_m: float = Field(1.0, description="geofence of the centre of mass, world X")
    fence_y_min_m: float = Field(-0.75, description="geofence of the centre of mass, world Y")
    fence_y_max_m: float = Field(0.75, description="geofence of the centre of mass, world Y")

    @model_validator(mode="after")
    def _fence_has_an_inside(self) -> Self:
        for axis in "xy":
            low, high = (getattr(self, f"fence_{axis}_{end}_m") for end in ("min", "max"))
            if low >= high:
                raise ValueError(
                    f"fence_{axis}_min_m = {low:g} m must be below fence_{axis}_max_m = {high:g} m"
                )
        return self


class Scenario(Section):
    """One experiment: the same tree runs on every target."""

    name: str = Field(min_length=1, max_length=80)
    description: str = ""
    duration_s: float = Field(gt=0, le=3600, description="length of the controlled part")
    start: StartPose
    reference: ReferenceConfig
    requirements: tuple[Requirement, ...] = ()
    robot: RobotConfig
    mismatch: dict[str, float] = Field(
        default_factory=dict,
        description="true value / believed value by dotted robot key; simulated robots only",
    )
    board: dict[str, float] = Field(
        default_factory=dict, description="board parameters that differ from their defaults"
    )
    camera_source: Literal["rendered", "pose"] = Field(
        "rendered", description="what a simulated target sees with unless --camera says otherwise"
    )
    camera: CameraConfig
    link: LinkConfig
    control: ControlConfig
    safety: SafetyConfig = SafetyConfig()
    disturbances: tuple[Disturbance, ...] = ()
    faults: tuple[Fault, ...] = ()

    @field_validator("name")
    @classmethod
    def _names_a_folder(cls, name: str) -> str:
        if not is_plain_name(name):
            raise ValueError("names the folder of a record: no / or \\, nothing that does not show")
        return name
