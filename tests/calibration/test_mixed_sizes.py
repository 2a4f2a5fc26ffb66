"""Pictures of one camera in several sizes and turned, on OpenCV's chessboard photographs."""

from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from hil.core.errors import BadInput
from vision import cv_compat
from vision.calibration.boards import parse_board
from vision.calibration.intrinsics import calibrate_lens, off_lens_px
from vision.calibration.one_size import SizedView, at_one_size
from vision.calibration.views import views_of_folder

PHOTOS = sorted((Path(__file__).parent.parent / "data" / "chessboard").glob("left*.jpg"))
BOARD = parse_board("chess:10x7:25")
SIZE = (640, 480)
TURNS = {"left03.jpg": cv2.ROTATE_90_CLOCKWISE, "left07.jpg": cv2.ROTATE_90_COUNTERCLOCKWISE}


@pytest.fixture(scope="module")
def plain():
    return [BOARD.find(cv_compat.read_image(path), path.name) for path in PHOTOS]


def folder_of(path, change):
    """Write the photographs, `change` taking name and image to the image written."""
    for photo in PHOTOS:
        image = change(photo.name, cv_compat.read_image(photo))
        cv_compat.write_image(path / f"{photo.stem}.png", image)
    return path


def test_binned_and_turned_pictures_give_the_lens_of_all(tmp_path, plain):
    """Three pictures binned 2 x 2, two turned by 90 degrees either way: the same lens, and it is said."""

    def change(name, image):
        if name in {"left04.jpg", "left05.jpg", "left08.jpg"}:
            return image.reshape(240, 2, 320, 2, 3).mean(axis=(1, 3)).astype(np.uint8)
        return cv2.rotate(image, TURNS[name]) if name in TURNS else image

    found = views_of_folder(BOARD, folder_of(tmp_path, change), [].append)
    assert found.size_px == SIZE
    assert found.brought == [
        "scaled from 320 x 240 to 640 x 480 px: left04.png, left05.png, left08.png",
        "left03.png is turned: read as turned by 90 deg clockwise",
        "left07.png is turned: read as turned by 90 deg counter-clockwise",
    ]
    mixed, whole = calibrate_lens(found.views, SIZE), calibrate_lens(plain, SIZE)
    assert mixed.lens[:2] == pytest.approx(whole.lens[:2], rel=0.004)
    assert mixed.lens[2:4] == pytest.approx(whole.lens[2:4], abs=1.5)


def test_a_picture_turned_the_wrong_way_spoils_the_lens(plain):
    """Negative control: the way is told from the pixels. The centre is 22 px off the middle there."""
    turned = replace(plain[2], px=np.array(SIZE) - 1.0 - plain[2].px)
    others = [*plain[:2], *plain[3:]]
    right, wrong = (off_lens_px(others, view, SIZE) for view in (plain[2], turned))
    assert wrong > 2.0 * right


def test_pictures_of_another_aspect_are_refused_by_name(plain):
    """640 x 360 beside 640 x 480: which rows were cut is not known. A lost half pixel is no aspect."""
    sized = [SizedView(view, SIZE) for view in plain]
    cut = SizedView(replace(plain[0], name="wide.png"), (640, 360))
    with pytest.raises(
        BadInput, match=r"^lens: wide\.png: 640 x 360 px, the others have 640 x 480"
    ):
        at_one_size([*sized, cut], off_lens_px)
    odd = SizedView(replace(plain[0], px=plain[0].px / 4.0), (160, 121))
    assert len(at_one_size([*sized, odd], off_lens_px).views) == len(plain) + 1


def test_too_few_to_tell_a_turn(plain):
    """Four views do not make the lens that a turned fifth is held against."""
    sized = [SizedView(view, SIZE) for view in plain[:4]]
    with pytest.raises(BadInput, match=r"left05\.jpg is turned by 90 deg against 4 others"):
        at_one_size([*sized, SizedView(plain[4], SIZE[::-1])], off_lens_px)


def test_pictures_that_all_stand_upright_are_a_camera_that_does(tmp_path, plain):
    """All turned alike: nothing is turned back, the focal length is the same, width is 480 px."""
    turned = folder_of(tmp_path, lambda _, image: cv2.rotate(image, cv2.ROTATE_90_CLOCKWISE))
    found = views_of_folder(BOARD, turned, [].append)
    assert (found.size_px, found.brought) == ((480, 640), [])
    whole, upright = calibrate_lens(plain, SIZE).lens, calibrate_lens(found.views, (480, 640)).lens
    assert upright[:2] == pytest.approx(whole[1::-1], rel=0.004)
    assert upright[2] == pytest.approx(479.0 - whole[3], abs=2.0)
