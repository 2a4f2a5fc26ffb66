"""The robot: geometry, mass, motors, bridge, battery, friction, encoders, board clock.

Bounds stand here; the numbers and where each one comes from stand in the robot file
(`hil/data/robots/*.toml`), the only place that has them.
"""

from __future__ import annotations

import math
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from hil.config.base import PlainName, Section, quantity, rounded_up
from hil.config.limits import board_table

# Wheels and reflected rotors of one side; the lightest toy has ten times as much.
_LEAST_SIDE_KG_M2 = 1e-5


class MotorConfig(Section):
    """One geared motor (2.11); torques are at the gearbox output, electrical constants at the rotor."""

    per_side: int = quantity("motors", "motors in parallel on one bridge channel", ge=1, le=4)
    resistance_ohm: float = quantity("ohm", "winding resistance R", gt=0, le=100)
    inductance_h: float = quantity("H", "winding inductance L", ge=1e-4, le=0.1)
    torque_constant_n_m_a: float = quantity("N m/A", "k_t, at the rotor", gt=0, le=1)
    emf_constant_v_s_rad: float = quantity("V s/rad", "k_b, at the rotor", gt=0, le=1)
    gear_ratio: float = quantity("(ratio)", "N, rotor turns for one wheel turn", ge=1, le=500)
    gear_efficiency_ratio: float = quantity(
        "(ratio)", "eta_g, share of torque passed on", gt=0, le=1
    )
    rotor_inertia_kg_m2: float = quantity(
        "kg m^2", "inertia of the rotor, rotor side", ge=0, le=1e-3
    )
    coulomb_n_m: float = quantity("N m", "friction torque while turning", ge=0, le=2)
    stiction_n_m: float = quantity("N m", "friction torque just before turning", ge=0, le=2)
    stribeck_rad_s: float = quantity("rad/s", "speed at which half the excess is gone", gt=0, le=20)
    viscous_n_m_s_rad: float = quantity("N m s/rad", "friction torque per wheel speed", ge=0, le=1)

    @model_validator(mode="after")
    def _stiction_not_below_coulomb(self) -> Self:
        if self.stiction_n_m < self.coulomb_n_m:
            raise ValueError(f"stiction_n_m must be at least coulomb_n_m = {self.coulomb_n_m} N m")
        return self


class BridgeConfig(Section):
    """H-bridge channel; the voltage it drops opposes the channel's current."""

    drop_v: float = quantity("V", "part of the drop that does not depend on current", ge=0, le=5)
    resistance_ohm: float = quantity("ohm", "rise of the drop with channel current", ge=0, le=10)
    smoothing_a: float = quantity("A", "current over which the drop builds up", ge=0.05, le=5)


class BatteryConfig(Section):
    """Open-circuit voltage straight in the charge, behind one resistance."""

    full_v: float = quantity("V", "open-circuit voltage at charge 1", gt=0, le=60)
    empty_v: float = quantity("V", "open-circuit voltage at charge 0 (of the line)", gt=0, le=60)
    capacity_a_h: float = quantity("A h", "charge from full to empty", gt=0, le=100)
    resistance_ohm: float = quantity("ohm", "cells, plug and leads", ge=0, le=5)
    charge_start_ratio: float = quantity("(ratio)", "charge when the run begins", gt=0, le=1)
    idle_a: float = quantity("A", "current of board, radio and encoders", ge=0, le=10)

    @model_validator(mode="after")
    def _empties(self) -> Self:
        if self.empty_v > self.full_v:
            raise ValueError(f"empty_v must be at most full_v = {self.full_v:g} V")
        return self


class FloorConfig(Section):
    """Contact of the wheels with the floor; signs of speeds are smoothed as v / sqrt(v^2 + v_s^2)."""

    rolling_ratio: float = quantity("(ratio)", "f_r, rolling resistance over load", ge=0, le=0.5)
    friction_ratio: float = quantity("(ratio)", "mu, sliding friction over load", ge=0, le=2)
    smoothing_m_s: float = quantity(
        "m/s", "v_s of the model with the operative constraint", ge=0.0005, le=0.05
    )
    slip_smoothing_m_s: float = quantity(
        "m/s", "v_s of the slip variant: creep of the tyre under load", ge=0.002, le=0.05
    )


_COUNTS = board_table()["ENC_COUNTS"]
Magnitude = Annotated[float, Field(ge=0, le=1000)]
Sides = tuple[Magnitude, Magnitude]


