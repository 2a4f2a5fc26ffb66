"""Videos as other programs write them: whole ones are read whole, cut ones refused, stamps kept."""

import struct
from fractions import Fraction

import cv2
import numpy as np
import pytest

from hil.core.errors import BadInput
from vision.calibration.boards import BoardView
from vision.calibration.views import views_of_video
from vision.container import missing_bytes
from vision.video_file import VideoFile

av = pytest.importorskip("av", reason="makes the films: pip install av")

SIZE = (160, 120)
VARIABLE_MS = [0, 40, 80, 300, 340, 380, 900, 940, 980, 1020, 2500, 2540, 2580, 3000, 3040]
NOISE = np.random.default_rng(1).integers(0, 255, (120, 160, 3), np.uint8)


def film(path, stamps_ms, codec="mjpeg", sound_s=0.0, options=None):
    """Write a film whose frames carry these stamps, with silence of a length where wanted."""
    with av.open(str(path), "w", options=options or {}) as out:
        video = out.add_stream(codec, rate=25)
        video.width, video.height = SIZE
        video.pix_fmt = "yuvj420p" if codec == "mjpeg" else "yuv420p"
        video.codec_context.gop_size = 1000
        video.time_base = video.codec_context.time_base = Fraction(1, 1000)
        sound = (
            out.add_stream("aac" if path.suffix == ".mp4" else "libopus", rate=48000)
            if sound_s
            else None
        )
        for k, stamp in enumerate(stamps_ms):
            frame = av.VideoFrame.from_ndarray(np.roll(NOISE, k, axis=1), format="bgr24")
            frame.pts, frame.time_base = stamp, Fraction(1, 1000)
            out.mux(video.encode(frame))
        out.mux(video.encode())
        for k in range(int(sound_s * 50)):
            piece = av.AudioFrame.from_ndarray(
                np.zeros((1, 960), np.float32), format="flt", layout="mono"
            )
            piece.sample_rate, piece.pts, piece.time_base = 48000, 960 * k, Fraction(1, 48000)
            out.mux(sound.encode(piece))
        if sound:
            out.mux(sound.encode())
    return path


def stamps_of(path):
    return [frame.t_cam_s for frame in VideoFile(path).frames()]


@pytest.mark.parametrize("name", ["a.mkv", "a.webm", "a.mp4", "a.mov", "a.avi", "a.ts"])
def test_a_variable_rate_is_read_to_its_end(tmp_path, name):
    """Fifteen frames in 3 s announced at 25 Hz: all are there at their own stamps."""
    codec = {"webm": "libvpx", "ts": "mpeg4"}.get(name[2:], "mjpeg")
    stamps = [40 * k for k in range(15)] if name.endswith(("ts", "avi")) else VARIABLE_MS
    got = np.array(stamps_of(film(tmp_path / name, stamps, codec)))
    assert len(got) == 15
    assert got - got[0] == pytest.approx(np.array(stamps) / 1e3, abs=2e-3)


def test_sound_longer_than_the_picture_does_not_cut_the_picture(tmp_path):
    """Ten frames and four seconds of sound: ten frames."""
    for name in ("a.mkv", "a.mp4"):
        path = film(tmp_path / name, range(0, 400, 40), sound_s=4.0)
        assert len(stamps_of(path)) == 10


def test_a_film_that_starts_late_or_was_begun_within_is_read(tmp_path):
    """Stamps that start at 5 s, and an edit list that leaves out the first second."""
    late = stamps_of(film(tmp_path / "late.mkv", range(5000, 6000, 40)))
    assert (len(late), late[-1] - late[0]) == (25, pytest.approx(0.96))
    source = film(tmp_path / "whole.mp4", range(0, 3000, 40), "mpeg4")
    with av.open(str(source)) as inside, av.open(str(tmp_path / "cut.mp4"), "w") as out:
        stream = out.add_stream_from_template(inside.streams.video[0])
        for packet in inside.demux(inside.streams.video[0]):
            if packet.dts is not None and packet.time_base * packet.dts >= 0.9:
                packet.stream = stream
                out.mux(packet)
    assert len(stamps_of(tmp_path / "cut.mp4")) >= 40


def test_an_avi_with_frames_left_out_or_of_another_codec(tmp_path):
    """Empty chunks for dropped frames, MPEG-4 and H.264 in AVI: every picture that is there is read."""
    dropped = film(tmp_path / "dropped.avi", [0, 40, 80, 200, 240, 400, 440])
    assert len(stamps_of(dropped)) == 7
    assert len(stamps_of(film(tmp_path / "b.avi", range(0, 1000, 40), "mpeg4"))) == 25
    long = stamps_of(film(tmp_path / "c.avi", range(0, 4000, 40), "libx264"))
    assert len(long) == 100
    assert np.allclose(np.diff(long), 0.04, atol=1e-6)


