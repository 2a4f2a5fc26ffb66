"""What a session does between two ticks; times are host times in s, world frame, SI."""

from collections.abc import Callable, Sequence
from typing import NoReturn

from hil.control._outer import OuterLaw, Reference
from hil.control.estimators._fused import Fused
from hil.control.estimators.geometry import BelievedGeometry
from hil.core._native import CameraClock
from hil.core.rig import Truth
from hil.core.types import Estimate, OuterCommand, Pose, Vec2
from hil.wire._wire import Link, WheelReport

_Note = Callable[[str, str], None]
_Eye = Callable[[tuple[float, float, float] | None], tuple[object, ...]]

REACTIONS: tuple[str, ...]
REACHED: int
HEARD: int
TAKEN: int

def side_at_limit(pwm_counts: float, lacks_rad_s: float, most_counts: float) -> int: ...
def driven_hard(left_pwm_counts: float, right_pwm_counts: float, stall_counts: float) -> bool: ...
def odd_stamp(ahead_s: float) -> str:
    """Return why a frame is not looked at whose exposure would lie `ahead_s` after its arrival."""

class Plausibility:
    """Judges each tick; raises RigFault where `stops` (in the order of REACTIONS), else notes once."""

    def __init__(self, stops: Sequence[bool], note: _Note) -> None: ...
    def saw(self, picture: bytes, counts: tuple[int, int] | None, rad_per_count: float) -> None: ...
    def check(
        self, now_s: float, given_rad_s: Vec2, pwm_counts: Vec2, pwm_top_counts: int
    ) -> None: ...
    def asked(self, left_rad_s: float, right_rad_s: float) -> None: ...
    def check_progress(self, now_s: float, error_m: float) -> None: ...
    def finish(self) -> None: ...

class RowFormat:
    """Which terms of a law's trace a row has: those of every record, and those of this law."""

    def __init__(self, common: tuple[str, ...], own: tuple[str, ...]) -> None: ...

class Watch:
    """Supervision, plausibility and limits of one run, and what they know; checks raise RigFault."""

    uplink_s: float
    poses: int
    reason: str | None
    camera_latency_s: float
    def __init__(
        self,
        *,
        fence_m: Sequence[float],
        link_lost_s: float,
        pose_lost_s: float,
        stops: Sequence[bool],
        note: _Note,
        uplink_s: float,
        rad_per_count: float,
    ) -> None: ...
    def check_clock(self, now_s: float) -> None:
        """Raise RigFault when the host's clock, which must never, has gone back; once for each time."""

    def check_host(self, now_s: float) -> None:
        """Raise RigFault when the host itself was away for longer than the board waits for it."""

    def check_estimate(self, x_m: float, y_m: float) -> None:
        """Raise RigFault when the robot is thought to be outside the fence."""

    def take_report(self, report: WheelReport) -> None: ...
    def take_frame(
        self,
        *,
        exposure_s: float,
        pose: Pose | None,
        quality: float,
        reason: str,
        picture: bytes,
        believed: bool,
        agreement_age_s: float,
    ) -> None:
        """Take what the localiser said of a frame, after the estimator was given it."""

    def check(
        self,
        now_s: float,
        agreement_age_s: float,
        refused: tuple[float, float, float],
        scales: tuple[float, float],
        pwm_top_counts: int,
    ) -> None:
        """Raise RigFault when link or camera no longer answer for the robot, or the wheels turn wrongly."""

    def sides(self, most_counts: float) -> tuple[int, int]: ...
    def driven_hard(self, stall_counts: float) -> bool:
        """Say whether a side is driven with what the board would call a stall if its wheel stood."""

    def take_tick(
        self,
        now_s: float,
        dt_s: float,
        sides: tuple[int, int],
        asked_rad_s: float,
        made_rad_s: float,
        left_rad_s: float,
        right_rad_s: float,
        error_m: float,
    ) -> None:
        """Take a tick's turn rate asked and made, what it asks of the wheels, how far the goal is."""

    def row(
        self,
        format: RowFormat,
        link: Link,
        now_s: float,
        t_s: float,
        estimate: Estimate | None,
        truth: Truth | None,
        goal_m: Vec2,
        command: OuterCommand,
        wheels_rad_s: Vec2,
        late: bool,
    ) -> tuple[float, ...]:
        """Return a tick's row in the order of hil.record.schema.SAMPLE_NAMES; NaN is not known."""

    def finish(self) -> None:
        """Tell what was seen over the whole run and stops nothing."""

    def short_turn(self) -> str:
        """Return what of the turns the motors did not give, "" where they gave what was needed."""

