"""Recorded set-points and encoder counts through the firmware again, PWM compared.

The firmware is the core compiled for this machine, or the ELF on a simulated processor (elf.py).

A report gives the counts of every fifth tick only, and a set-point's arrival as the board stamped
it. Between reports the counts are interpolated, so PWM cannot come out bit for bit: what is
reported is how far it is off, and at which sampling phase of the encoder it fits best. With
another wheel law it is a shadow: the wheels followed the recorded PWM.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from scipy.interpolate import PchipInterpolator

from hil.board._firmware import BUILD_ID, TICK_US, Board, parameter_hash
from hil.config.fit import board_parameters
from hil.config.load import build, set_value
from hil.config.scenario import Scenario
from hil.core.errors import BadInput
from hil.record import layout
from hil.record.source import Source, read_source
from hil.wire import dialect
from hil.wire.framing import BOARD_COMPONENT, BOARD_SYSTEM, FrameReader, FrameWriter
from hil.wire.messages import is_arming, set_parameter_message

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

# Sampling phases tried, in us from the report's tick: the encoder is read somewhere inside it.
PHASES_US = tuple(range(-2000, 2001, 500))
_LEAST_REPORTS = 10
_WRAP_US = 1 << 32
# Sent by the host before the first tick that counts; set here instead, or of no effect on PWM. Parameters
# set behind the arming were changed live and go to this firmware as well.
_LEFT_OUT = frozenset(
    {
        dialect.MAVLINK_MSG_ID_PARAM_SET,
        dialect.MAVLINK_MSG_ID_PARAM_REQUEST_READ,
        dialect.MAVLINK_MSG_ID_PARAM_REQUEST_LIST,
        dialect.MAVLINK_MSG_ID_TIMESYNC,
    }
)
_BOOT_US = 2_000_000
_WHERE = {"core": "the core", "elf": "the ELF (simavr)"}


class Sent(NamedTuple):
    """A frame for the board and when it reached it, in unwrapped board time."""

    t_us: int
    frame: bytes


class Tick(NamedTuple):
    """When the board ticked, in unwrapped board time, and what its encoders (left, right) read."""

    t_us: int
    counts: tuple[int, int]


class Firmware(NamedTuple):
    """What a replay goes through; `pwm` gives (left, right) in counts at each tick."""

    name: str
    build_id: str
    pwm: Callable[[Sequence[Sent], Sequence[Tick]], list[tuple[int, int]]]


@dataclass(frozen=True, slots=True)
class Side:
    """PWM of one side over the reports of the armed part, in counts."""

    rms_recorded: float
    rms_difference: float
    correlation: float
    same_share: float


@dataclass(frozen=True, slots=True)
class FirmwareReport:
    """How well the firmware's PWM agrees with the recorded one; `shadow` when the law was changed.

    `firmware` is "core" or "elf". A shadow is taken at the encoder phase at which the recorded law
    fits best; `recorded_law_apart` is what that law is off there (left, right), in counts RMS.
    """

    firmware: str
    build_recorded: str
    build_here: str
    inner: str
    shadow: bool
    reports: int
    phase_us: int
    phase_rms: dict[int, float]
    left: Side
    right: Side
    recorded_law_apart: tuple[float, float] | None = None

    def to_json(self) -> dict[str, Any]:
        """Return the report for a JSON document."""
        tree = asdict(self)
        for side in ("left", "right"):
            values = tree[side].items()
            tree[side] = {k: v if math.isfinite(v) else None for k, v in values}
        return tree | {"phase_rms": {str(k): v for k, v in self.phase_rms.items()}}

    def text(self) -> str:
        """Return the result in two or three lines for a person."""
        kind = "shadow of the wheel law" if self.shadow else "firmware replay of the wheel law"
        lines = [
            f"{kind} {self.inner} on {_WHERE[self.firmware]}: {self.reports} reports, "
            f"encoder phase {self.phase_us} us",
            *(
                f"  PWM {name}: {side.rms_difference:.1f} counts RMS apart of "
                f"{side.rms_recorded:.1f} RMS, correlation {side.correlation:.4f}, "
                f"{side.same_share:.0%} within 1 count"
                for name, side in (("left", self.left), ("right", self.right))
            ),
        ]
        if self.recorded_law_apart is not None:
            left, right = self.recorded_law_apart
            lines.append(
                f"  the recorded law itself is {left:.1f} (left) and {right:.1f} counts RMS (right) apart "
                "at this phase: less than that is no effect of the change"
            )
        if self.build_recorded != self.build_here:
            lines.append(
                f"  note: recorded with firmware {self.build_recorded or 'unknown'}, "
                f"replayed with {self.build_here}"
            )
        return "\n".join(lines)


@dataclass(frozen=True, slots=True)
class Trace:
    """The wheel reports of a record as columns, board time unwrapped."""

    t_us: NDArray[np.int64]
    counts: NDArray[np.int64]  # (n, 2)
    pwm: Array  # (n, 2)
    armed: NDArray[np.bool_]


def replay_wheels(
    path: Path,
    inner: str | None = None,
    overrides: Sequence[str] = (),
    firmware: Firmware | None = None,
) -> FirmwareReport:
    """Replay a record's wheel loops; with another wheel law or board parameters, as a shadow.

    They go through the core unless another firmware is given.
    """
    source = read_source(path)
    tree = dict(source.manifest.scenario)
    for text in overrides:
        set_value(tree, text)
    scenario = build(Scenario, tree, "--set" if overrides else str(path / layout.MANIFEST))
    law = inner or source.manifest.inner
    shadow = bool(overrides) or law != source.manifest.inner
    through = firmware or core()
    recorded = build(Scenario, source.manifest.scenario, str(path / layout.MANIFEST))
    own = replay_firmware(
        source, board_parameters(recorded, source.manifest.inner), source.manifest.inner, through
    )
    return (
        replay_firmware(source, board_parameters(scenario, law), law, through, own)
        if shadow
        else own
    )


def core() -> Firmware:
    """Return the firmware core compiled for this machine."""
    return Firmware("core", BUILD_ID, _core_pwm)


def replay_firmware(
    source: Source,
    parameters: Mapping[str, float],
    inner: str,
    firmware: Firmware,
    recorded: FirmwareReport | None = None,
) -> FirmwareReport:
    """Run it on a record's set-points and counts; raises BadInput without enough of them.

    With the report of the `recorded` law this is a shadow, of another law or other parameters.
    """
    trace, arrivals = read_reports(source)
    if int(trace.armed.sum()) < _LEAST_REPORTS:
        raise BadInput(
            f"{source.path}: {int(trace.armed.sum())} wheel reports while armed in link.tlog, "
            f"{_LEAST_REPORTS} are needed for a firmware replay"
        )
    sent = sent_frames(source, arrivals)
    found = {phase: _run(firmware, trace, sent, parameters, phase) for phase in PHASES_US}
    rms = {phase: _rms(pwm[trace.armed] - trace.pwm[trace.armed]) for phase, pwm in found.items()}
    # Without a clear best phase (a wheel at rest) the tick itself is the honest one. Where the encoder
    # was read is a fact of the record, which a shadow's own fit cannot tell.
    best = min(rms, key=lambda phase: (round(rms[phase], 3), abs(phase)))
    if recorded is not None:
        best = recorded.phase_us
    pwm = found[best][trace.armed]
    left, right = (_side(trace.pwm[trace.armed][:, i], pwm[:, i]) for i in (0, 1))
    return FirmwareReport(
        firmware.name, source.manifest.firmware_build_id, firmware.build_id, inner,
        recorded is not None,
        int(trace.armed.sum()), best, {k: round(v, 3) for k, v in rms.items()},
        left, right,
        (recorded.left.rms_difference, recorded.right.rms_difference) if recorded else None,
    )  # fmt: skip


def read_reports(source: Source) -> tuple[Trace, dict[int, int]]:
    """Return the reports, and the board time at which each named set-point arrived."""
    reader = FrameReader()
    states = [
        message
        for logged in source.link
        for msg_id, message, _ in reader.feed(logged.frame)
        if msg_id == dialect.MAVLINK_MSG_ID_WHEEL_STATE
    ]
    t_us: list[int] = []
    arrivals: dict[int, int] = {}
    for state in states:
        last = t_us[-1] if t_us else state.t_mcu_us
        t_us.append(last + (state.t_mcu_us - last) % _WRAP_US)
        age_us = (state.t_mcu_us - state.t_setpoint_us) % _WRAP_US
        arrivals.setdefault(state.setpoint_seq, t_us[-1] - age_us)
    columns = np.array(
        [(s.left_counts, s.right_counts, s.pwm_left_counts, s.pwm_right_counts) for s in states]
    ).reshape(-1, 4)
    armed = np.array([s.state == dialect.HIL_STATE_ARMED for s in states], dtype=np.bool_)
    return (
        Trace(np.array(t_us, np.int64), columns[:, :2], columns[:, 2:].astype(float), armed),
        arrivals,
    )


def sent_frames(source: Source, arrivals: Mapping[int, int]) -> list[Sent]:
    """Return the host's frames in the order and at the times at which the board had them.

    Raises BadInput where no wheel report names a set-point of the record.
    """
    timed: list[tuple[int, int | None, bytes]] = []
    delays = []
    armed = False
    for logged in source.link:
        if logged.frame[5] == BOARD_SYSTEM:
            continue
        msg_id = int.from_bytes(logged.frame[7:10], "little")
        armed = armed or _arms(msg_id, logged.frame)
        if msg_id in _LEFT_OUT and not (armed and msg_id == dialect.MAVLINK_MSG_ID_PARAM_SET):
            continue
        arrival = None
        if msg_id == dialect.MAVLINK_MSG_ID_WHEEL_SETPOINT:
            arrival = arrivals.get(decoded(logged.frame).seq)
            if arrival is not None:
                delays.append(arrival - logged.unix_us)
        timed.append((logged.unix_us, arrival, logged.frame))
    if not delays:
        raise BadInput(f"{source.path}: no wheel report names a set-point of link.tlog")
    usual = round(float(np.median(delays)))
    found: list[Sent] = []
    for unix_us, arrival, frame in timed:
        at = arrival if arrival is not None else unix_us + usual
        # Frames do not overtake each other on a wire.
        found.append(Sent(max(at, found[-1].t_us) if found else at, frame))
    return found


def decoded(frame: bytes) -> Any:
    """Return the message of a whole frame."""
    return dialect.MAVLink(None).decode(bytearray(frame))


def _run(
    firmware: Firmware,
    trace: Trace,
    sent: Sequence[Sent],
    parameters: Mapping[str, float],
    phase_us: int,
) -> Array:
    """Return the firmware's PWM (n, 2) at the tick of every report."""
    writer = FrameWriter()
    begin = int(trace.t_us[0]) - TICK_US
    frames = _boot(writer, parameters, begin)
    ticks = [Tick(item.t_us, _counts(trace.counts[0])) for item in frames]
    own = parameter_hash(parameters)
    frames += [
        Sent(item.t_us, _own_arming(item.frame, own, writer)) for item in sent if item.t_us >= begin
    ]
    curves = [PchipInterpolator(trace.t_us, trace.counts[:, i]) for i in (0, 1)]
    places = []
    for end in trace.t_us.tolist():
        times = np.linspace(begin, end, max(round((end - begin) / TICK_US), 1) + 1)[1:]
        at = np.clip(times + phase_us, trace.t_us[0], trace.t_us[-1])
        counts = np.rint(np.column_stack([curve(at) for curve in curves]))
        ticks += [Tick(round(t), _counts(c)) for t, c in zip(times.tolist(), counts, strict=True)]
        places.append(len(ticks) - 1)
        begin = end
    return np.array(firmware.pwm(frames, ticks), float)[places]


