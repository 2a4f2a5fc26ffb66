"""The host build of the firmware core and the ELF, fed with the same inputs, give the same PWM."""

import struct
from itertools import pairwise

import pytest

import hil.runs.execute
from hil.board import _firmware
from hil.config.load import load_scenario
from hil.rigs.targets.simulated import twin_setup
from hil.runs.execute import RunSpec, execute
from hil.wire.framing import HOST_SYSTEM, FrameReader
from sim_twin.pil import Pil
from tests.pil.memory import board_size_and, symbols
from tests.pil.rigs import Tap, needs_toolchain

pytestmark = needs_toolchain


@pytest.fixture(scope="module", params=["asg-ism", "asg-ism-implicit"])
def recorded(tmp_path_factory, request):
    """Run a scenario on the ELF: (snapshots of the board, frames of the host).

    A snapshot is of early in a tick, when its inputs are taken and the link rests: it has the PWM
    of the tick before.
    """
    scenario = load_scenario("scenario-1")
    rig = Pil(twin_setup(scenario, 1))
    rig.stream = Tap(rig.stream)
    size, inputs = board_size_and("inputs")
    base = symbols(rig.build.elf)["g_board"]
    rig.board.watch(base + inputs, base, size)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(hil.runs.execute, "open_rig", lambda *_: rig)
        spec = RunSpec(
            scenario=scenario,
            target="pil",
            camera="pose",
            outer="asg-ism",
            inner=request.param,
            seed=1,
            out=tmp_path_factory.mktemp("pil") / "run",
            rerun=False,
        )
        record = execute(spec)
    assert record.manifest.outcome == "complete"
    frames = [received.frame for received in FrameReader(HOST_SYSTEM).feed(rig.stream.written)]
    return rig.board.take_watched(), frames


def feed_to_host_build(snapshots, frames, miscount=0):
    """Return for each tick ((left, right) PWM of the host build, the same of the ELF).

    A frame is given to the host build before the first tick that the ELF had counted it in.
    """
    _, *places = board_size_and(
        "inputs", "wheel[0].pwm", "wheel[1].pwm", "link.received", "setpoint.t_us"
    )
    received = places[3]
    (heard,) = struct.unpack_from("<H", snapshots[-1], received)
    # What it did not hear came before it was up, or in its last tick: those too early would keep the
    # host build from arming.
    for early in range(len(frames) - heard + 1):
        pairs = side_by_side(snapshots, iter(frames[early:]), places, miscount)
        if any(pwm != (0, 0) for pwm, _ in pairs):
            break
    return pairs


def side_by_side(snapshots, waiting, places, miscount):
    """Return the pairs of `feed_to_host_build` for frames that the ELF heard."""
    inputs, left, right, received, setpoint_us = places
    host = _firmware.Board()
    pairs = []
    for snapshot, after in pairwise(snapshots):
        t_us, counts_left, *rest = struct.unpack_from("<IiiHH", snapshot, inputs)
        (arrived,) = struct.unpack_from("<H", snapshot, received)
        while host.received_frames < arrived:
            host.receive(next(waiting), *struct.unpack_from("<I", snapshot, setpoint_us))
        pwm = host.tick(t_us, counts_left + (miscount if len(pairs) % 2 else 0), *rest)
        host.transmit(255)
        on_elf = tuple(struct.unpack_from("<h", after, place)[0] for place in (left, right))
        pairs.append((pwm, on_elf))
    return pairs


def test_pwm_is_equal_over_a_whole_run(recorded):
    """Scenario 1 on the ELF, every tick of it: the host build's PWM is the ELF's, bit for bit.

    Allowed is one count; avr-libc's single floats round as IEEE 754 asks, so that none is needed.
    """
    pairs = feed_to_host_build(*recorded)
    assert len(pairs) > 4000
    # about 4 s of way, then rest at the goal
    assert sum(pwm != (0, 0) for _, pwm in pairs) > 800, "the run hardly moved"
    first = next((item for item in enumerate(pairs) if item[1][0] != item[1][1]), None)
    assert first is None, f"first difference at tick {first[0]}: host, ELF = {first[1]}"


def test_other_inputs_give_other_pwm(recorded):
    """The comparison bites: one count more at the left wheel on every other tick, and PWM differs."""
    pairs = feed_to_host_build(*recorded, miscount=1)
    assert max(abs(a - b) for one, two in pairs for a, b in zip(one, two, strict=True)) > 1
