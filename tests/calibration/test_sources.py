"""Frame sources: stamps, stalls, stale frames, files that are damaged or cut off."""

import re
import select
import socket
import threading
import time

import cv2
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from hil.config.camera import CameraConfig
from hil.core.errors import BadInput, RigFault
from hil.core.rig import Frame
from hil.rigs.frames import controls_of, encode_frame, open_source
from vision import cv_compat
from vision.camera_watch import FrameWatch
from vision.sources import CameraControls, ImageFolder, LiveCamera, VideoFile

pytestmark = pytest.mark.realtime

PERIOD_S = 0.02


class FakeCapture:
    """A camera at 50 Hz with three stale frames in its queue; `block` freezes it, `gone` ends it."""

    def __init__(self, stamps=True, opened=True):
        self.values = {
            cv2.CAP_PROP_FRAME_WIDTH: 64.0,
            cv2.CAP_PROP_FRAME_HEIGHT: 48.0,
            cv2.CAP_PROP_FPS: 50.0,
            cv2.CAP_PROP_EXPOSURE: 157.0,
            cv2.CAP_PROP_GAIN: 12.0,
            cv2.CAP_PROP_WB_TEMPERATURE: 4100.0,
        }
        self.refused = {cv2.CAP_PROP_AUTOFOCUS}
        self.dropped = {cv2.CAP_PROP_FRAME_WIDTH, cv2.CAP_PROP_FRAME_HEIGHT}
        self.stamps, self.opened = stamps, opened
        self.block, self.gone = threading.Event(), threading.Event()
        self.count, self.queued, self.stamp_s, self.released = 0, 0, 0.0, False

    def isOpened(self):  # noqa: N802 - OpenCV's name
        return self.opened

    def grab(self):
        if self.gone.is_set():
            return False
        while self.block.is_set() and not self.gone.is_set():
            time.sleep(0.005)
        self.count += 1
        if self.count == 20:
            self.queued = 3
        if self.queued:
            self.queued -= 1
            self.stamp_s = time.monotonic() - 0.5
            return True
        if self.count > 20:
            time.sleep(PERIOD_S)
        self.stamp_s = time.monotonic() - 0.004
        return True

    def retrieve(self):
        return True, np.full((48, 64, 3), self.count % 250, np.uint8)

    def get(self, key):
        if key == cv2.CAP_PROP_POS_MSEC:
            return self.stamp_s * 1e3 if self.stamps else 0.0
        return self.values.get(key, 0.0)

    def set(self, key, value):
        if key in self.refused:
            return False
        if key not in self.dropped:
            self.values[key] = value
        return True

    def release(self):
        self.released = True


def take(camera, count):
    return [camera.read() for _ in range(count)]


def test_live_frames_carry_the_time_of_their_grab():
    """Driver stamps where there are some, else arrival; the true rate is measured from them."""
    camera = LiveCamera(0, capture=FakeCapture())
    frames = take(camera, 12)
    camera.close()
    stamps = [frame.t_cam_s for frame in frames]
    assert [frame.index for frame in frames] == list(range(12))
    assert np.median(np.diff(stamps)) == pytest.approx(PERIOD_S, rel=0.3)
    assert camera.rate_hz == pytest.approx(1 / PERIOD_S, rel=0.3)
    without = LiveCamera(0, capture=FakeCapture(stamps=False))
    before_s = time.monotonic()
    frame = without.read()
    without.close()
    assert before_s - 0.1 < frame.t_cam_s <= time.monotonic()


def test_frames_that_waited_in_the_drivers_queue_are_thrown_away():
    """Three frames half a second old lie in the queue at the start; none of them comes through."""
    opened_s = time.monotonic()
    camera = LiveCamera(0, capture=FakeCapture())
    frames = take(camera, 3)
    camera.close()
    assert all(frame.t_cam_s > opened_s - 0.1 for frame in frames)


def test_a_camera_that_freezes_is_noticed_within_200_ms():
    """From the last frame to the fault: 0.2 s and a poll; before that nothing is said."""
    capture = FakeCapture()
    camera = LiveCamera(0, capture=capture)
    take(camera, 3)
    capture.block.set()
    with pytest.raises(RigFault, match=r"no frame for 0\.2"):
        take(camera, 20)
    capture.gone.set()
    camera.close()


