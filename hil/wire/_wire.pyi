from collections.abc import Callable

from hil.core._native import BoardClock
from hil.core.types import WheelSample

def checksum(data: bytes, extra: int) -> int:
    """Return CRC-16/MCRF4XX of some bytes and one more."""

class WheelState:
    """A WHEEL_STATE; its fields, units in their names: hil/wire/hil.xml."""

    FIELDS: tuple[str, ...]
    t_mcu_us: int
    left_counts: int
    right_counts: int
    omega_left_rad_s: float
    omega_right_rad_s: float
    error_rate_left_rad_s2: float
    error_rate_right_rad_s2: float
    s_left: float
    s_right: float
    t_setpoint_us: int
    pwm_left_counts: int
    pwm_right_counts: int
    setpoint_seq: int
    state: int
    reason: int
    flags: int

def wheel_state(frame: bytes) -> WheelState: ...
def parameter(frame: bytes) -> tuple[str, float, int, int]:
    """Return name, value, how many there are and index of a PARAM_VALUE."""

class WheelReport:
    t_arrival_s: float
    t_board_s: float
    round_trip_s: float
    @property
    def wire(self) -> WheelState: ...
    @property
    def sample(self) -> WheelSample: ...

class ReadCounters:
    frames: int
    lost: int
    bad_crc: int
    skipped_bytes: int
    foreign: int
    signed_frames: int

class FrameReader:
    counters: ReadCounters
    def __init__(self, system: int) -> None: ...
    def feed(self, data: bytes) -> list[tuple[int, bytes]]: ...

class FrameWriter:
    seq: int
    def __init__(self, system: int, component: int) -> None: ...
    def count(self) -> None: ...
    def parameter_request(self, index: int) -> bytes: ...
    def setpoint(self, left_rad_s: float, right_rad_s: float, seq: int) -> bytes: ...

class Link:
    """hil.wire.link.BoardLink without what procedures and people need."""

    clock: BoardClock
    writer: FrameWriter
    counters: ReadCounters
    state: int
    reason: int
    heartbeats: int
    frames_sent: int
    battery_v: float
    sys_status: bytes
    def forget_sys_status(self) -> None: ...
    def take(
        self, data: bytes, t_s: float, tap: Callable[[float, bytes], None] | None
    ) -> tuple[list[WheelReport], list[tuple[int, bytes]]]: ...
    def setpoint(self, t_s: float, left_rad_s: float, right_rad_s: float) -> bytes: ...
    def rest_until(self, until_s: float) -> None: ...
    def due(self, t_s: float) -> bool: ...
    def timer_frames(self, t_s: float) -> list[bytes]: ...
    def ask_time(self, t_s: float) -> bytes: ...
