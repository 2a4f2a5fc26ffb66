"""The scenario: everything a run needs to know, in one validated tree."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Literal, Self

from pydantic import AfterValidator, Field, SerializeAsAny, field_validator, model_validator

from hil.config.base import PlainName, Section, quantity
from hil.config.camera import CameraConfig
from hil.config.control import ControlConfig, ReferenceConfig
from hil.config.events import Disturbance, Fault
from hil.config.limits import check_board
from hil.config.link import LinkConfig
from hil.config.robot import RobotConfig
from hil.core.errors import BadInput
from hil.core.figures import BY_NAME, metric_of, require_known
from hil.core.registries import Sources, adopt_sources, file_sources


class StartPose(Section):
    """Where the robot stands, at rest, when the run begins (world frame, centre of mass)."""

    x_m: float = quantity("m", "world X of the centre of mass", ge=-50, le=50)
    y_m: float = quantity("m", "world Y of the centre of mass", ge=-50, le=50)
    theta_rad: float = quantity("rad", "heading, counter-clockwise from world +X", ge=-7, le=7)


def _figure(name: str) -> str:
    try:
        return require_known(name)
    except BadInput as error:
        raise ValueError(str(error)) from None


# The name of a figure of merit; a file becomes the name of the figure in it.
FigureName = Annotated[str, AfterValidator(_figure)]


class Requirement(Section):
    """One figure of the run that must hold; the verdict is pass when min <= value <= max."""

    metric: FigureName = Field(description="figure of metrics.json, or FILE.py[:NAME] that has one")
    min: float | None = quantity("", "lowest value that holds, in the figure's unit", None)
    max: float | None = quantity("", "highest value that holds, in the figure's unit", None)

    @classmethod
    def unit_of(cls, name: str, table: Mapping[str, Any]) -> str:
        """Return the unit of a value; a bound has that of its figure."""
        if name not in {"min", "max"}:
            return super().unit_of(name, table)
        try:
            return metric_of(str(table.get("metric"))).unit
        except BadInput:
            return super().unit_of(name, table)

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


Reaction = Literal["stop", "warn"]


class ReactionsConfig(Section):
    """What the host does about each fault that it finds implausible (hil.runs.watching)."""

    motor_stuck: Reaction = Field("stop", description="a side creeps at high PWM")
    encoder_intermittent: Reaction = Field("stop", description="counts of a side come and go")
    frames_repeated: Reaction = Field("stop", description="the same picture again and again")
    sides_swapped: Reaction = Field("stop", description="the wheels turn the other way round")
    no_progress: Reaction = Field("stop", description="the goal does not come nearer")


class SafetyConfig(Section):
    """When the host stops the robot by itself."""

    pose_lost_s: float = quantity("s", "no accepted pose for this long", 0.7, gt=0, le=10)
    link_lost_s: float = quantity("s", "no wheel report for this long", 0.5, gt=0, le=10)
    fence_x_min_m: float = quantity("m", "geofence of the centre of mass, world X", -1.0)
    fence_x_max_m: float = quantity("m", "geofence of the centre of mass, world X", 1.0)
    fence_y_min_m: float = quantity("m", "geofence of the centre of mass, world Y", -0.75)
    fence_y_max_m: float = quantity("m", "geofence of the centre of mass, world Y", 0.75)

    reactions: ReactionsConfig = Field(
        default_factory=ReactionsConfig, description="stop, or warn and go on, fault by fault"
    )

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

    name: PlainName = Field(min_length=1, max_length=80, description="names the record's folder")
    description: str = Field("", description="one sentence for the reports")
    duration_s: float = quantity("s", "length of the controlled part", gt=0, le=36_000)
    start: StartPose
    reference: SerializeAsAny[ReferenceConfig]
    figures: tuple[FigureName, ...] = Field(
        (), description="figures of merit beside the built-in ones: names, or FILE.py[:NAME]"
    )
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

    @field_validator("board")
    @classmethod
    def _the_board_takes_them(cls, values: dict[str, float]) -> dict[str, float]:
        """Raise BadInput for a parameter that the board does not have, or not with that value."""
        check_board(values)
        return values

    @property
    def own_figures(self) -> tuple[str, ...]:
        """Return the names of the figures that are asked for beside the built-in ones, each once."""
        asked = (*self.figures, *(item.metric for item in self.requirements))
        return tuple(name for name in dict.fromkeys(asked) if name not in BY_NAME)

    def __reduce__(self) -> Any:
        """Pickle with the texts of what came from files: another process gets to know it by them."""
        sources = file_sources()
        if not sources:
            return super().__reduce__()
        return _unpickled, (self.model_dump(mode="json"), sources)


def _unpickled(tree: dict[str, Any], sources: Sources) -> Scenario:
    adopt_sources(sources)
    return Scenario.model_validate(tree)