def test_a_camera_that_is_unplugged_is_noticed_at_once():
    """The driver's refusal becomes a rig fault with the number of frames seen."""
    capture = FakeCapture()
    camera = LiveCamera(0, capture=capture)
    take(camera, 3)
    capture.gone.set()
    with pytest.raises(RigFault, match="was it unplugged"):
        take(camera, 50)
    camera.close()
    camera.close()
    assert capture.released


def test_exposure_gain_and_white_balance_are_locked():
    """At what the automatics chose, or at given values; what the driver refuses is listed."""
    capture = FakeCapture()
    camera = LiveCamera(0, CameraControls(exposure=80.0), capture)
    camera.close()
    assert camera.locked == {"exposure": 80.0, "gain": 12.0, "white_balance_k": 4100.0}
    assert camera.unlocked == ["focus"]
    assert capture.values[cv2.CAP_PROP_AUTO_EXPOSURE] == 1.0
    assert capture.values[cv2.CAP_PROP_AUTO_WB] == 0.0


def test_what_a_driver_drops_without_a_word_is_said_with_the_first_frame():
    """Exposure asked at 80, 157 stays in force; YUYV comes where MJPG was asked for."""
    capture = FakeCapture()
    capture.values[cv2.CAP_PROP_FOURCC] = float(cv2.VideoWriter.fourcc(*"YUYV"))
    capture.dropped = {cv2.CAP_PROP_EXPOSURE, cv2.CAP_PROP_FOURCC}
    camera = LiveCamera(0, CameraControls(exposure=80.0, focus=3.0), capture)
    first, second = take(camera, 2)
    camera.close()
    assert camera.refused == [("exposure", 80.0, 157.0)]
    assert first.note == (
        "exposure: 80 asked for, 157 in force; focus: cannot be set;"
        " pictures come as YUYV, MJPG asked for"
    )
    assert second.note == ""
    raw = LiveCamera(0, CameraControls(raw=True), FakeCapture())
    assert take(raw, 1)[0].note == "focus: left to the camera's automatics"
    raw.close()


def test_a_frame_that_comes_twice_is_left_out_and_named():
    """Every third picture is the one before: they do not come through, and the third is told of."""
    watch = FrameWatch(50.0)
    rng = np.random.default_rng(3)
    picture, new, told = None, [], []
    for k in range(12):
        if k % 3 != 2:
            picture = rng.integers(0, 255, (48, 64, 3), np.uint8)
        new.append(watch.take(k * PERIOD_S, k * PERIOD_S + 0.004, picture))
        told.append(watch.said())
    assert new == [True, True, False] * 4
    assert watch.repeated == 4
    assert [text for text in told if text] == [
        "3 of its last 9 frames are the one before once more"
    ]


@pytest.mark.parametrize(("rate_hz", "age_s", "told"), [
    (50.0, 0.004, ""),
    (50.0, 0.09, "frames are 90 ms old when they arrive, 4.5 periods: its driver keeps a queue"),
    (25.0, 0.004, "gives 25.0 Hz, 50 Hz were asked for; a shorter exposure or a smaller frame may help"),
])  # fmt: skip
def test_rate_and_age_are_measured_and_named_once(rate_hz, age_s, told):
    """120 frames; what is as it should be is not spoken of."""
    watch, rng = FrameWatch(50.0), np.random.default_rng(4)
    said = []
    for k in range(120):
        stamp_s = k / rate_hz
        picture = rng.integers(0, 255, (48, 64, 3), np.uint8)
        assert watch.take(stamp_s, stamp_s + age_s, picture)
        said.append(watch.said())
    assert [text for text in said if text] == ([told] if told else [])
    assert watch.rate_hz == pytest.approx(rate_hz)
    assert watch.age_s == pytest.approx(age_s)


def test_a_camera_that_freezes_on_one_picture_is_a_fault():
    """Stamps run on, the picture does not: after 0.2 s no new frame has come, and it says why."""
    capture = FakeCapture()
    camera = LiveCamera(0, capture=capture)
    take(camera, 3)
    capture.retrieve = lambda: (True, np.full((48, 64, 3), 7, np.uint8))
    with pytest.raises(RigFault, match=r"no frame for 0\.2.* the one before once more"):
        take(camera, 40)
    capture.gone.set()
    camera.close()


