"""Pictures and video that a record keeps of its run."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from hil.record.reader import picture_name, read_pictures, read_run
from hil.record.recorder import Recorder
from hil.record.schema import FRAME_NAMES
from tests.record.synthetic import frame_row, image_of, make_run, manifest, rows


def test_pictures_start_middle_end(tmp_path):
    """With images, the record keeps pictures; middle is where half of the way was travelled."""
    run = make_run(tmp_path / "run", images=True)
    moments = read_run(tmp_path / "run").moments()
    assert list(moments) == ["start", "middle", "end"]
    assert moments["start"].t_s == 0.0
    assert moments["end"].t_s == pytest.approx(4.0, abs=1e-3)
    # Way ~ exp(-2 t): half of it is done at ln 2 / 2 = 0.35 s; pictures lie 0.5 s apart.
    assert moments["middle"].t_s == pytest.approx(0.5, abs=0.04)
    image = cv2.imread(str(moments["start"].path))
    assert image.shape == (480, 640, 3)
    assert len(run.pictures) == 9


def test_start_picture_is_the_last_one_at_rest(tmp_path):
    """Frames come before the first tick too; the start is the one nearest before it."""
    recorder = Recorder(tmp_path / "run", manifest(), rerun=False)
    given = rows("pid", 1, duration_s=1.0)
    for index, t_s in enumerate((-1.2, -0.6, -0.1, 0.5, 1.0)):
        recorder.frame(frame_row(t_s, index, given[0]), image_of(frame_row(t_s, index, given[0])))
    for row in given:
        recorder.append(row)
    moments = recorder.close("complete").moments()
    assert {name: picture.t_s for name, picture in moments.items()} == {
        "start": -0.6,  # -0.1 came less than 0.5 s after it and was not kept
        "middle": 0.5,
        "end": 1.0,
    }


def test_video_is_lossless_and_stamped(tmp_path):
    """--record-camera keeps every frame as it was, one row of frames.parquet for each."""
    recorder = Recorder(tmp_path / "run", manifest(), record_camera=True, rerun=False)
    images = []
    for index, row in enumerate(rows("pid", 1, duration_s=0.5)):
        frame = frame_row(row[0], index, row)
        images.append(image_of(frame))
        recorder.frame(frame, images[-1])
        recorder.append(row)
    run = recorder.close("complete")
    video = cv2.VideoCapture(str(tmp_path / "run" / "camera.mkv"))
    for image in images:
        there, back = video.read()
        assert there
        np.testing.assert_array_equal(back, image)
    assert not video.read()[0]
    assert run.frames["t_arrival_s"].size == len(images)
    assert set(FRAME_NAMES) == set(run.frames)


def test_small_video_says_what_it_is(tmp_path):
    """As JPEG, below a third of the lossless one; frames in order, each within 4 grey levels RMS."""
    images = {}
    for small in (False, True):
        recorder = Recorder(
            tmp_path / f"run{small}",
            manifest(),
            record_camera=not small,
            small_video=small,
            rerun=False,
        )
        for index, row in enumerate(rows("pid", 1, duration_s=0.5)):
            frame = frame_row(row[0], index, row)
            images[index] = image_of(frame)
            recorder.frame(frame, images[index])
            recorder.append(row)
        recorder.close("complete")
    assert not (tmp_path / "runTrue" / "camera.mkv").exists()
    small_file = tmp_path / "runTrue" / "camera-small.avi"
    assert 3 * small_file.stat().st_size < (tmp_path / "runFalse" / "camera.mkv").stat().st_size
    video = cv2.VideoCapture(str(small_file))
    for image in images.values():
        there, back = video.read()
        assert there
        assert np.sqrt(np.mean(np.square(back.astype(float) - image))) < 4.0
    assert not video.read()[0]


@pytest.mark.parametrize("t_s", [-12.5, -0.329, 0.0, 0.5, 1234.567])
def test_no_picture_is_taken_for_an_option(tmp_path, t_s):
    """A name begins with a letter, and the time is read back from it, as from older names."""
    for k, name in enumerate((picture_name(t_s), f"{t_s:08.3f}s.jpg")):
        folder = tmp_path / str(k)
        folder.mkdir()
        (folder / name).write_bytes(b"")
        assert [picture.t_s for picture in read_pictures(folder)] == [t_s]
    assert picture_name(t_s).startswith("t")