def _counts(row: NDArray[Any]) -> tuple[int, int]:
    return int(row[0]), int(row[1])


def _core_pwm(frames: Sequence[Sent], ticks: Sequence[Tick]) -> list[tuple[int, int]]:
    board, pwm, place = Board(), [], 0
    for tick in ticks:
        while place < len(frames) and frames[place].t_us <= tick.t_us:
            board.receive(frames[place].frame, frames[place].t_us % _WRAP_US)
            place += 1
        pwm.append(board.tick(tick.t_us % _WRAP_US, *tick.counts))
        board.transmit()
    return pwm


def _boot(writer: FrameWriter, parameters: Mapping[str, float], end_us: int) -> list[Sent]:
    """Return what sets the parameters by the link, as a host would, before the recorded ticks."""
    return [
        Sent(
            end_us - _BOOT_US + i * TICK_US,
            writer.encode(set_parameter_message(name, value)),
        )
        for i, (name, value) in enumerate(parameters.items())
    ]


def _arms(msg_id: int, frame: bytes) -> bool:
    return msg_id == dialect.MAVLINK_MSG_ID_COMMAND_LONG and is_arming(decoded(frame))


def _own_arming(frame: bytes, own: int, writer: FrameWriter) -> bytes:
    """Return the frame; an arming with this firmware's parameter hash for the recorded one's."""
    if int.from_bytes(frame[7:10], "little") != dialect.MAVLINK_MSG_ID_COMMAND_LONG:
        return frame
    command = decoded(frame)
    if not is_arming(command):
        return frame
    return writer.encode(
        dialect.MAVLink_command_long_message(
            BOARD_SYSTEM, BOARD_COMPONENT, command.command, command.confirmation,
            1.0, 0.0, command.param3, command.param4, float(own >> 16), float(own & 0xFFFF), 0.0,
        )
    )  # fmt: skip


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _side(recorded: Array, replayed: Array) -> Side:
    moving = recorded.std() > 0 and replayed.std() > 0
    return Side(
        _rms(recorded),
        _rms(replayed - recorded),
        float(np.corrcoef(recorded, replayed)[0, 1]) if moving else math.nan,
        float(np.mean(np.abs(replayed - recorded) <= 1.0)),
    )
