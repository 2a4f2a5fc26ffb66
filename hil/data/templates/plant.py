"""A motion of one's own for a simulated robot.

    hil run scenario-1 --set robot.plant=./my-thing.py

Once a tick of the board (4 ms) it is given the motors' voltages and answers with pose, speeds and wheel
angles. Frames: world X right, Y up, theta counter-clockwise from +X; body x forward, y left, origin at the
centre of mass; a positive voltage turns a wheel forward. All of the exchange: docs/own-plant.md.

As it stands, wheels follow their voltage with a lag and the robot rolls without slip.
"""

import math
from collections.abc import Mapping
from typing import Any

from hil import serve_plant


class MyThing:
    """Wheels that follow their voltage with a lag, on a robot that rolls without slip."""

    takes = ("load_left_n_m",)  # what it knows of docs/twin.md's disturbances

    def reset(
        self, robot: Mapping[str, Any], start: Mapping[str, float], dt_s: float, seed: int
    ) -> None:
        """Stand at rest at `start` (x_m, y_m, theta_rad); draw from `seed` alone, if at all."""
        del dt_s, seed
        # robot: the robot file as a dictionary; start: pose at rest, wheel angles zero.
        self.r, self.track, self.d0 = robot["wheel_radius_m"], robot["track_m"], robot["d0_m"]
        motor = robot["motor"]
        self.rad_s_per_v = 1 / (motor["emf_constant_v_s_rad"] * motor["gear_ratio"])
        self.x, self.y, self.theta = start["x_m"], start["y_m"], start["theta_rad"]
        self.omega, self.angle = [0.0, 0.0], [0.0, 0.0]

    def step(
        self, volts: tuple[float, float], dt_s: float, loads: Mapping[str, float]
    ) -> dict[str, float]:
        """Move on by `dt_s` and return the state then."""
        # volts: left, right, held for dt_s; loads: the disturbances of `takes` in force now.
        share = 1 - math.exp(-dt_s / 0.08)  # lag of 80 ms
        for side in (0, 1):
            lost = 5.0 * loads.get("load_left_n_m", 0.0) if side == 0 else 0.0
            goal = self.rad_s_per_v * volts[side] - lost
            self.omega[side] += share * (goal - self.omega[side])
            self.angle[side] += dt_s * self.omega[side]
        left, right = (self.r * omega for omega in self.omega)
        forward, turn = (left + right) / 2, (right - left) / self.track
        middle = self.theta + dt_s * turn / 2
        lateral = -self.d0 * turn  # the point d0 ahead has no lateral speed
        self.x += dt_s * (forward * math.cos(middle) - lateral * math.sin(middle))
        self.y += dt_s * (forward * math.sin(middle) + lateral * math.cos(middle))
        self.theta += dt_s * turn
        return {
            "x_m": self.x,
            "y_m": self.y,
            "theta_rad": self.theta,
            "eta1_m_s": forward,
            "eta2_m_s": lateral,
            "theta_dot_rad_s": turn,
            "wheel_left_rad": self.angle[0],
            "wheel_right_rad": self.angle[1],
        }


if __name__ == "__main__":
    serve_plant(MyThing())  # or serve_plant(MyThing(), port=5555)
