"""The robot: geometry, mass, motors, bridge, battery, friction, encoders, board clock.

Bounds stand here; the numbers and where each one comes from stand in the robot file
(`hil/data/robots/*.toml`), the only place that has them.
"""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from hil.config.base import Section, rounded_up

# Wheels and reflected rotors of one side; the lightest toy has ten times as much.
_LEAST_SIDE_KG_M2 = 1e-5


class MotorConfig(Section):
    """One geared motor (2.11); torques are at the gearbox output, electrical constants at the rotor."""

    per_side: int = Field(ge=1, le=4, description="motors in parallel on one bridge channel")
    resistance_ohm: float = Field(gt=0, le=100, description="winding resistance R")
    inductance_h: float = Field(ge=1e-4, le=0.1, description="winding inductance L")
    torque_constant_n_m_a: float = Field(gt=0, le=1, description="k_t, N m per A at the rotor")
    emf_constant_v_s_rad: float = Field(gt=0, le=1, description="k_b, V s per rad at the rotor")
    gear_ratio: float = Field(ge=1, le=500, description="N, rotor turns for one wheel turn")
    gear_efficiency_ratio: float = Field(gt=0, le=1, description="eta_g, share of torque passed on")
    rotor_inertia_kg_m2: float = Field(
        ge=0, le=1e-3, description="inertia of the rotor, rotor side"
    )
    coulomb_n_m: float = Field(ge=0, le=2, description="friction torque while turning")
    stiction_n_m: float = Field(ge=0, le=2, description="friction torque just before turning")
    stribeck_rad_s: float = Field(gt=0, le=20, description="speed at which half the excess is gone")
    viscous_n_m_s_rad: float = Field(ge=0, le=1, description="friction torque per wheel speed")

    @model_validator(mode="after")
    def _stiction_not_below_coulomb(self) -> Self:
        if self.stiction_n_m < self.coulomb_n_m:
            raise ValueError(f"stiction_n_m must be at least coulomb_n_m = {self.coulomb_n_m} N m")
        return self


class BridgeConfig(Section):
    """H-bridge channel; the voltage it drops opposes the channel's current."""

    drop_v: float = Field(
        ge=0, le=5, description="part of the drop that does not depend on current"
    )
    resistance_ohm: float = Field(ge=0, le=10, description="rise of the drop with channel current")
    smoothing_a: float = Field(ge=0.05, le=5, description="current over which the drop builds up")


class BatteryConfig(Section):
    """Open-circuit voltage straight in the charge, behind one resistance."""

    full_v: float = Field(gt=0, le=60, description="open-circuit voltage at charge 1")
    empty_v: float = Field(
        gt=0, le=60, description="open-circuit voltage at charge 0 (of the line)"
    )
    capacity_a_h: float = Field(gt=0, le=100, description="charge from full to empty")
    resistance_ohm: float = Field(ge=0, le=5, description="cells, plug and leads")
    charge_start_ratio: float = Field(gt=0, le=1, description="charge when the run begins")
    idle_a: float = Field(ge=0, le=10, description="current of board, radio and encoders")


class FloorConfig(Section):
    """Contact of the wheels with the floor; signs of speeds are smoothed as v / sqrt(v^2 + v_s^2)."""

    rolling_ratio: float = Field(ge=0, le=0.5, description="f_r, rolling resistance over load")
    friction_ratio: float = Field(ge=0, le=2, description="mu, sliding friction over load")
    smoothing_m_s: float = Field(
        ge=0.0005, le=0.05, description="v_s of the model with the operative constraint"
    )
    slip_smoothing_m_s: float = Field(
        ge=0.002, le=0.05, description="v_s of the slip variant: creep of the tyre under load"
    )


Magnitude = Annotated[float, Field(ge=0, le=1000)]
Sides = tuple[Magnitude, Magnitude]


class BringUpConfig(Section):
    """What `hil bringup` measured with the wheels off the ground, (left, right) magnitudes."""

    dead_duty_forward: Sides = Field(description="duty at which the wheels start, forward")
    dead_duty_backward: Sides = Field(description="the same backward")
    top_speed_forward_rad_s: Sides = Field(description="wheel speed at full duty, forward")
    top_speed_backward_rad_s: Sides = Field(description="the same backward")
    battery_v: float = Field(gt=0, le=60, description="battery at full speed")


class RobotConfig(Section):
    """A four-wheel skid-steer robot, two driven wheels a side (control.md section 1)."""

    name: str = Field(min_length=1, max_length=60)
    variant: Literal["constrained", "slip", "lifted"] = Field(
        description="constrained: eta2 = -d0 theta_dot (2.31) and rolling wheels; slip: neither; "
        "lifted: on blocks, the wheels turn freely"
    )
    mass_kg: float = Field(ge=0.5, le=50, description="m")
    inertia_kg_m2: float = Field(
        ge=0.002, le=10, description="I about the vertical through the centre"
    )
    wheel_radius_m: float = Field(ge=0.01, le=0.5, description="r")
    track_m: float = Field(ge=0.05, le=2, description="W, distance of left and right wheels")
    front_axle_m: float = Field(ge=0.01, le=2, description="a_f, centre of mass to front axle")
    rear_axle_m: float = Field(ge=0.01, le=2, description="b, centre of mass to rear axle")
    d0_m: float = Field(ge=0.005, le=1, description="d0 of the operative constraint (2.31)")
    wheel_inertia_kg_m2: float = Field(ge=0, le=0.1, description="one wheel about its axle")
    encoder_counts_per_turn: int = Field(ge=4, le=100_000, description="x4 counts a wheel turn")
    board_clock_ppm: float = Field(
        ge=-10_000, le=10_000, description="board clock fast against true time, parts per million"
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
