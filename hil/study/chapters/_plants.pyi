"""Quadrotor and underwater vehicles, compiled from hil/study/chapters/native.

SI units. Attributes of the plants are the names in ..._PARAMETERS, all floats, all 0 at first.
Samples are rows of the names in ..._COLUMNS, one after the other.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

QUADROTOR_PARAMETERS: tuple[str, ...]
VEHICLE5_PARAMETERS: tuple[str, ...]
VEHICLE6_PARAMETERS: tuple[str, ...]
QUADROTOR_COLUMNS: tuple[str, ...]
VEHICLE5_COLUMNS: tuple[str, ...]
VEHICLE6_COLUMNS: tuple[str, ...]

State = list[float]
Matrix = list[list[float]]

class Outcome:
    """Integrals, peaks and end of one run; `late` is after the settling time."""

    ise: float
    ise_late: float
    worst_late: float
    worst_end: float
    cost_late: float
    effort: float
    effort_early: float
    peak_early: float
    peak_late: float
    peak: float
    tilt_late: float
    integral_cost: float
    rate_rms: float
    s_max: list[float]
    end_s: float
    @property
    def end(self) -> str:
        """complete, tumbled, diverged or not finite."""
    @property
    def samples(self) -> NDArray[np.float64]:
        """All samples, flat."""

class _Plant:
    def __setattr__(self, name: str, value: float, /) -> None: ...
    def __getattr__(self, name: str, /) -> float: ...

class Quadrotor(_Plant):
    """World z up; angles psi, theta, phi; state: position, velocity, angles, rates, motors."""

    def matrices(
        self, angle_rad: Sequence[float], rate_rad_s: Sequence[float]
    ) -> tuple[Matrix, Matrix]:
        """Return the inertia matrix M and C of the rotation."""
    def rates(self, state: Sequence[float], thrust_n: float, torque_n_m: Sequence[float]) -> State:
        """Return d/dt of the 16 states."""
    def step(
        self, state: Sequence[float], thrust_n: float, torque_n_m: Sequence[float], dt_s: float
    ) -> State:
        """Return the state dt_s later (RK4)."""
    def energy(self, state: Sequence[float]) -> float:
        """Return kinetic and potential energy in J."""
    def reference(self, t_s: float) -> Matrix:
        """Return position, velocity and acceleration wanted."""

class Vehicle5(_Plant):
    """State: X, Y, Z, theta, psi, u, v, w, q, r, three motor currents."""

    def rates(self, t_s: float, state: Sequence[float], torque: Sequence[float]) -> State:
        """Return d/dt of the 13 states."""
    def step(
        self, t_s: float, state: Sequence[float], torque: Sequence[float], dt_s: float
    ) -> State:
        """Return the state dt_s later (RK4)."""
    def energy(self, state: Sequence[float]) -> float:
        """Return kinetic and righting energy in J."""
    def reference(self, t_s: float) -> Matrix:
        """Return position, velocity and acceleration wanted."""

class Vehicle6(_Plant):
    """State: x, y, z, quaternion (scalar first), u, v, w, p, q, r; world z down."""

    def coriolis(self, speed: Sequence[float]) -> Matrix:
        """Return C of (2.16) with C21 repaired."""
    def damping(self, speed: Sequence[float]) -> State:
        """Return the damping force and moment D(v) v."""
    def rates(self, t_s: float, state: Sequence[float], force_n: Sequence[float]) -> State:
        """Return d/dt of the 13 states."""
    def step(
        self, t_s: float, state: Sequence[float], force_n: Sequence[float], dt_s: float
    ) -> State:
        """Return the state dt_s later (RK4), the quaternion not normalised."""
    def energy(self, state: Sequence[float]) -> float:
        """Return kinetic and righting energy in J."""
    def reference(self, t_s: float) -> Matrix:
        """Return position, velocity and acceleration wanted."""

def fly(plant: Quadrotor, position: Any, attitude: Any, draws: Sequence[float]) -> Outcome:
    """Run chapter 4; `draws` are 6 numbers in [-1, 1] for every hold of the disturbance."""

def dive(plant: Vehicle5, position: Any, sideways: Any, drive: Any) -> Outcome:
    """Run chapters 5 and 7."""

def swim(plant: Vehicle6, position: Any, noise: Sequence[float]) -> Outcome:
    """Run chapter 6; `noise` are 3 standard normal numbers for every step, or none."""
