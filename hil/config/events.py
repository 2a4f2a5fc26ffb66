"""Disturbances and faults: timed, seeded scenario data. Times count from the controlled part's begin.

Exchanged colour marks are no event but a property of the robot: `camera.marks.swapped_marks`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, Literal, Self

from pydantic import Field, model_validator

from hil.config.base import Section, quantity

# On what a disturbance acts; TARGET_UNITS has the unit of its amplitude.
# eta2_dot under the operative constraint acts as theta_ddot = -eta2_dot / d0 (2.31).
Target = Literal[
    "eta1_dot_m_s2",  # body forward acceleration
    "eta2_dot_m_s2",  # lateral acceleration (2.34)
    "theta_ddot_rad_s2",  # yaw acceleration
    "force_forward_n",  # push along body x
    "force_left_n",  # push along body y
    "torque_yaw_n_m",  # twist about the vertical
    "load_left_n_m",  # torque on the left wheels, positive pushes backward, also at rest
    "load_right_n_m",  # torque on the right wheels, positive pushes backward, also at rest
    "brake_left_n_m",  # brake on the left wheels: opposes their motion, whichever way
    "brake_right_n_m",  # brake on the right wheels: opposes their motion, whichever way
    "slope_x_rad",  # floor rises along world X
    "slope_y_rad",  # floor rises along world Y
    "friction_change_ratio",  # added to 1, scales rolling and sliding friction; from -1 on none
    "battery_sag_v",  # taken off the battery voltage, which stays above 0
]
TARGET_UNITS: Mapping[str, str] = {
    "eta1_dot_m_s2": "m/s^2", "eta2_dot_m_s2": "m/s^2", "theta_ddot_rad_s2": "rad/s^2",
    "force_forward_n": "N", "force_left_n": "N", "torque_yaw_n_m": "N m",
    "load_left_n_m": "N m", "load_right_n_m": "N m", "brake_left_n_m": "N m",
    "brake_right_n_m": "N m", "slope_x_rad": "rad", "slope_y_rad": "rad",
    "friction_change_ratio": "(ratio)", "battery_sag_v": "V",
}  # fmt: skip
# Constant amplitudes below these would drive what they are named to resist.
LEAST_STEP: dict[str, tuple[float, str]] = {
    "friction_change_ratio": (-1.0, "no friction is left at -1"),
    "brake_left_n_m": (0.0, "a brake opposes motion; load_left_n_m drives"),
    "brake_right_n_m": (0.0, "a brake opposes motion; load_right_n_m drives"),
}
Shape = Literal["sine", "step", "pulse", "noise"]
FaultKind = Literal[
    "dead_encoder",  # both channels of one side stay as they are
    "dead_channel_a",
    "dead_channel_b",
    "swapped_phases",  # A and B exchanged: counts run backward
    "encoder_noise",  # a pulse of 0.1 ms on both channels of one side every millisecond
    "gear_slip",  # the motor turns on, with its encoder: strength_ratio of its turn reaches the wheel
    "motor_reversed",  # polarity of one side's motors
    "motor_stuck",  # one side's gears jam
    "motor_weak",  # a share of the voltage reaches one side's motors: strength_ratio
    "motors_exchanged",  # leads of left and right motors
    "encoders_exchanged",  # plugs of left and right encoders
    "board_reset",  # board held in reset from start to end, then boots anew
    "link_cut",  # nothing passes either way
    "link_down_cut",  # half open: nothing reaches the board
    "link_up_cut",  # half open: nothing reaches the host
    "link_duplicated",  # every chunk arrives twice, both ways
    "link_reordered",  # of two chunks the second one arrives first, both ways
    "camera_stall",  # no frames
    "camera_occluded",  # robot hidden from the camera
    "camera_repeated",  # frames keep coming with new stamps, each a copy of the last one
    "camera_clock_step",  # stamps step by step_s
    "camera_exposure",  # the light on the sensor is light_ratio of what it was
    "camera_colours",  # red and blue exchanged: another order of bytes than the driver says
    "camera_mark_covered",  # the front mark is as black as the plate
    "camera_second_robot",  # one that looks the same, at (x_m, y_m), heading along world X
    "host_stopped",  # the host's process does not run (SIGSTOP, a suspended machine)
    "host_overloaded",  # the host's process gets to run only once in late_s
    "host_clock_step",  # the host's clock steps by step_s
]
# Faults of a picture: without one (--camera pose) they cannot be.
OF_PICTURES = (
    "camera_exposure",
    "camera_colours",
    "camera_mark_covered",
    "camera_second_robot",
)
SIDED = {
    "dead_encoder",
    "dead_channel_a",
    "dead_channel_b",
    "swapped_phases",
    "encoder_noise",
    "gear_slip",
    "motor_reversed",
    "motor_stuck",
    "motor_weak",
}


class Zone(Section):
    """A round piece of floor; its edge is 1 cm soft."""

    x_m: float = quantity("m", "world X of the centre", ge=-50, le=50)
    y_m: float = quantity("m", "world Y of the centre", ge=-50, le=50)
    radius_m: float = quantity("m", "radius of the zone", ge=0.02, le=50)


class Disturbance(Section):
    """One disturbance in force from `start_s` to `end_s`.

    sine: amplitude sin(2 pi frequency (t - start) + phase); step: amplitude; pulse: half a sine
    from start to end; noise: seeded, standard deviation `amplitude`, band up to `frequency_hz`.
    Friction below none, a brake below 0 and a battery below 0 V count as 0.
    """

    target: Target = Field(description="what it acts on")
    shape: Shape = Field(description="its course in time")
    amplitude: float = quantity("", "in the unit of the target", ge=-1000, le=1000)
    start_s: float = quantity("s", "in force from then on", 0.0, ge=0, le=3600)
    end_s: float | None = quantity("s", "None: to the end of the run", None, gt=0, le=3600)
    frequency_hz: float = quantity("Hz", "of the sine, or top of the noise", 0.5, gt=0, le=200)
    phase_rad: float = quantity("rad", "of the sine", 0.0, ge=-7, le=7)
    seed: int | None = quantity(
        "",
        "of the noise, with the seed of the run; None: its own, from its place in the list. Noises "
        "of one seed and frequency are one signal",
        None,
        ge=0,
        le=2**31 - 1,
    )
    zone: Zone | None = Field(None, description="acts only while the centre of mass is in there")

    @classmethod
    def unit_of(cls, name: str, table: Mapping[str, Any]) -> str:
        """Return the unit of a value; that of the amplitude is its target's."""
        if name == "amplitude":
            return TARGET_UNITS.get(str(table.get("target")), "")
        return super().unit_of(name, table)

    @model_validator(mode="after")
    def _ends_after_start(self) -> Self:
        _check_times(self.start_s, self.end_s)
        if self.shape == "pulse" and self.end_s is None:
            raise ValueError("a pulse needs end_s")
        least, why = LEAST_STEP.get(self.target, (-math.inf, ""))
        if self.shape == "step" and self.amplitude < least:
            raise ValueError(
                f"amplitude {self.amplitude:g} of {self.target} must be at least {least:g}: {why}"
            )
        return self