@pytest.mark.parametrize("name", ["a.mkv", "a.webm", "a.mp4", "a.mov", "a.avi", "a.flv", "a.asf"])
def test_a_film_really_cut_is_refused(tmp_path, name):
    """At 95 % and 60 % of the file, and with its last byte gone: one line, whole before."""
    codec = {"webm": "libvpx", "flv": "flv"}.get(name[2:], "mjpeg")
    options = {"movflags": "faststart"} if name[2:] in {"mp4", "mov"} else None
    path = film(tmp_path / name, range(0, 1000, 40), codec, options=options)
    assert missing_bytes(path) == 0
    data = path.read_bytes()
    for count in (len(data) - 1, len(data) * 95 // 100, len(data) * 6 // 10):
        path.write_bytes(data[:count])
        assert missing_bytes(path) > 0
        with pytest.raises(BadInput, match=r"cut off"):
            stamps_of(path)


def test_bytes_after_the_last_box_do_no_harm(tmp_path):
    """A telephone's own data behind the film: still whole."""
    path = film(tmp_path / "a.mp4", range(0, 400, 40))
    path.write_bytes(path.read_bytes() + struct.pack(">I4s", 24, b"SEFT") + bytes(16))
    assert len(stamps_of(path)) == 10


def test_repeated_stamps_do_not_run_ahead(tmp_path):
    """Every third frame carries the stamp before: it is left out, the others keep their own.

    Moved on by a nominal period they ran 3.7 s ahead after 7.5 s.
    """
    stamps = sorted([*range(0, 2000, 60), *range(0, 2000, 180)])
    path = film(tmp_path / "a.mkv", range(0, 40 * len(stamps), 40), "mpeg4")
    data = bytearray(path.read_bytes())
    patch_blocks(data, stamps)
    path.write_bytes(data)
    video = VideoFile(path)
    got = [frame.t_cam_s for frame in video.frames()]
    assert got == pytest.approx(np.array(sorted(set(stamps))) / 1e3, abs=1e-9)
    assert video.unstamped == len(stamps) - len(set(stamps))


def patch_blocks(data, stamps_ms):
    """Write stamps into the blocks of the one cluster of a Matroska file."""
    at, k = bytes(data).index(b"\x1f\x43\xb6\x75"), 0
    while k < len(stamps_ms):
        at = bytes(data).index(b"\xa3", at)
        width = 9 - data[at + 1].bit_length()
        block = at + 1 + width
        if width <= 8 and data[block] == 0x81 and data[block + 3] & 0x7F == 0:
            data[block + 1 : block + 3] = struct.pack(">h", stamps_ms[k])
            length = int.from_bytes(data[at + 1 : block], "big") & ((1 << 7 * width) - 1)
            at, k = block + length, k + 1
        else:
            at += 1


def test_a_film_without_stamps_runs_at_its_rate(tmp_path):
    """All blocks at 0 ms: frames a nominal period apart, none left out."""
    path = film(tmp_path / "a.mkv", range(0, 800, 40), "mpeg4")
    data = bytearray(path.read_bytes())
    patch_blocks(data, [0] * 20)
    path.write_bytes(data)
    assert np.diff(stamps_of(path)) == pytest.approx(np.full(19, 0.04), abs=1e-3)


def test_two_recordings_in_one_file_are_refused(tmp_path):
    """Stamps that fall back by 3 s have no time that could be believed."""
    path = film(tmp_path / "a.mkv", range(0, 800, 40), "mpeg4")
    data = bytearray(path.read_bytes())
    patch_blocks(data, [400 * k for k in range(10)] + [400 * k for k in range(10)])
    path.write_bytes(data)
    with pytest.raises(BadInput, match=r"fall back from 3\.60 to 0\.00 s at frame 10"):
        stamps_of(path)


def test_a_rotation_tag_does_not_turn_the_lens(tmp_path):
    """A film from a telephone held upside down has the pixels of the sensor, as its stills have."""
    path = film(tmp_path / "a.mp4", range(0, 400, 40))
    upright = next(VideoFile(path).frames()).image
    data = bytearray(path.read_bytes())
    at = data.index(b"tkhd") + 44
    data[at : at + 36] = struct.pack(
        ">9i", -65536, 0, 0, 0, -65536, 0, SIZE[0] << 16, SIZE[1] << 16, 1 << 30
    )
    path.write_bytes(data)
    capture = cv2.VideoCapture(str(path))
    assert capture.get(cv2.CAP_PROP_ORIENTATION_META) == 180.0
    assert np.array_equal(next(VideoFile(path).frames()).image, upright)


class Walking:
    """A board that stands in a new place every second of the film, by the film's own stamps."""

    def __init__(self):
        self.looked = []

    def find(self, _image, name=""):
        t_s = float(name.split(" at ")[1].split()[0])
        self.looked.append(t_s)
        grid = np.stack(np.meshgrid(np.arange(4.0), np.arange(4.0)), axis=-1).reshape(-1, 2)
        place = 12.0 * (int(t_s) % 9)
        return BoardView(name, np.column_stack((grid, np.zeros(16))), grid * 5.0 + place)


@pytest.mark.parametrize("rate_hz", [1000.0, 30.0])
def test_frames_are_chosen_by_their_stamps(tmp_path, monkeypatch, rate_hz):
    """A browser's film (28 Hz, said to be 1000 Hz) is looked at five times a second like any other."""
    monkeypatch.setattr(cv2, "VideoCapture", faked_rate(rate_hz))
    path = film(tmp_path / "a.mkv", [round(1000 * k / 28) for k in range(28 * 6)])
    board = Walking()
    assert len(views_of_video(board, path, [].append).views) == 6
    assert 25 <= len(board.looked) <= 31
    assert VideoFile(path).rate_hz == pytest.approx(28.0, rel=0.03 if rate_hz > 100 else 0.1)


def faked_rate(rate_hz):
    """Return OpenCV's capture as it is on a container that names another rate."""
    real = cv2.VideoCapture

    class Capture:
        def __init__(self, path):
            self._real = real(path)

        def get(self, key):
            return rate_hz if key == cv2.CAP_PROP_FPS else self._real.get(key)

        def __getattr__(self, name):
            return getattr(self._real, name)

    return Capture
