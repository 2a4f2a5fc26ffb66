"""The whole bring-up over a twin on blocks: sound, and with faults planted in it."""

from __future__ import annotations

import pytest

from hil.board import _firmware
from hil.cli.bringup import Nobody
from hil.config.events import Fault
from hil.config.link import LinkConfig
from hil.core.errors import RigFault
from hil.tools.bringup.drive import OPEN_LOOP
from hil.tools.bringup.result import Side
from hil.wire import handshake
from hil.wire.link import BoardLink
from sim_twin.twin import Twin
from tests.bringup.rigs import SPEEDS, Onlooker, bring_up, lifted

# Terminal values of one motor of the thesis robot on blocks, by hand from the equations of
# docs/twin.md. Full speed w: friction 0.02 + 6e-4 w = 0.0364 N m wants 0.0364 / (0.36 x 0.7) =
# 0.144 A; bridge 1.2 x 0.289 / |(0.289, 0.2)| + 0.8 x 0.289 = 1.218 V, winding 0.722 V, battery
# 11.865 - 0.12 (0.25 + 4 x 0.144) = 11.766 V: w = (11.766 - 1.218 - 0.722) / 0.36.
TOP_SPEED_RAD_S = 27.29
# Breakaway: 0.03 N m wants 0.119 A; bridge 0.920 + 0.190 V, winding 0.595 V, of 11.83 V.
DEAD_DUTY = 0.144
# The duty is read where 0.3 rad/s shows, so it is a little high.
DEAD_DUTY_ERROR = 0.015


def test_a_sound_robot_passes_and_is_measured_as_it_is():
    """No complaint at all; dead zone, top speed and counts a turn are those of the plant."""
    twin = lifted()
    report, told = bring_up(twin)
    assert report.passed
    assert report.faults == []
    assert {check.state for check in report.checks} == {"ok", "note"}
    assert [check.name for check in report.checks if check.state == "note"] == ["overspeed"]
    assert told == report.checks
    found = report.measured
    for speeds in (found.top_speed_forward_rad_s, found.top_speed_backward_rad_s):
        assert speeds == pytest.approx((TOP_SPEED_RAD_S, TOP_SPEED_RAD_S), abs=0.05)
    for duties in (found.dead_duty_forward, found.dead_duty_backward):
        assert duties == pytest.approx((DEAD_DUTY, DEAD_DUTY), abs=DEAD_DUTY_ERROR)
    assert found.counts_per_turn == pytest.approx((1920, 1920), rel=0.01)
    assert found.battery_v == pytest.approx(11.83, abs=0.03)
    # 20 ms +- 10 ms each way, 28 bytes a frame there and back at 57,600 baud: 50 ms.
    assert found.round_trip_median_s == pytest.approx(0.050, abs=0.006)


def test_wheels_stand_whenever_a_person_is_spoken_to():
    """At every question and every printed line both sides turn by less than 0.05 rad/s."""
    twin = lifted()
    onlooker = Onlooker(twin)
    bring_up(twin, onlooker)
    assert len(onlooker.spoken_to) > 20
    assert max(onlooker.turning_rad_s) < 0.05


def test_the_board_is_left_as_it_was():
    """Disarmed, and every parameter of open loop has its old value again."""
    twin = lifted()
    bring_up(twin)
    link = BoardLink(twin.stream)
    handshake.finish(link, twin, handshake.connect(link, {}))
    assert not link.armed
    defaults = {entry.name: entry.default for entry in _firmware.parameter_table()}
    assert link.parameters == pytest.approx(defaults)
    assert any(defaults[name] != value for name, value in OPEN_LOOP.items())


@pytest.mark.parametrize("side", ["left", "right"])
@pytest.mark.parametrize(
    ("kind", "part", "fault"),
    [
        ("swapped_phases", "encoder", "swapped_phases"),
        ("dead_encoder", "encoder", "dead_encoder"),
        ("dead_channel_a", "encoder", "dead_channel"),
        ("dead_channel_b", "encoder", "dead_channel"),
        ("motor_reversed", "motor", "motor_reversed"),
        ("motor_stuck", "motor", "motor_stuck"),
    ],
)
def test_a_planted_fault_is_found_and_named(kind: str, side: Side, part: str, fault: str):
    """One fault on one side: that fault and no other; the sound side is measured all the same."""
    report, _ = bring_up(lifted(Fault(kind=kind, side=side)), turns=0.0)
    assert not report.passed
    assert report.faults == [(f"{side} {part}", fault)]
    sound = "right" if side == "left" else "left"
    assert [c.name for c in report.checks if "dead zone" in c.name] == [f"{sound} dead zone"]


@pytest.mark.parametrize("kind", ["motors_exchanged", "encoders_exchanged"])
def test_left_and_right_exchanged_is_found_and_named(kind: str):
    """Motor leads or encoder plugs exchanged: both sides say so, and no wheel goes fast."""
    report, _ = bring_up(lifted(Fault(kind=kind)))
    assert [fault for _, fault in report.faults] == [kind, kind]
    assert any(c.name == "top speed" and c.state == "skipped" for c in report.checks)


