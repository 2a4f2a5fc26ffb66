"""The serial target and the served board, in real time through a real pseudo-terminal."""

import socket
import threading
import time
from contextlib import contextmanager

import cv2
import numpy as np
import pytest

from hil.board import _firmware
from hil.core.errors import BadInput, RigFault
from hil.core.rig import Frame
from hil.core.types import Pose, PoseMeasurement
from hil.rigs.frames import CaptureSource, SocketSource, encode_frame, open_source
from hil.rigs.serial import SerialRig, SerialStream, parse_target
from hil.tools.serve_twin import TwinServer
from hil.wire import handshake, identity
from hil.wire.link import BoardLink
from tests.wire.board_rig import BoardRig

pytestmark = pytest.mark.realtime

DEFAULTS = {entry.name: entry.default for entry in _firmware.parameter_table()}
IMAGE = np.arange(48 * 64 * 3, dtype=np.uint32).astype(np.uint8).reshape(48, 64, 3)
SEEN = PoseMeasurement(Pose(0.1, -0.2, 3.0), 0.9, "", 0.001, 0.01, {"gap_px": 3.5})


class FilmedBoard(BoardRig):
    """A compiled board with a camera of 30 Hz that shows image and pose in turn."""

    def __init__(self) -> None:
        super().__init__()
        self.frames = 0
        self.begun_s: list[float] = []

    def begin(self, t_start_s: float) -> None:
        self.begun_s.append(t_start_s)

    def poll_frame(self) -> Frame | None:
        if self.now_s() * 30.0 < self.frames:
            return None
        index, self.frames = self.frames, self.frames + 1
        even = index % 2 == 0
        return Frame(index, 500.0 + index / 30.0, IMAGE if even else None, None if even else SEEN)


def repeat(call, take=lambda _: None) -> None:
    """Call for two seconds, handing on what comes."""
    end_s = time.monotonic() + 2.0
    while time.monotonic() < end_s:
        take(call())
        time.sleep(0.002)


@contextmanager
def served(folder, rig=None):
    """Serve a board from a thread; yield the server."""
    server = TwinServer(rig or FilmedBoard(), folder / "board", folder / "camera")
    stop_s = [float("inf")]

    def run():
        while time.monotonic() < stop_s[0]:
            server.run(time.monotonic() + 0.05)

    thread = threading.Thread(target=run)
    thread.start()
    try:
        yield server
    finally:
        stop_s[0] = 0.0
        thread.join()
        server.close()


