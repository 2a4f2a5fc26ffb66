"""Picture files: size and end from the header, orientation tags, depths, what is appended."""

import shutil
import struct
import zlib
from pathlib import Path

import cv2
import numpy as np
import pytest

from hil.config.camera import CameraConfig
from hil.core.errors import BadInput
from vision.cv_compat import read_image
from vision.picture_file import SIDE_MAX_PX, SIDE_MIN_PX, read_header
from vision.video_file import VideoFile

PHOTO = Path(__file__).parents[1] / "data" / "chessboard" / "left01.jpg"
KINDS = ("jpg", "png", "bmp", "tif", "webp", "pgm", "ppm")


def written(path, image):
    cv2.imwrite(str(path), image[..., 0] if path.suffix == ".pgm" else image)
    return path


def test_the_limit_is_that_of_the_camera_file():
    """One bound for pictures and for the file that describes the camera."""
    for name in ("width_px", "height_px"):
        bounds = CameraConfig.model_fields[name].metadata
        assert [b.ge for b in bounds if hasattr(b, "ge")] == [SIDE_MIN_PX]
        assert [b.le for b in bounds if hasattr(b, "le")] == [SIDE_MAX_PX]


@pytest.mark.parametrize("kind", KINDS)
def test_a_picture_too_large_is_refused_by_its_header(tmp_path, monkeypatch, kind):
    """4097 px are refused before anything is decoded, 4096 px are read."""
    fits = written(tmp_path / f"fits.{kind}", np.full((64, 4096, 3), 90, np.uint8))
    large = written(tmp_path / f"large.{kind}", np.full((64, 4097, 3), 90, np.uint8))
    assert read_image(fits).shape == (64, 4096, 3)
    monkeypatch.setattr(cv2, "imdecode", None)
    with pytest.raises(BadInput, match=r"of 4097 x 64 px, the limit is 4096 px"):
        read_image(large)


