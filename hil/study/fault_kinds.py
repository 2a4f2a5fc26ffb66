"""The rows and columns of the fault matrix: what breaks, when, and by what name it has to be told."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

# Name of an instant -> start of the fault in s of the controlled part; the end of a run is added for
# the last one. 0 is there from power-up, so before arming.
INSTANTS = {
    "before arming": 0.0,
    "at start": 0.05,
    "at speed": 1.0,
    "at rest": 11.0,
    "closing": 0.0,
}
CLOSING = "closing"
TRAVEL_M = 1.0
# What two faults of the wheels may both be told as; each row takes as few of them as its evidence allows.
_APART = "camera and wheels disagree"
_SILENT = "no heartbeat"  # of a board that is not there when the host connects


@dataclass(frozen=True, slots=True)
class FaultRow:
    """One kind: what of `hil.config.events` makes it, and the pattern of the names that are right.

    `pulses_s` are (start, end) after the instant, end None for ever. `fields` are further ones of the
    fault. `loads` are disturbances of the same times, each (target, amplitude). `settings` are in force
    from the begin to the end of a run, whatever the instant. A `slow` one is told and stops nothing,
    unless the wheel stands: then it is a stall. No fault begins before `first_s`. `travel_m` is the
    most that the robot may travel until it is stopped.
    """

    name: str
    kind: str = ""
    side: str = "both"
    named: str = ""
    pulses_s: tuple[tuple[float, float | None], ...] = ((0.0, None),)
    settings: tuple[str, ...] = ()
    slow: bool = False
    fields: str = ""
    loads: tuple[tuple[str, float], ...] = ()
    camera: str = "pose"
    first_s: float = 0.0
    travel_m: float = TRAVEL_M

    def overrides(self, start_s: float) -> list[str]:
        """Return the settings of a run with this fault from `start_s` on."""
        start_s = max(start_s, self.first_s)
        return [
            *self._events("faults", [f'kind = "{self.kind}", side = "{self.side}"{self.fields}'] if
                          self.kind else [], start_s),
            *self._events("disturbances", [
                f'target = "{target}", shape = "step", amplitude = {amplitude:g}'
                for target, amplitude in self.loads
            ], start_s),
            *self.settings,
        ]  # fmt: skip

    def _events(self, table: str, kinds: Sequence[str], start_s: float) -> list[str]:
        events = ", ".join(
            f"{{{kind}, start_s = {start_s + begin_s:g}"
            + (f", end_s = {start_s + end_s:g}" if end_s is not None else "")
            + "}"
            for kind in kinds
            for begin_s, end_s in self.pulses_s
        )
        return [f"{table}=[{events}]"] if events else []


_FOUR_TIMES = tuple((0.8 * i, 0.8 * i + 0.35) for i in range(4))
_SHORT = ((0.0, 0.2),)
ROWS = (
    FaultRow("encoder dead", "dead_encoder", "left", f"STALL_LEFT|{_APART}"),
    FaultRow("encoder channel A dead", "dead_channel_a", "left", f"STALL_LEFT|{_APART}"),
    FaultRow("encoder channel B dead", "dead_channel_b", "right", f"STALL_RIGHT|{_APART}"),
    FaultRow("encoder intermittent", "dead_encoder", "left",
             f"STALL_LEFT|encoder intermittent: left|{_APART}", _FOUR_TIMES),
    FaultRow("encoder phases swapped", "swapped_phases", "right", f"RUNAWAY_RIGHT|{_APART}"),
    FaultRow("encoder wires noisy", "encoder_noise", "left", "ENCODER|encoder"),
    FaultRow("gear slips to 0.4", "gear_slip", "left", _APART,
             travel_m=1.5),  # from power-up the camera makes it good, to the turn at the goal
    FaultRow("motor reversed", "motor_reversed", "left", "RUNAWAY_LEFT"),
    FaultRow("motor stuck", "motor_stuck", "left", "motor stuck: left|STALL_LEFT"),
    FaultRow("motor weak", "motor_weak", "left", "side weak: left|STALL_LEFT", slow=True),
    FaultRow("motors exchanged", "motors_exchanged", named=f"sides swapped|RUNAWAY|{_APART}"),
    FaultRow("encoders exchanged", "encoders_exchanged", named=f"sides swapped|RUNAWAY|{_APART}"),
    FaultRow("battery sags to 9 V", named="BATTERY", loads=(("battery_sag_v", 3.5),)),
    FaultRow("battery sags for 0.5 s", named="BATTERY", loads=(("battery_sag_v", 3.5),),
             pulses_s=((0.0, 0.5),)),
    FaultRow("brown-out, board resets", "board_reset", named=f"started anew|link:|{_SILENT}",
             loads=(("battery_sag_v", 9.0),), pulses_s=_SHORT),
    FaultRow("board reset", "board_reset", named=f"started anew|link:|{_SILENT}", pulses_s=((0.0, 0.3),)),
    FaultRow("board gone", "board_reset", named=f"link:|{_SILENT}"),
    FaultRow("link cut", "link_cut", named=f"link:|SETPOINT_TIMEOUT|{_SILENT}"),
    FaultRow("link cut for 0.2 s", "link_cut", named=f"link:|SETPOINT_TIMEOUT|{_SILENT}", pulses_s=_SHORT),
    FaultRow("link half open: board deaf", "link_down_cut", named=f"SETPOINT_TIMEOUT|{_SILENT}|no answer"),
    FaultRow("link half open: host deaf", "link_up_cut", named=f"link:|{_SILENT}"),
    FaultRow("link doubles all", "link_duplicated", named=f"link:|SETPOINT_TIMEOUT|{_SILENT}"),
    FaultRow("link reorders all", "link_reordered", named=f"link:|SETPOINT_TIMEOUT|{_SILENT}"),
    FaultRow("link loses a fifth", named="link:|board:", settings=("link.loss_ratio=0.2",)),
    FaultRow("link loses bursts", named="link:|board:",
             settings=("link.loss_ratio=0.1", "link.loss_burst_chunks=8")),
    FaultRow("link corrupts a byte in 200", named="link:|board:",
             settings=("link.corruption_ratio=0.005",)),
    FaultRow("camera stalls", "camera_stall", named="camera:"),
    FaultRow("camera stalls for 0.4 s", "camera_stall", named="camera:", pulses_s=((0.0, 0.4),)),
    FaultRow("robot hidden", "camera_occluded", named="camera:"),
    FaultRow("frames repeated", "camera_repeated", named="frames repeated"),
    FaultRow("camera's clock steps by 5 s", "camera_clock_step", named="camera:"),
    FaultRow("camera's clock steps by -5 s", "camera_clock_step", named="camera:",
             fields=", step_s = -5"),
    FaultRow("exposure jumps to 4", "camera_exposure", named="camera:", camera="rendered",
             fields=", light_ratio = 4"),
    FaultRow("exposure jumps to 0.1", "camera_exposure", named="camera:", camera="rendered",
             fields=", light_ratio = 0.1"),
    FaultRow("colours exchanged", "camera_colours", named="camera", camera="rendered"),
    FaultRow("front mark covered", "camera_mark_covered", named="camera:", camera="rendered"),
    FaultRow("second robot", "camera_second_robot", named="camera", camera="rendered",
             fields=", x_m = -0.3, y_m = 0.55"),
    FaultRow("host stopped for 1 s", "host_stopped", named="host:", pulses_s=((0.0, 1.0),),
             first_s=0.01),  # there is no run of a host that does not run
    FaultRow("host overloaded", "host_overloaded", named="host:|link:|SETPOINT_TIMEOUT"),
    FaultRow("host's clock steps by 5 s", "host_clock_step", named="host:"),
    FaultRow("host's clock steps by -5 s", "host_clock_step", named="host:",
             fields=", step_s = -5"),
)  # fmt: skip
