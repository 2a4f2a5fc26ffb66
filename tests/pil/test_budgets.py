"""What the firmware may cost its processor; the limits are the requirement's, kept with a margin."""

import pytest

from hil.board.build import FLASH_LIMIT_BYTES, RAM_LIMIT_BYTES
from hil.board.stack_bound import RAM_BYTES
from hil.tools.firmware_cost import CLOCK_HZ, TICKS_PER_S, Bench, measure
from hil.wire import dialect
from hil.wire.signing import Key
from tests.pil.rigs import needs_toolchain
from tests.twin.rigs import robot

pytestmark = needs_toolchain

MARGIN = 0.95
STACK_LIMIT_BYTES = 1024
# A byte at 57,600 baud lasts 2,778 cycles and the UART holds two; edges of one wheel at 8,000 a
# second are 2,000 cycles apart. A tenth of that is little, and more than a handler ever needs.
INTERRUPTS_OFF_CYCLES = 200


@pytest.fixture(scope="module")
def cost():
    """Return the measured cost."""
    return measure(robot())


def test_memory(cost):
    """Flash at most 48 KB, static RAM at most 4 KB, stack on any path at most 1 KB."""
    assert 10_000 < cost.flash_bytes <= MARGIN * FLASH_LIMIT_BYTES
    assert 1_000 < cost.ram_bytes <= MARGIN * RAM_LIMIT_BYTES
    assert 100 < cost.stack_bytes <= cost.stack_bound_bytes <= MARGIN * STACK_LIMIT_BYTES
    assert cost.ram_bytes + cost.stack_bound_bytes < 0.6 * RAM_BYTES


def test_tick_and_link_take_at_most_two_fifths_of_the_processor(cost):
    """Both wheels at 250 Hz, all traffic included, while set-points change at 30 Hz."""
    assert 0.1 < cost.tick_and_link_ratio <= MARGIN * 0.40, cost.cycles_per_tick


def test_the_parts_add_up_to_the_time_awake(cost):
    """No cycle is missing from the table: its sum is the time not asleep, measured apart."""
    total = sum(cost.cycles_per_tick.values()) * TICKS_PER_S / CLOCK_HZ
    assert total == pytest.approx(cost.awake_ratio, abs=0.01)


def test_encoder_interrupt(cost):
    """At most 100 cycles from the edge's response to the return, whatever the transition."""
    assert 40 < cost.encoder_interrupt_cycles <= MARGIN * 100


def test_no_edge_is_lost_at_full_speed(cost):
    """8,000 edges a second on both wheels, armed and under full traffic: every one is counted."""
    assert cost.edges_lost == 0
    assert cost.awake_full_ratio < 0.6


def test_interrupts_are_never_off_for_long(cost):
    """Longest stretch with interrupts off, handlers included."""
    assert 30 < cost.interrupts_off_cycles <= INTERRUPTS_OFF_CYCLES


def test_no_frame_takes_longer_than_a_tick(cost):
    """Its bytes' interrupts, parse, answer and the new tuning that may follow: below 4 ms each."""
    assert min(cost.frames.us.values()) > 100
    assert cost.frames.costliest_us <= MARGIN * 4000, cost.frames.us


def test_a_tick_waits_for_one_frame_at_most(cost):
    """Under floods at line rate a tick begins less than 1 ms late, and ends before the next is due."""
    assert 0 < cost.frames.latest_us <= MARGIN * 1000
    assert cost.frames.latest_us + cost.longest_tick_us <= 0.75 * 4000


def test_a_flood_of_frames_makes_no_tick_late(cost):
    """PARAM_SETs at line rate while armed, defaults ordered a hundred times a second: no overrun."""
    assert (cost.frames.overruns, cost.frames.bad_frames) == (0, 0)


def test_the_longest_tick_leaves_room(cost):
    """The board's own account of its longest tick, interrupts during it included."""
    assert 500 < cost.longest_tick_us < 0.6 * 4000


def test_the_implicit_wheel_law_costs_less_than_the_default_one(cost):
    """No division, no root: fewer cycles of control for both wheels, within the same budget."""
    implicit = measure(robot(), {"LAW": 2.0})
    control = "tick: control"
    assert implicit.cycles_per_tick[control] < 0.85 * cost.cycles_per_tick[control]
    assert 0.1 < implicit.tick_and_link_ratio <= MARGIN * 0.40


@pytest.fixture
def signed_bench():
    """Return a board with a key, armed, and its host."""
    return Bench(robot(), {}, Key(bytes(range(1, 33)), "key"))


def _status(bench):
    """Return the board's next account of what it lost, while set-points keep it armed."""
    bench.link.forget_sys_status()
    while bench.link.sys_status is None:
        bench.drive(0.1, lambda _: (3.0, 3.0))
    return bench.link.sys_status


@pytest.fixture(scope="module")
def signed():
    """Return the cost with a signing key: every frame of both sides signed."""
    return measure(robot(), key=Key(bytes(range(1, 33)), "key"))


def test_signing_leaves_tick_and_link_their_budget(signed, cost):
    """Longer frames both ways; the hashing itself is done between ticks, when nothing else is to do."""
    assert cost.tick_and_link_ratio < signed.tick_and_link_ratio <= 0.40, signed.cycles_per_tick
    assert cost.cycles_per_tick["signing"] < 100
    assert 10_000 < signed.cycles_per_tick["signing"] < 18_000
    assert signed.awake_ratio < 0.75


def test_signing_makes_no_tick_late(signed):
    """Under floods of signed frames at line rate, which are more than can be checked, too."""
    assert signed.frames.overruns == 0
    assert 0 < signed.frames.latest_us <= MARGIN * 1000
    assert signed.frames.latest_us + signed.longest_tick_us <= 0.75 * 4000


def test_a_signed_session_loses_no_frame(signed_bench):
    """Set-points at 100 Hz beside reports at 50, all signed: none lost, refused or dropped, no tick late."""
    link, rig = signed_bench.link, signed_bench.rig
    _status(signed_bench)
    begin_s = rig.now_s()
    for count in range(200):
        link.send_setpoint(rig.now_s(), 3.0, 3.0)
        signed_bench.listen(begin_s + (count + 1) / 100)
    after = _status(signed_bench)
    lost = (after.errors_comm, after.errors_count1, after.errors_count2, after.errors_count3)
    assert lost == (0, 0, 0, 0)
    assert after.errors_count4 == 0
    assert signed_bench.last.state == dialect.HIL_STATE_ARMED


def test_signing_loses_no_edge_and_keeps_the_stack(signed):
    """8,000 edges a second on both wheels, every frame signed: all counted, and time left over."""
    assert signed.edges_lost == 0
    assert signed.awake_full_ratio < 0.80
    assert signed.interrupts_off_cycles <= INTERRUPTS_OFF_CYCLES
    assert signed.stack_bytes <= signed.stack_bound_bytes
