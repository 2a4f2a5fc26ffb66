"""The board's core compiled for this machine (firmware_arduino/src/core).

Positive is forward: positive PWM and speed make counts rise. Board time is uint32 microseconds and
wraps; every call that needs time takes it as an argument.
"""

import enum
from collections.abc import Mapping

PWM_TOP: int
"""PWM counts at full duty."""
TICK_US: int
"""Period of the control tick."""
IMAGE_SIZE: int
"""Bytes of a storage image."""
SLOT_SIZE: int
"""Bytes from the first storage image to the second."""
ENCODER_COUNTS_1_S: float
"""Encoder counts a second of one side that the board can count."""
BUILD_ID: str
"""First eight hexadecimal digits of the hash of the core's sources."""
WANTS_ARM: int
WANTS_DISARM: int
ANY_FAULT: int

class Parameter:
    """One line of params.def; `live` ones may change while armed."""

    @property
    def name(self) -> str: ...
    @property
    def default(self) -> float: ...
    @property
    def minimum(self) -> float: ...
    @property
    def maximum(self) -> float: ...
    @property
    def unit(self) -> str: ...
    @property
    def doc(self) -> str: ...
    @property
    def live(self) -> bool: ...

def parameter_table() -> list[Parameter]:
    """Return every parameter of the board in the board's order."""

class WheelLawName:
    """A wheel law of the board, as laws.def names it."""

    @property
    def name(self) -> str: ...
    @property
    def doc(self) -> str: ...
    @property
    def value(self) -> float:
        """Value of the parameter LAW."""

def wheel_laws() -> list[WheelLawName]:
    """Return the wheel laws in the order of their values."""

def parameter_hash(parameters: Mapping[str, float] = ...) -> int:
    """Return the hash of the defaults with `parameters` put over them.

    Raises KeyError for an unknown name and ValueError for a value out of range.
    """

def dialect_hash() -> int:
    """Return the hash of the dialect compiled in."""

def safety_next(state: int, conditions: int) -> int:
    """Return the HIL_STATE that follows: condition bit n is HIL_REASON n, above them WANTS_*."""

def safety_reason(conditions: int) -> int:
    """Return the HIL_REASON of highest rank among the conditions."""

class Scheme(enum.Enum):
    """Discretisation of the differentiator."""

    EXPLICIT = 0
    SEMI_IMPLICIT = 1
    IMPLICIT = 2

class SuperTwisting:
    """Super-twisting differentiator of docs/wheel-loop.md for a signal with |x_ddot| <= l.

    `cell` is the half width of the measurement's quantisation cell, in units of x. With `l_min` the
    gain varies between l_min and l as in (3.15).
    """

    def __init__(
        self,
        l: float,
        l0: float = 1.1,
        l1: float = 1.5,
        scheme: Scheme = ...,
        cell: float = 0.0,
        l_min: float | None = None,
        rho_1_s: float = 30.0,
        alpha: float = 0.6,
    ) -> None: ...
    def step(self, x: float, dt_s: float) -> tuple[float, float]:
        """Take x, `dt_s` after the one before; return (x1, x2), the estimates of x and dx/dt.

        The first call sets the state to (x, 0); a `dt_s` of 0 or less changes nothing.
        """

    @property
    def l(self) -> float:  # noqa: E743
        """Gain L in force."""

class Quadrature:
    """x4 decoder of one encoder; `ab` is (A << 1) | B."""

    def __init__(self, ab: int = 0) -> None: ...
    def update(self, ab: int) -> None:
        """Take the pins as they are now."""

    @property
    def counts(self) -> int: ...
    @property
    def illegal(self) -> int: ...