class Fault(Section):
    """One fault in force from `start_s` to `end_s`; with `start_s` 0 it is there from power-up on."""

    kind: FaultKind = Field(description="what breaks")
    side: Literal["left", "right", "both"] = Field("both", description="of encoders and motors")
    start_s: float = quantity("s", "in force from then on; 0: from power-up", 0.0, ge=0, le=3600)
    end_s: float | None = quantity("s", "None: to the end of the run", None, gt=0, le=3600)
    strength_ratio: float = quantity(
        "(ratio)",
        "of motor_weak: what is left of its voltage; of gear_slip: of its turn",
        0.4,
        gt=0,
        le=1,
    )
    light_ratio: float = quantity(
        "(ratio)", "of camera_exposure: light on the sensor over what it was", 3.0, ge=0, le=100
    )
    step_s: float = quantity("s", "of a clock that steps; negative: back", 5.0, ge=-3600, le=3600)
    late_s: float = quantity("s", "of host_overloaded: from run to run", 0.1, gt=0, le=60)
    x_m: float = quantity("m", "of camera_second_robot: where it stands", 0.0, ge=-50, le=50)
    y_m: float = quantity("m", "of camera_second_robot: where it stands", 0.0, ge=-50, le=50)

    @model_validator(mode="after")
    def _is_consistent(self) -> Self:
        _check_times(self.start_s, self.end_s)
        if self.kind not in SIDED and self.side != "both":
            raise ValueError(f"side: {self.kind} has no side")
        if self.kind == "host_stopped" and (self.end_s is None or self.start_s == 0.0):
            raise ValueError("host_stopped needs end_s, and a start_s above 0: who would go on?")
        return self


def _check_times(start_s: float, end_s: float | None) -> None:
    if end_s is not None and end_s <= start_s:
        raise ValueError(f"end_s must be after start_s = {start_s} s")