def test_a_camera_unplugged_and_back_goes_on_where_that_is_allowed():
    """Gone after three frames and back at the second try: numbers go on, controls are set anew."""
    first, second = FakeCapture(), FakeCapture()
    tries = [FakeCapture(opened=False), second]
    camera = LiveCamera(
        0, CameraControls(exposure=80.0), first, patience_s=5.0, opener=lambda _: tries.pop(0)
    )
    before = take(camera, 3)
    first.gone.set()
    after = take(camera, 8)
    camera.close()
    assert first.released
    assert second.values[cv2.CAP_PROP_EXPOSURE] == 80.0
    indices = [frame.index for frame in before + after]
    assert indices == list(range(len(indices)))
    said = " ".join(frame.note for frame in after)
    assert re.search(r"gone for \d\.\d s after frame \d+", said)


def test_a_camera_that_cannot_do_what_is_asked():
    """Not there, or another size than asked for: a rig fault, and the device is released."""
    with pytest.raises(RigFault, match="cannot be opened"):
        LiveCamera(3, capture=FakeCapture(opened=False))
    capture = FakeCapture()
    with pytest.raises(RigFault, match="gives 64 x 48 px, 1280 x 720 px"):
        LiveCamera(0, CameraControls(width_px=1280, height_px=720), capture)
    assert capture.released
    with pytest.raises(RigFault, match="camera 97"):
        open_source("97")


def test_a_runs_camera_section_sets_the_camera():
    """`[camera.controls]` beside size and rate: exposure is set, raw pictures asked for; none, nothing."""
    section = CameraConfig.model_validate({
        "width_px": 64, "height_px": 64, "rate_hz": 50.0,
        "controls": {"exposure": 80.0, "white_balance_k": 5000.0, "raw": True},
    })  # fmt: skip
    asked = controls_of(section)
    assert (asked.width_px, asked.height_px, asked.rate_hz) == (64, 64, 50.0)
    capture = FakeCapture()
    capture.dropped = {cv2.CAP_PROP_WB_TEMPERATURE}
    capture.retrieve = lambda: (True, np.full((64, 64, 3), capture.count % 250, np.uint8))
    camera = LiveCamera(0, asked, capture)
    note = take(camera, 1)[0].note
    camera.close()
    assert camera.locked["exposure"] == 80.0
    assert capture.values[cv2.CAP_PROP_FOURCC] == cv2.VideoWriter.fourcc(*"YUYV")
    assert "white_balance_k: 5000 asked for, 4100 in force" in note
    assert controls_of(None) == CameraControls()
    with pytest.raises(ValueError, match="exposure"):
        CameraConfig.model_validate({"controls": {"exposure": 1e9}})


def test_pictures_of_another_size_than_the_lens_are_refused(tmp_path):
    """A camera that delivers other pictures than its driver says; a film, and a socket, of another size."""
    capture = FakeCapture()
    camera = LiveCamera(0, capture=capture)
    take(camera, 2)
    capture.retrieve = lambda: (True, np.full((96, 128, 3), capture.count % 250, np.uint8))
    with pytest.raises(RigFault, match="128 x 96 px came, its driver says 64 x 48 px"):
        take(camera, 50)
    camera.close()
    write_video(tmp_path / "film.avi", 3)
    lens = CameraConfig(width_px=640, height_px=480)
    with pytest.raises(BadInput, match="160 x 120 px, the lens is that of 640 x 480 px"):
        open_source(str(tmp_path / "film.avi"), lens)
    open_source(
        str(tmp_path / "film.avi"), lens.model_copy(update={"width_px": 160, "height_px": 120})
    ).close()
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as server:
        server.bind(str(tmp_path / "camera"))
        server.listen(1)
        source = open_source(f"twin:{tmp_path / 'camera'}", lens)
        peer, _ = server.accept()
        peer.sendall(encode_frame(Frame(0, 0.0, np.zeros((120, 160, 3), np.uint8))))
        assert select.select([source.fileno()], [], [], 5.0)[0]
        with pytest.raises(RigFault, match="160 x 120 px"):
            source.poll()
        source.close()
        peer.close()


