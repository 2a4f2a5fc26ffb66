"""The served twin under hosts that send too much, and beside other servers; stalls of the server."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time

import pytest

from hil.core.errors import BadInput, RigFault
from hil.core.rig import PORT_BYTES, LineBacklog
from hil.rigs.serial import SerialRig, SerialStream
from hil.tools.serve_twin import TwinServer
from hil.wire import dialect, handshake
from hil.wire.framing import FrameReader, FrameWriter
from hil.wire.link import BoardLink
from tests.twin.rigs import FAST_LINK, Drive, armed
from tests.twin.test_twin import twin
from tests.wire.test_served import FilmedBoard, served

pytestmark = pytest.mark.realtime

SAFE = dialect.HIL_STATE_SAFE
LINE_BYTES_1_S = 5760


# ---- a port that is full ----


def test_the_backlog_of_a_line_is_counted_and_bounded():
    """57,600 baud carry 5,760 bytes a second; a write that would make 4,097 wait is refused whole."""
    line = LineBacklog(57_600)
    line.write(10.0, PORT_BYTES)
    assert line.waiting_bytes(10.0) == pytest.approx(4096)
    with pytest.raises(RigFault, match="port is full: 4096 bytes wait for a line of 5760 byte/s"):
        line.write(10.0, 1)
    line.write(10.1, 576)
    assert line.waiting_bytes(10.1) == pytest.approx(4096)
    assert line.waiting_bytes(11.0) == 0.0


def test_a_host_that_sends_faster_than_the_line_meets_a_full_port():
    """Set-points at twice the line's rate: RigFault before a second is over, not an endless queue."""

    def send(drive: Drive, count: int) -> None:
        for _ in range(count):
            drive.link.send_setpoint(drive.twin.now_s(), 1.0, 1.0)
            drive.twin.wait(drive.twin.now_s() + 0.002)

    send(armed(), 1000)  # 1 Mbaud carries them
    slow = Drive(link=FAST_LINK.model_copy(update={"baud": 57_600}))
    begin_s = slow.twin.now_s()
    with pytest.raises(RigFault, match="twin: port is full"):
        send(slow, 1000)
    assert slow.twin.now_s() - begin_s < 1.0


def test_a_stop_goes_out_before_what_waits():
    """4,000 bytes of set-points wait for the line, which takes 0.7 s: a stop acts within 0.1 s."""
    drive = armed(link=FAST_LINK.model_copy(update={"baud": 57_600}))
    drive.run(0.5, 5.0, 5.0)
    while drive.twin.stream.room_bytes() > 100:
        drive.link.send_setpoint(drive.twin.now_s(), 5.0, 5.0)
    drive.link.stop_now(drive.twin.now_s())
    drive._until(drive.twin.now_s() + 0.1)
    assert drive.twin._kernel.duty == (0.0, 0.0)
    assert drive.reports[-1].wire.state == SAFE


def test_room_comes_back_at_the_pace_of_the_line():
    """A full port takes a set-point again after the time one takes on the line, and not before."""
    rig = twin()
    rig.stream.write(bytes(PORT_BYTES))
    assert rig.stream.room_bytes() == 0
    with pytest.raises(RigFault, match="port is full"):
        rig.stream.write(bytes(22))
    end_s = rig.now_s() + 23 / LINE_BYTES_1_S
    while rig.now_s() < end_s:
        rig.wait(end_s)
    rig.stream.write(bytes(22))


def write_until_blocked(descriptor: int, data: bytes, most: int) -> int:
    """Write without blocking until the port takes no more for 50 ms; return how many bytes it took."""
    os.set_blocking(descriptor, False)
    taken, since_s = 0, time.monotonic()
    while taken < most and time.monotonic() - since_s < 0.05:
        try:
            taken += os.write(descriptor, data)
            since_s = time.monotonic()
        except BlockingIOError:
            continue
    return taken


def test_a_raw_writer_is_blocked_and_answered_when_the_line_has_carried_its_bytes(tmp_path):
    """A writer without a pause is held up within some kilobytes; TIMESYNC behind them is answered."""
    rig = twin()
    with served(tmp_path, rig):
        stream = SerialStream(str(tmp_path / "board"), 57_600)
        # Held up for good only while the line is slower than the writer: what it takes is the buffers'.
        taken = write_until_blocked(stream.port.fileno(), bytes(64), 200_000)
        assert 2_000 < taken < 60_000
        assert rig.stream.room_bytes() < PORT_BYTES
        os.set_blocking(stream.port.fileno(), True)
        asked = FrameWriter().encode(dialect.MAVLink_timesync_message(0, 77))
        os.write(stream.port.fileno(), asked)
        reader, answers = FrameReader(), []
        end_s = time.monotonic() + 30.0
        while not answers and time.monotonic() < end_s:
            found = reader.feed(stream.read())
            answers = [m for i, m, _ in found if i == dialect.MAVLINK_MSG_ID_TIMESYNC]
            time.sleep(0.005)
        stream.close()
    assert [answer.ts1 for answer in answers] == [77]