class BringUpConfig(Section):
    """What `hil bringup` measured with the wheels off the ground, (left, right) magnitudes."""

    dead_duty_forward: Sides = quantity("(ratio)", "duty at which the wheels start, forward")
    dead_duty_backward: Sides = quantity("(ratio)", "the same backward")
    top_speed_forward_rad_s: Sides = quantity("rad/s", "wheel speed at full duty, forward")
    top_speed_backward_rad_s: Sides = quantity("rad/s", "the same backward")
    battery_v: float = quantity("V", "battery at full speed", gt=0, le=60)


class RobotConfig(Section):
    """A four-wheel skid-steer robot, two driven wheels a side (docs/twin.md)."""

    name: PlainName = Field(min_length=1, max_length=60, description="of the robot, for people")
    variant: Literal["constrained", "slip", "lifted"] = Field(
        description="constrained: eta2 = -d0 theta_dot (2.31) and rolling wheels; slip: neither; "
        "lifted: on blocks, the wheels turn freely"
    )
    mass_kg: float = quantity("kg", "m, whole robot", ge=0.5, le=50)
    inertia_kg_m2: float = quantity(
        "kg m^2", "I about the vertical through the centre", ge=0.002, le=10
    )
    wheel_radius_m: float = quantity("m", "r, of a wheel", ge=0.01, le=0.5)
    track_m: float = quantity("m", "W, distance of left and right wheels", ge=0.05, le=2)
    front_axle_m: float = quantity("m", "a_f, centre of mass to front axle", ge=0.01, le=2)
    rear_axle_m: float = quantity("m", "b, centre of mass to rear axle", ge=0.01, le=2)
    d0_m: float = quantity("m", "d0 of the operative constraint (2.31)", ge=0.005, le=1)
    wheel_inertia_kg_m2: float = quantity("kg m^2", "one wheel about its axle", ge=0, le=0.1)
    encoder_counts_per_turn: int = quantity(
        "counts/turn",
        "x4 counts a wheel turn; bounds are the board's (ENC_COUNTS)",
        ge=math.ceil(_COUNTS.minimum),
        le=math.floor(_COUNTS.maximum),
    )
    board_clock_ppm: float = quantity(
        "ppm", "board clock fast against true time", ge=-10_000, le=10_000
    )
    motor: MotorConfig
    bridge: BridgeConfig
    battery: BatteryConfig
    floor: FloorConfig
    bring_up: BringUpConfig | None = Field(None, description="measured, for people to compare with")

    @property
    def no_load_rad_s(self) -> float:
        """Return the wheel speed at which the motors' voltage is the full battery's."""
        motor = self.motor
        return self.battery.full_v / (motor.emf_constant_v_s_rad * motor.gear_ratio)

    @model_validator(mode="after")
    def _current_slow_enough(self) -> Self:
        """RK4 at 1e-4 s is stable up to rates of 27,850 1/s; refuse a robot that comes near."""
        channel_ohm = self.bridge.resistance_ohm + self.bridge.drop_v / self.bridge.smoothing_a
        rate = self.motor.resistance_ohm + self.motor.per_side * channel_ohm
        if rate / self.motor.inductance_h > 20_000:
            least_h = rate / 20_000
            raise ValueError(
                f"motor.inductance_h must be at least {rounded_up(least_h)} H at these drops"
            )
        return self

    @model_validator(mode="after")
    def _sides_have_inertia(self) -> Self:
        """Wheels that turn by themselves are divided by it; less than this RK4 cannot follow."""
        motor = self.motor
        rotors = motor.per_side * motor.gear_ratio**2 * motor.rotor_inertia_kg_m2
        side = rotors + 2.0 * self.wheel_inertia_kg_m2
        if self.variant != "constrained" and side < _LEAST_SIDE_KG_M2:
            raise ValueError(
                f"wheel_inertia_kg_m2 and motor.rotor_inertia_kg_m2 give a side {side:.2g} kg m^2, "
                f"variant {self.variant} needs at least {_LEAST_SIDE_KG_M2:g} kg m^2"
            )
        return self

    @model_validator(mode="after")
    def _pivot_inside_the_wheelbase(self) -> Self:
        wheelbase_m = self.front_axle_m + self.rear_axle_m
        if self.d0_m >= wheelbase_m:
            raise ValueError(f"d0_m must be below the wheelbase of {wheelbase_m:.3f} m (2.31)")
        return self