def png(width, height):
    """Return a PNG of a blank picture without ever holding the picture."""

    def chunk(kind, body):
        sum_ = zlib.crc32(kind + body)
        return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", sum_)

    packer = zlib.compressobj(9)
    rows = b"".join(packer.compress(bytes(1 + width // 8)) for _ in range(height)) + packer.flush()
    head = struct.pack(">IIBBBBB", width, height, 1, 0, 0, 0, 0)
    parts = chunk(b"IHDR", head) + chunk(b"IDAT", rows) + chunk(b"IEND", b"")
    return b"\x89PNG\r\n\x1a\n" + parts


def test_a_small_file_with_a_huge_picture_is_refused(tmp_path):
    """30000 x 30000 px in some 100 kB: as a picture and as a film, in one line."""
    path = tmp_path / "bomb.png"
    path.write_bytes(png(30000, 30000))
    assert path.stat().st_size < 200_000
    for reader in (read_image, VideoFile):
        with pytest.raises(BadInput, match="30000 x 30000 px"):
            reader(path)


@pytest.mark.parametrize("kind", ["jpg", "png"])
@pytest.mark.parametrize("tail", [bytes(100), b"SEFH" * 30, PHOTO.read_bytes()[:5000]])
def test_bytes_after_the_end_do_no_harm(tmp_path, kind, tail):
    """What telephones append is not the picture; without the picture's own end it is damaged."""
    path = written(tmp_path / f"a.{kind}", cv2.imread(str(PHOTO)))
    data = path.read_bytes()
    plain = read_image(path)
    path.write_bytes(data + tail)
    assert np.array_equal(read_image(path), plain)
    path.write_bytes(data[: len(data) * 2 // 3] + tail)
    with pytest.raises(BadInput, match="damaged"):
        read_image(path)


def exif(orientation):
    body = struct.pack("<2sHIHHHIII", b"II", 42, 8, 1, 274, 3, 1, orientation, 0)
    return b"\xff\xe1" + struct.pack(">H", len(body) + 8) + b"Exif\0\0" + body


@pytest.mark.parametrize("orientation", [2, 3, 6, 8])
def test_orientation_tags_turn_nothing(tmp_path, orientation):
    """A JPEG and a TIFF with a tag give the pixels as they are stored; OpenCV alone turns them."""
    data = PHOTO.read_bytes()
    jpeg = tmp_path / "a.jpg"
    jpeg.write_bytes(data[:2] + exif(orientation) + data[2:])
    stored = read_image(PHOTO)
    assert not np.array_equal(cv2.imread(str(jpeg)), stored)
    assert np.array_equal(read_image(jpeg), stored)
    tiff = written(tmp_path / "a.tif", stored)
    tiff.write_bytes(with_tag(tiff.read_bytes(), orientation))
    assert not np.array_equal(cv2.imread(str(tiff)), stored)
    assert np.array_equal(read_image(tiff), stored)


def with_tag(data, orientation):
    """Return OpenCV's TIFF with its directory copied to the end and the orientation put into it."""
    (at,) = struct.unpack("<I", data[4:8])
    (count,) = struct.unpack("<H", data[at : at + 2])
    entries = [data[at + 2 + 12 * k : at + 14 + 12 * k] for k in range(count)]
    entries = [e for e in entries if e[:2] != struct.pack("<H", 274)]
    entries.append(struct.pack("<HHIHH", 274, 3, 1, orientation, 0))
    entries.sort(key=lambda e: struct.unpack("<H", e[:2]))
    body = struct.pack("<H", len(entries)) + b"".join(entries) + bytes(4)
    return data[:4] + struct.pack("<I", len(data)) + data[8:] + body


@pytest.mark.parametrize("bits", [8, 10, 12, 14, 16])
def test_sensor_bits_in_16_bit_files_are_not_black(tmp_path, bits):
    """The same picture at each depth is the 8-bit one."""
    level = cv2.imread(str(PHOTO))
    level[:8, :8] = 255
    path = tmp_path / "deep.png"
    cv2.imwrite(str(path), (level.astype(np.uint16) * 257) >> (16 - bits))
    assert np.abs(read_image(path).astype(int) - level).max() <= 1


def test_a_picture_in_the_dark_stays_dark(tmp_path):
    """Negative control: an 8-bit picture is not lifted, nor a full-range one of 16 bits."""
    dark = np.full((64, 64, 3), 12, np.uint8)
    assert read_image(written(tmp_path / "a.png", dark)).max() == 12
    cv2.imwrite(str(tmp_path / "b.png"), np.full((64, 64), 128 * 257, np.uint16))
    assert read_image(tmp_path / "b.png").max() == 128


def test_headers_that_lie_are_refused(tmp_path):
    """Signs without a header, and text: one line, no exception of another kind."""
    for start in (
        b"\xff\xd8",
        b"\x89PNG\r\n\x1a\n",
        b"BM",
        b"II*\0",
        b"MM\0*",
        b"RIFF",
        b"P5",
        b"P7",
        b"text",
    ):
        for body in (b"", b"\xff" * 40, bytes(40)):
            path = tmp_path / "a.jpg"
            path.write_bytes(start + body)
            with pytest.raises(BadInput):
                read_image(path)
    assert read_header(b"P5 # a comment\n 12 # another\n 34\n255\n").size_px == (12, 34)


def test_tagged_pictures_among_others_give_the_same_lens(tmp_path):
    """Every second file tagged as upside down: the lens is that of the files without tags."""
    from vision.calibration.boards import parse_board  # noqa: PLC0415
    from vision.calibration.intrinsics import calibrate_lens  # noqa: PLC0415

    board, views = parse_board("chess:10x7:25", "classic"), []
    for k, photo in enumerate(sorted(PHOTO.parent.glob("left*.jpg"))[:8]):
        path = Path(shutil.copy(photo, tmp_path))
        if k % 2:
            data = path.read_bytes()
            path.write_bytes(data[:2] + exif(3) + data[2:])
        views.append(board.find(read_image(path), path.name))
    untagged = [board.find(read_image(PHOTO.parent / view.name), view.name) for view in views]
    tagged_f, f = (calibrate_lens(v, (640, 480)).lens for v in (views, untagged))
    assert tagged_f == pytest.approx(f, rel=1e-5)