def write_video(path, count=20):
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"MJPG"), 30.0, (160, 120))
    noise = np.random.default_rng(1).integers(0, 255, (120, 160, 3), np.uint8)
    for k in range(count):
        writer.write(np.roll(noise, k, axis=1))
    writer.release()


def test_a_video_gives_every_frame_with_its_stamp(tmp_path):
    """Twenty frames at 30 Hz are 1/30 s apart by the container (whole milliseconds)."""
    write_video(tmp_path / "film.mkv")
    video = VideoFile(tmp_path / "film.mkv")
    frames = list(video.frames())
    video.close()
    assert len(frames) == 20
    assert (video.width_px, video.height_px) == (160, 120)
    assert frames[-1].t_cam_s == pytest.approx(19 / 30, abs=1.1e-3)


def test_a_run_records_own_stamps_are_taken(tmp_path):
    """Beside a `frames.parquet` the camera's stamps of the record count, not the container's."""
    write_video(tmp_path / "camera.mkv", 5)
    stamps = [10.0, 10.04, 10.07, 10.2, 10.21]
    pq.write_table(pa.table({"t_cam_s": stamps}), tmp_path / "frames.parquet")
    frames = VideoFile(tmp_path / "camera.mkv").frames()
    assert [frame.t_cam_s for frame in frames] == stamps


def test_a_video_cut_off_in_mid_frame_is_refused(tmp_path):
    """Two thirds of the file: the frames that were there, then one line that says how many."""
    write_video(tmp_path / "film.mkv")
    data = (tmp_path / "film.mkv").read_bytes()
    (tmp_path / "cut.mkv").write_bytes(data[: len(data) * 2 // 3])
    with pytest.raises(BadInput, match=r"cut off: \d+ of 20 frames"):
        list(VideoFile(tmp_path / "cut.mkv").frames())
    (tmp_path / "junk.mkv").write_bytes(b"no film")
    with pytest.raises(BadInput, match="not a video"):
        VideoFile(tmp_path / "junk.mkv")
    with pytest.raises(BadInput, match="no such video"):
        VideoFile(tmp_path / "none.mkv")


def test_images_of_a_folder_come_in_the_order_of_their_numbers(tmp_path):
    """img2 before img10, one period apart."""
    for k in (10, 2, 1):
        cv2.imwrite(str(tmp_path / f"img{k}.png"), np.full((48, 64, 3), k, np.uint8))
    frames = list(ImageFolder(tmp_path, rate_hz=10.0).frames())
    assert [int(frame.image[0, 0, 0]) for frame in frames] == [1, 2, 10]
    assert [frame.t_cam_s for frame in frames] == pytest.approx([0.0, 0.1, 0.2])


@pytest.mark.parametrize("suffix", [".jpg", ".png", ".bmp"])
def test_a_damaged_image_is_refused(tmp_path, suffix):
    """Half a file is not half a picture: OpenCV fills a JPEG with grey and says nothing."""
    noise = np.random.default_rng(1).integers(0, 255, (60, 80, 3), np.uint8)
    path = tmp_path / f"image{suffix}"
    cv2.imwrite(str(path), noise)
    assert cv_compat.read_image(path).shape == (60, 80, 3)
    data = path.read_bytes()
    path.write_bytes(data[: len(data) // 2])
    with pytest.raises(BadInput, match=r"damaged|not an image"):
        cv_compat.read_image(path)


def test_folders_that_cannot_be_used(tmp_path):
    """Missing, empty, or of mixed sizes: one line each."""
    with pytest.raises(BadInput, match="no such folder"):
        ImageFolder(tmp_path / "none")
    with pytest.raises(BadInput, match="no images"):
        ImageFolder(tmp_path)
    cv2.imwrite(str(tmp_path / "a.png"), np.zeros((48, 64, 3), np.uint8))
    cv2.imwrite(str(tmp_path / "b.png"), np.zeros((96, 64, 3), np.uint8))
    with pytest.raises(BadInput, match="one resolution"):
        list(ImageFolder(tmp_path).frames())
