"""The rows and columns of the fault matrix: what breaks, when, and by what name it has to be told."""

from __future__ import annotations

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
_WHEELS = "STALL|RUNAWAY|encoder|ENCODER|camera and wheels disagree|motor stuck|sides swapped"


@dataclass(frozen=True, slots=True)
class FaultRow:
    """One kind: what of `hil.config.events` makes it, and the pattern of the names that are right.

    `pulses_s` are (start, end) after the instant, end None for ever. `settings` are in force from the
    begin to the end of a run, whatever the instant. A `slow` one is told and stops nothing, unless the
    wheel stands: then it is a stall.
    """

    name: str
    kind: str = ""
    side: str = "both"
    named: str = ""
    pulses_s: tuple[tuple[float, float | None], ...] = ((0.0, None),)
    settings: tuple[str, ...] = ()
    slow: bool = False

    def overrides(self, start_s: float) -> list[str]:
        """Return the settings of a run with this fault from `start_s` on."""
        if not self.kind:
            return list(self.settings)
        faults = ", ".join(
            f'{{kind = "{self.kind}", side = "{self.side}", start_s = {start_s + begin_s:g}'
            + (f", end_s = {start_s + end_s:g}" if end_s is not None else "")
            + "}"
            for begin_s, end_s in self.pulses_s
        )
        return [f"faults=[{faults}]", *self.settings]


_FOUR_TIMES = tuple((0.8 * i, 0.8 * i + 0.35) for i in range(4))
ROWS = (
    FaultRow("encoder dead", "dead_encoder", "left", _WHEELS),
    FaultRow("encoder channel A dead", "dead_channel_a", "left", _WHEELS),
    FaultRow("encoder channel B dead", "dead_channel_b", "right", _WHEELS),
    FaultRow("encoder intermittent", "dead_encoder", "left", _WHEELS, _FOUR_TIMES),
    FaultRow("encoder phases swapped", "swapped_phases", "right", _WHEELS),
    FaultRow("motor reversed", "motor_reversed", "left", _WHEELS),
    FaultRow("motor stuck", "motor_stuck", "left", "motor stuck|STALL"),
    FaultRow("motor weak", "motor_weak", "left", "side weak|STALL", slow=True),
    FaultRow("motors exchanged", "motors_exchanged", named=_WHEELS),
    FaultRow("encoders exchanged", "encoders_exchanged", named=_WHEELS),
    FaultRow("board reset", "board_reset", named="board:|link:", pulses_s=((0.0, 0.3),)),
    FaultRow("board gone", "board_reset", named="board:|link:"),
    FaultRow("link cut", "link_cut", named="link:|board:"),
    FaultRow("link cut for 0.2 s", "link_cut", named="link:|board:", pulses_s=((0.0, 0.2),)),
    FaultRow("link loses a fifth", named="link:|board:", settings=("link.loss_ratio=0.2",)),
    FaultRow("link corrupts a byte in 200", named="link:|board:",
             settings=("link.corruption_ratio=0.005",)),
    FaultRow("camera stalls", "camera_stall", named="camera:"),
    FaultRow("camera stalls for 0.4 s", "camera_stall", named="camera:", pulses_s=((0.0, 0.4),)),
    FaultRow("robot hidden", "camera_occluded", named="camera:"),
    FaultRow("frames repeated", "camera_repeated", named="frames repeated|camera"),
)  # fmt: skip
