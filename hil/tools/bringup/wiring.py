"""From what moved to what is wired wrongly.

The wire alone cannot tell a reversed motor from swapped encoder phases, nor a dead encoder from a
wheel that stands: both look the same in counts. Somebody has to look, and `Seen` is what they say;
without it the finding names what it can be.
"""

from __future__ import annotations

from dataclasses import dataclass

from hil.tools.bringup.result import Check, Side, other

# Counts that a wheel surely makes once it turns; one that stands makes at most a flicker of one.
MOVED_COUNTS = 40
_FLICKER_COUNTS = 4
_PINS = {
    "left": "A on pin 20, B on pin 21",
    "right": "A on pin 3, B on pin 2",
}


@dataclass(frozen=True, slots=True)
class Seen:
    """What a person saw: which side's wheels turned (None: none did), and whether forward."""

    side: Side | None
    forward: bool = True


@dataclass(frozen=True, slots=True)
class Moved:
    """Counts moved while one side was driven forward, and how often each counter changed."""

    own: int
    across: int
    own_changes: int = 0
    across_changes: int = 0


def judge(driven: Side, moved: Moved, seen: Seen | None) -> list[Check]:
    """Return the checks of motor and encoder after `driven` was driven forward."""
    if abs(moved.own) >= MOVED_COUNTS and abs(moved.across) >= MOVED_COUNTS:
        text = f"driven alone, counts of both sides move ({moved.own:+d}, {moved.across:+d})"
        remedy = "see that no wheel touches the ground or another; then the motor leads"
        return [Check(f"{driven} motor", "fail", text, remedy, "both_sides_move")]
    motor = _motor(driven, moved, seen)
    return [motor, _encoder(driven, moved, seen)]


def _motor(driven: Side, moved: Moved, seen: Seen | None) -> Check:
    name = f"{driven} motor"
    if seen is None:
        return _unseen_motor(driven, moved)
    if seen.side is None:
        return Check(
            name, "fail", "driven forward, its wheels stand",
            "fuse, motor leads, the bridge's enable jumper; then turn the wheel by hand",
            "motor_stuck",
        )  # fmt: skip
    if seen.side != driven:
        return Check(
            name, "fail", f"driving {driven} turns the {seen.side} wheels",
            "exchange the two motors' leads at the bridge (OUT1, OUT2 with OUT3, OUT4)",
            "motors_exchanged",
        )  # fmt: skip
    if not seen.forward:
        return Check(
            name, "fail", "driven forward, its wheels turn backward",
            f"exchange the two leads of the {driven} motors", "motor_reversed",
        )  # fmt: skip
    return Check(name, "ok", "driven forward, its wheels turn forward")


def _unseen_motor(driven: Side, moved: Moved) -> Check:
    name = f"{driven} motor"
    if abs(moved.own) >= MOVED_COUNTS or _flickers(moved.own_changes):
        return Check(name, "note", "turns; nobody saw which way")
    return Check(name, "note", "nobody saw whether it turns")


def _encoder(driven: Side, moved: Moved, seen: Seen | None) -> Check:
    name = f"{driven} encoder"
    if seen is not None and seen.side is None:
        if abs(moved.own) < MOVED_COUNTS:
            return Check(name, "skipped", "its wheels stand")
        text = f"counts {moved.own:+d} while the wheels stand"
        return Check(
            name, "fail", text, "screen the encoder's cable; check its ground", "encoder_noise"
        )
    turned = driven if seen is None or seen.side is None else seen.side
    counts, changes = (
        (moved.own, moved.own_changes) if turned == driven else (moved.across, moved.across_changes)
    )
    elsewhere = moved.across if turned == driven else moved.own
    if abs(elsewhere) >= MOVED_COUNTS:
        return _exchanged(turned, elsewhere, looked=seen is not None)
    if abs(counts) < MOVED_COUNTS:
        return _silent(turned, changes, looked=seen is not None)
    forward = seen is None or seen.forward
    if (counts > 0) != forward:
        return _backward(turned, counts, looked=seen is not None)
    way = "forward" if forward else "backward"
    return Check(f"{turned} encoder", "ok", f"{counts:+d} counts turning {way}")


def _exchanged(turned: Side, counts: int, looked: bool) -> Check:
    across = other(turned)
    name = f"{turned} encoder"
    if looked:
        text = f"{turned} wheels turn and the {across} counter moves ({counts:+d})"
        remedy = f"exchange the encoder plugs: left is {_PINS['left']}; right {_PINS['right']}"
        return Check(name, "fail", text, remedy, "encoders_exchanged")
    text = f"driving {turned} moves the {across} counter ({counts:+d})"
    remedy = "motors or encoders are exchanged left with right: look which wheels turn"
    return Check(name, "fail", text, remedy, "sides_exchanged")


def _silent(turned: Side, changes: int, looked: bool) -> Check:
    name, pins = f"{turned} encoder", _PINS[turned]
    if _flickers(changes):
        text = f"counts flicker by one ({changes} changes) and go nowhere: one channel is dead"
        return Check(name, "fail", text, f"measure both channels: {pins}", "dead_channel")
    remedy = f"its supply and plug; {pins}"
    if looked:
        return Check(name, "fail", "no counts while its wheels turn", remedy, "dead_encoder")
    text = "no counts: the encoder is dead, or the wheels stand (nobody looked)"
    return Check(name, "fail", text, f"look at the wheels; then {remedy}", "no_counts")


def _backward(turned: Side, counts: int, looked: bool) -> Check:
    name = f"{turned} encoder"
    if looked:
        text = f"{counts:+d} counts: it counts against the wheel"
        return Check(name, "fail", text, f"exchange A and B ({_PINS[turned]})", "swapped_phases")
    text = f"{counts:+d} counts under forward drive: phases swapped or motor reversed"
    remedy = "look which way the wheels turn: backward, exchange the motor's leads; else A and B"
    return Check(name, "fail", text, remedy, "counts_against_drive")


def _flickers(changes: int) -> bool:
    return changes >= _FLICKER_COUNTS