def test_both_exchanged_shows_to_the_eye_only():
    """Motors and encoders exchanged: counts agree with the drive, the wheels are the wrong ones."""
    faults = Fault(kind="motors_exchanged"), Fault(kind="encoders_exchanged")
    seen, _ = bring_up(lifted(*faults), turns=0.0)
    assert [name for _, name in seen.faults] == ["motors_exchanged", "encoders_exchanged"] * 2
    unseen, _ = bring_up(lifted(*faults), Nobody(), turns=0.0)
    assert unseen.passed


@pytest.mark.parametrize(
    ("kind", "fault"),
    [
        ("swapped_phases", "counts_against_drive"),
        ("motor_reversed", "counts_against_drive"),
        ("dead_encoder", "no_counts"),
        ("motor_stuck", "no_counts"),
        ("dead_channel_a", "dead_channel"),
    ],
)
def test_without_an_eye_a_fault_is_still_found(kind: str, fault: str):
    """What counts cannot tell apart is named as what it can be; nothing passes."""
    report, _ = bring_up(lifted(Fault(kind=kind, side="left")), Nobody(), turns=0.0)
    assert report.faults == [("left encoder", fault)]


@pytest.mark.parametrize(
    ("link", "fault"),
    [
        (LinkConfig(latency_s=0.2), ("link latency", "link_latency")),
        (LinkConfig(latency_s=0.02, latency_jitter_s=0.0, loss_ratio=0.08), ("link loss", "link_loss")),
    ],
)  # fmt: skip
def test_a_bad_link_is_named_and_no_wheel_is_driven_over_it(link: LinkConfig, fault):
    """200 ms each way, or one chunk in twelve lost: that check fails, the wheels never turn."""
    twin = lifted(link=link)
    report, _ = bring_up(twin)
    assert report.faults == [fault]
    assert report.checks[-1].name == "wheels"
    assert report.checks[-1].state == "skipped"
    assert twin._kernel.true_counts == (0, 0)


def test_a_low_battery_is_named_and_no_wheel_is_driven_on_it():
    """9.6 V is below BATT_LOW with its hysteresis."""
    twin = lifted(battery_full_v=9.9, battery_empty_v=9.0)
    report, _ = bring_up(twin)
    assert report.faults == [("battery", "battery_low")]
    assert twin._kernel.true_counts == (0, 0)


def test_another_encoder_than_believed_is_measured():
    """A robot with 1,632 counts a turn against a file that says 1,920: found by the turns seen."""
    report, _ = bring_up(lifted(encoder_counts_per_turn=1632))
    assert [fault for _, fault in report.faults] == ["counts_per_turn"] * 2
    assert report.measured.counts_per_turn == pytest.approx((1632, 1632), rel=0.01)


def test_a_board_that_resets_in_mid_drive_is_named():
    """Held in reset while the left side is driven: the check says that the board left ARMED."""
    twin = lifted(Fault(kind="board_reset", start_s=2.0, end_s=2.1))
    report, _ = bring_up(twin, Starter(twin))
    assert ("board", "board_stopped") in report.faults
    assert_stops(twin)


class Starter(Onlooker):
    """Lets the twin's timed events begin when the first wheels are about to be driven."""

    def watch(self, text: str) -> None:
        if not any("forward" in text for text in self.spoken_to):
            self._twin.begin(self._twin.now_s())
        super().watch(text)


class Watched:
    """A twin whose `wait` raises Ctrl-C when the wheels turn for the first time."""

    def __init__(self, twin: Twin) -> None:
        self._twin = twin
        self.pressed = False

    def __getattr__(self, name: str):
        return getattr(self._twin, name)

    def wait(self, until_s: float) -> None:
        self._twin.wait(until_s)
        if not self.pressed and abs(self._twin._kernel.state()[SPEEDS[0]]) > 5.0:
            self.pressed = True
            raise KeyboardInterrupt


def assert_stops(twin: Twin) -> None:
    """Let half a second pass without a host; no wheel turns then."""
    until_s = twin.now_s() + 0.5
    while twin.now_s() < until_s:
        twin.wait(until_s)
        twin.stream.read()
    assert max(abs(twin._kernel.state()[i]) for i in SPEEDS) < 0.05


def test_ctrl_c_stops_the_wheels():
    """Ctrl-C at 5 rad/s: the emergency stop is sent, parameters are put back, wheels stand."""
    twin = lifted()
    rig = Watched(twin)
    with pytest.raises(KeyboardInterrupt):
        bring_up(rig)  # type: ignore[arg-type]
    assert rig.pressed
    assert_stops(twin)
    link = BoardLink(twin.stream)
    handshake.finish(link, twin, handshake.connect(link, {}))
    assert link.state_name == "SAFE (STOP_COMMAND)"
    defaults = {entry.name: entry.default for entry in _firmware.parameter_table()}
    assert link.parameters["FF_GAIN"] == pytest.approx(defaults["FF_GAIN"])


def test_a_link_cut_in_mid_drive_ends_with_standing_wheels():
    """No report for half a second is a rig fault; the board has stopped by itself long before."""
    twin = lifted(Fault(kind="link_cut", start_s=1.5))
    with pytest.raises(RigFault, match="no wheel report"):
        bring_up(twin, Starter(twin))
    assert_stops(twin)