class Pump:
    """Bytes and frames of a simulated rig taken as they arrive."""

    now_s: float
    def __init__(
        self,
        rig: object,
        link: Link,
        camera: CameraClock,
        fused: Fused,
        watch: Watch,
        note: _Note,
        eye: _Eye,
    ) -> None: ...
    def begin(self, until_s: float, busy: bool) -> int: ...
    def begin_periods(self, period_s: float, last_s: float) -> int: ...
    def go_on(self, busy: bool) -> int: ...
    def others(self) -> list[tuple[int, bytes]]: ...
    def frame_rows(self, origin_s: float) -> bytes:
        """Return the frames taken, rows of hil.record.schema.FRAME_NAMES in doubles."""

    def check(self, watch: Watch, now_s: float, pwm_top_counts: int) -> None: ...
    rig_now_s: float
    def look(self, watch: Watch, now_s: float, most_counts: float, stall_counts: float) -> Estimate:
        """Return the state at the actuation time of a tick, inside the fence; else raise RigFault."""

    def act(
        self,
        watch: Watch,
        format: RowFormat,
        now_s: float,
        t_s: float,
        dt_s: float,
        looked_goal_m: Vec2,
        goal_m: Vec2,
        command: OuterCommand,
        wheels_rad_s: Vec2,
        late: bool,
    ) -> tuple[float, ...]:
        """Send what a tick asks of the wheels, tell everyone of it, and return its row."""

    def send_setpoint(self, t_s: float, left_rad_s: float, right_rad_s: float) -> None: ...

class Drive:
    """The ticks of a run in native code; see native/drive.hpp."""

    def __init__(
        self,
        *,
        pump: Pump,
        watch: Watch,
        law: OuterLaw,
        reference: Reference,
        geometry: BelievedGeometry,
        t0_s: float,
        period_s: float,
        ticks: int,
        common: list[int],
        own: list[int],
    ) -> None: ...
    def run(self, busy: bool, refused: bool, board: tuple[int, float, float]) -> int:
        """Go on until somebody is needed; `board` is its PWM's top, most and stall counts."""
    reached_s: float
    def take_rows(self) -> bytes:
        """Return the rows of ticks since the last call, in doubles."""

class AnsweredLaw(OuterLaw):
    """A law that native code asks and others answer; see native/answered_law.hpp."""

    def __init__(self) -> None: ...

def questions(laws: Sequence[AnsweredLaw]) -> bytes:
    """Return what laws are asked: rows of doubles as hil.core.batch.asked has them, a column a law.

    One more row is 1 for those that are to start anew.
    """

def answer(laws: Sequence[AnsweredLaw], answers: bytes, places: Sequence[int]) -> None:
    """Answer: forward speeds, turn rates, then what goes to the places of the traces; a column a law."""

class Together:
    """The controlled parts of several runs, advanced side by side; see native/together.hpp."""

    waiting: list[int]  # whose laws are to be answered before anything else goes on
    def __init__(self) -> None: ...
    def add(self, drive: Drive) -> int:
        """Take a run in; it begins with `go_on`. Returns its place."""

    def go_on(
        self, place: int, busy: bool, refused: bool, board: tuple[int, float, float]
    ) -> None: ...
    def answered(self, place: int) -> None: ...
    def end(self, place: int) -> None: ...
    def run(self) -> list[tuple[int, int]]:
        """Advance until somebody is needed: which runs have stopped, and why (as `Drive.run`, or FAILED)."""

    def rethrow(self, place: int) -> NoReturn:
        """Raise what ended the run."""

FAILED: int
DONE: int
DRIVE_HEARD: int
DRIVE_TAKEN: int
ASKED: int