def test_a_host_notices_the_full_port_and_its_stop_acts_at_once(tmp_path):
    """BoardLink far above the line's rate over the pseudo-terminal: one line, and then SAFE."""
    with served(tmp_path, twin()):
        rig = SerialRig(str(tmp_path / "board"), 57_600, None)
        link = BoardLink(rig.stream)
        handshake.finish(link, rig, handshake.read_info(link))
        info = link.info
        handshake.finish(link, rig, handshake.arm(link, info.dialect_hash, info.parameter_hash))

        def flood() -> None:
            for _ in range(3000):  # without a pause: far above the line's rate on any machine
                link.send_setpoint(rig.now_s(), 3.0, 3.0)

        with pytest.raises(RigFault, match="port is full"):
            flood()
        seen_safe = link.native.state == SAFE
        asked_s = rig.now_s()
        link.stop_now(asked_s)
        while link.native.state != SAFE and rig.now_s() < asked_s + 10.0:
            rig.wait(rig.now_s() + 0.01)
            link.poll(rig.now_s())
        assert link.native.state == SAFE
        assert not seen_safe
        rig.close()


# ---- names ----


def test_names_in_use_are_refused_and_stay(tmp_path):
    """A second server on the port's or the camera's name: refused with the holder; the first goes on."""
    board, camera = tmp_path / "board", tmp_path / "camera"
    with served(tmp_path):
        device = os.readlink(board)
        with pytest.raises(BadInput, match=rf"--pty .*in use .*pid {os.getpid()}"):
            TwinServer(FilmedBoard(), board, tmp_path / "other")
        with pytest.raises(BadInput, match=r"--frames .*in use"):
            TwinServer(FilmedBoard(), tmp_path / "other", camera)
        assert os.readlink(board) == device
        assert camera.is_socket()
        assert sorted(path.name for path in tmp_path.iterdir() if path.name[0] != ".") == [
            "board", "camera",
        ]  # fmt: skip
        stream = SerialStream(str(board), 57_600)
        stream.close()
    assert list(tmp_path.iterdir()) == []


def test_only_its_own_names_are_removed(tmp_path):
    """Names that became another's in the meantime are left to it."""
    board, camera = tmp_path / "board", tmp_path / "camera"
    server = TwinServer(FilmedBoard(), board, camera)
    board.unlink()
    board.symlink_to("/dev/pts/ptmx")
    camera.unlink()
    camera.write_text("mine")
    server.close()
    assert os.readlink(board) == "/dev/pts/ptmx"
    assert camera.read_text() == "mine"


def test_links_that_no_server_left_are_not_replaced(tmp_path):
    """A link to a device or file, as udev makes them, and one to a terminal that is alive: refused."""
    master, slave = os.openpty()
    for target in ("/dev/null", str(tmp_path / "nowhere"), os.ttyname(slave)):
        link = tmp_path / "board"
        link.symlink_to(target)
        with pytest.raises(BadInput, match="no server left behind"):
            TwinServer(FilmedBoard(), link, tmp_path / "camera")
        assert os.readlink(link) == target
        link.unlink()
    os.close(master)
    os.close(slave)


def test_names_of_a_killed_server_are_taken_over(tmp_path):
    """SIGKILL leaves both names; the next server takes them though the terminal's number is in use."""
    code = (
        "import sys, time; from pathlib import Path; from hil.tools.serve_twin import TwinServer\n"
        "from tests.wire.test_served import FilmedBoard\n"
        "server = TwinServer(FilmedBoard(), Path(sys.argv[1]), Path(sys.argv[2]))\n"
        "print('up', flush=True); time.sleep(60)\n"
    )
    names = [str(tmp_path / "board"), str(tmp_path / "camera")]

    child = subprocess.Popen(
        [sys.executable, "-c", code, *names], stdout=subprocess.PIPE, text=True
    )
    assert child.stdout is not None
    assert child.stdout.readline() == "up\n"
    child.send_signal(signal.SIGKILL)
    child.wait()
    child.stdout.close()
    assert os.path.islink(names[0])
    master, slave = os.openpty()  # may well be the number that the killed server had
    with served(tmp_path):
        assert os.readlink(names[0]) != os.ttyname(slave)
    os.close(master)
    os.close(slave)
    assert list(tmp_path.iterdir()) == []


# ---- a server that is held up ----


def test_a_stall_of_the_server_makes_the_twins_clock_slip(tmp_path):
    """Held up for 0.4 s, the twin lives through less than 0.2 s of it, and the rest is told."""
    board = FilmedBoard()
    server = TwinServer(board, tmp_path / "board", tmp_path / "camera")
    server.run(time.monotonic() + 0.2)
    before_s = board.now_s()
    watch = server._watch

    def stall(data: bytes) -> None:
        server._watch = watch
        time.sleep(0.4)
        watch(data)

    server._watch = stall
    begin_s = time.monotonic()
    server.run(begin_s + 0.6)
    passed_s = time.monotonic() - begin_s
    server.close()
    assert server.worst_lag_s >= 0.39
    assert server.slipped_s >= 0.35
    assert board.now_s() - before_s == pytest.approx(passed_s - server.slipped_s, abs=0.05)