def test_a_board_on_a_pseudo_terminal_is_met_like_a_real_one(tmp_path):
    """Connect, arm, drive and disarm in real time; frames arrive whole; events begin at arming."""
    board = FilmedBoard()
    with served(tmp_path, board) as server:
        rig = SerialRig(str(tmp_path / "board"), 57_600, open_source(f"twin:{tmp_path / 'camera'}"))
        link = BoardLink(rig.stream)
        handshake.finish(link, rig, handshake.connect(link, DEFAULTS))
        handshake.finish(link, rig, handshake.arm(link, *identity.board_hashes(link.parameters)))
        trips, frames, due_s = [], [], rig.now_s()
        end_s = due_s + 1.0
        while rig.now_s() < end_s:
            if rig.now_s() >= due_s:
                due_s += 1 / 30
                link.send_setpoint(rig.now_s(), 3.0, 2.0)
            rig.wait(due_s)
            reports = link.poll(rig.now_s())
            trips += [r.round_trip_s for r in reports if r.round_trip_s == r.round_trip_s]
            while frame := rig.poll_frame():
                frames.append(frame)
        assert link.armed
        assert board.pwm[0] > 40
        handshake.finish(link, rig, handshake.disarm(link))
        rig.close()
        rig.close()
    assert len(board.begun_s) == 1
    assert len(trips) > 20
    assert sorted(trips)[len(trips) // 2] < 0.015
    assert link.counters.lost == 0
    assert [f.index for f in frames] == list(range(frames[0].index, frames[-1].index + 1))
    image = next(f for f in frames if f.image is not None)
    assert np.array_equal(image.image, IMAGE)
    assert image.t_cam_s == 500.0 + image.index / 30.0
    assert next(f for f in frames if f.pose is not None).pose == SEEN
    assert server.worst_lag_s < 0.1
    assert not (tmp_path / "board").is_symlink()
    assert not (tmp_path / "camera").exists()


def test_a_viewer_that_does_not_read_holds_nobody_up(tmp_path):
    """A client of the camera socket that never reads: the server keeps time, others get frames."""
    big = np.zeros((480, 640, 3), np.uint8)

    class Filmed(FilmedBoard):
        def poll_frame(self) -> Frame | None:
            frame = super().poll_frame()
            return Frame(frame.index, frame.t_cam_s, big) if frame else None

    with served(tmp_path, Filmed()) as server:
        lazy = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        lazy.connect(str(tmp_path / "camera"))
        source = SocketSource(str(tmp_path / "camera"))
        time.sleep(1.0)
        latest = source.poll()
        assert latest is not None
        source.close()
        lazy.close()
    assert server.worst_lag_s < 0.1


def test_a_board_unplugged_in_use_is_a_rig_fault(tmp_path):
    """The port closes under the host: reading says so in one line, and so does the camera."""
    with served(tmp_path):
        stream = SerialStream(str(tmp_path / "board"), 57_600)
        source = SocketSource(str(tmp_path / "camera"))
        time.sleep(0.1)
    with pytest.raises(RigFault, match="gone while in use"):
        repeat(stream.read)  # what lay in the buffer may come first
    with pytest.raises(RigFault, match="closed the socket"):
        repeat(source.poll)
    stream.close()
    source.close()


def test_a_port_in_use_is_a_rig_fault(tmp_path):
    """A second program on the same port is told so."""
    with served(tmp_path):
        first = SerialStream(str(tmp_path / "board"), 57_600)
        with pytest.raises(RigFault, match="in use by another program"):
            SerialStream(str(tmp_path / "board"), 57_600)
        first.close()


def test_ports_and_cameras_that_are_not_there(tmp_path):
    """Missing port, no port at all, missing socket, missing camera: one line each."""
    with pytest.raises(RigFault, match=r"no_such: no such port; `hil doctor`"):
        SerialStream(str(tmp_path / "no_such"), 57_600)
    (tmp_path / "file").touch()
    with pytest.raises(RigFault, match="file: not a serial port"):
        SerialStream(str(tmp_path / "file"), 57_600)
    with pytest.raises(RigFault, match="hil twin serve"):
        open_source(f"twin:{tmp_path / 'none'}")
    with pytest.raises(BadInput, match="neither a camera index"):
        open_source("rendered")


def test_a_camera_that_is_not_there_is_a_rig_fault():
    """An index without a camera is one line."""
    with pytest.raises(RigFault, match="camera 97: cannot be opened"):
        open_source("97")


@pytest.mark.parametrize(
    ("text", "device", "baud"),
    [
        ("serial:/dev/ttyUSB0", "/dev/ttyUSB0", 57_600),
        ("serial:/dev/ttyACM0@115200", "/dev/ttyACM0", 115_200),
        ("serial:COM5@9600", "COM5", 9_600),
    ],
)
def test_targets_name_port_and_baud_rate(text, device, baud):
    """serial:DEV[@BAUD], 57,600 when nothing is said."""
    assert parse_target(text) == (device, baud)


@pytest.mark.parametrize("text", ["serial:", "serial:/dev/x@fast", "serial:/dev/x@300"])
def test_bad_serial_targets_are_refused(text):
    """No port, no number, a rate below 1,200 bit/s: bad input with what would do."""
    with pytest.raises(BadInput, match="serial:"):
        parse_target(text)


def test_a_path_that_is_taken_is_refused(tmp_path):
    """A file in the place of the pseudo-terminal is left alone."""
    taken = tmp_path / "taken"
    taken.write_text("mine")
    with pytest.raises(BadInput, match="--pty"):
        TwinServer(FilmedBoard(), taken, tmp_path / "camera")
    with pytest.raises(BadInput, match="--frames"):
        TwinServer(FilmedBoard(), tmp_path / "board", taken)
    assert taken.read_text() == "mine"
    assert not (tmp_path / "board").is_symlink()


def test_a_video_file_is_played_at_its_own_rate(tmp_path):
    """Six frames at 20 Hz arrive 50 ms apart on their own stamps; the end of the file is said."""
    path = str(tmp_path / "film.avi")
    writer = cv2.VideoWriter(path, cv2.VideoWriter.fourcc(*"MJPG"), 20.0, (64, 48))
    for _ in range(6):
        writer.write(IMAGE)
    writer.release()
    source, seen = CaptureSource(path), []
    with pytest.raises(RigFault, match="end of file after 6 frames"):
        repeat(source.poll, lambda frame: frame and seen.append((frame, time.monotonic())))
    source.close()
    frames, arrivals_s = zip(*seen, strict=True)
    assert [f.index for f in frames] == list(range(6))
    assert frames[5].t_cam_s - frames[0].t_cam_s == pytest.approx(0.25, abs=1e-3)
    assert arrivals_s[5] - arrivals_s[0] == pytest.approx(0.25, abs=0.06)
    assert frames[0].image.shape == (48, 64, 3)


def test_a_frame_is_a_line_of_json_and_its_bytes():
    """What the socket gives can be read without this project."""
    head, _, body = encode_frame(Frame(3, 1.5, IMAGE)).partition(b"\n")
    assert head == b'{"index": 3, "t_cam_s": 1.5, "shape": [48, 64, 3]}'
    assert body == IMAGE.tobytes()