class Wheel:
    """State of one wheel loop, as of its last tick."""

    @property
    def omega_rad_s(self) -> float: ...
    @property
    def setpoint_rad_s(self) -> float: ...
    @property
    def error_rad_s(self) -> float: ...
    @property
    def error_rate_rad_s2(self) -> float: ...
    @property
    def duty(self) -> float:
        """Wanted duty before the limits."""

    @property
    def feedback_duty(self) -> float: ...
    @property
    def bump_duty(self) -> float: ...
    @property
    def saturation(self) -> int:
        """+1: held below the wanted duty, -1: held above, 0: free."""

    @property
    def holding(self) -> bool: ...
    @property
    def pwm(self) -> int: ...
    @property
    def pid_integral_rad(self) -> float: ...
    @property
    def s(self) -> float: ...
    @property
    def eps(self) -> float: ...
    @property
    def gain(self) -> float: ...
    @property
    def integral(self) -> float: ...
    @property
    def average(self) -> float: ...
    @property
    def eta(self) -> float: ...
    @property
    def t_mu0_s(self) -> float: ...

class WheelLoop:
    """One wheel loop by itself, ticked every TICK_US; `parameters` go over the defaults."""

    def __init__(self, parameters: Mapping[str, float] = ...) -> None: ...
    def retune(self, parameters: Mapping[str, float]) -> None:
        """Put other parameters in force, without a bump of the output."""

    def estimate(self, counts: int) -> float:
        """Take the encoder counts of this tick; return the speed in rad/s."""

    def step(self, counts: int, setpoint_rad_s: float) -> int:
        """Run one tick on the encoder; return the PWM."""

    def step_at_speed(self, omega_rad_s: float, setpoint_rad_s: float) -> int:
        """Run one tick with the speed given instead of measured; return the PWM."""

    def off(self) -> None:
        """Bridge off; the law starts anew at the next tick."""

    @property
    def state(self) -> Wheel: ...

class ImageResult(enum.Enum):
    """What became of a storage image."""

    LOADED = 0
    BLANK = 1
    DAMAGED = 2

def sha256(data: bytes) -> bytes:
    """Return the digest of the core's SHA-256."""

def stored_key(key: bytes, stamp: int) -> bytes:
    """Return what the EEPROM of a board holds that was given this signing key at this time stamp."""

class Board:
    """The whole board below the pins."""

    def __init__(self, eeprom: bytes = b"") -> None:
        """Power up with what the EEPROM holds; what is not given is erased (0xFF)."""

    def receive(self, data: bytes, t_us: int) -> None:
        """Take bytes that had arrived by `t_us`."""

    def tick(
        self,
        t_us: int,
        counts_left: int,
        counts_right: int,
        encoder_faults: int = 0,
        battery_mv: int = 12000,
    ) -> tuple[int, int]:
        """Run one tick; return the PWM (left, right), -PWM_TOP to PWM_TOP."""

    def transmit(self, limit: int = 256) -> bytes:
        """Return up to `limit` bytes for the serial port."""

    @property
    def signs(self) -> bool:
        """True where it has a signing key."""

    @property
    def stamp(self) -> int:
        """Its own time stamp, in 10 us since 2015."""

    wired: bool
    """What it receives comes over the USB port."""

    @property
    def loaded(self) -> ImageResult:
        """What became of the EEPROM's images at power-up; BLANK and DAMAGED leave the defaults."""

    @property
    def eeprom(self) -> bytes:
        """What the EEPROM holds now; a save writes a byte a tick, two images in turn."""

    def wheel(self, side: int) -> Wheel:
        """Return the loop of side 0 (left) or 1 (right)."""

    @property
    def state(self) -> int:
        """HIL_STATE."""

    @property
    def reason(self) -> int:
        """HIL_REASON."""

    @property
    def parameters(self) -> dict[str, float]: ...
    @property
    def parameter_hash(self) -> int: ...
    @property
    def overruns(self) -> int: ...
    @property
    def refused_setpoints(self) -> int: ...
    @property
    def bad_frames(self) -> int: ...
    @property
    def lost_frames(self) -> int: ...
    @property
    def received_frames(self) -> int: ...
    @property
    def dropped_frames(self) -> int: ...
