"""The one place where OpenCV's array shapes, error habits and moved functions are met.

OpenCV 4 gives points as (N, 1, 2) and ids as (N, 1); OpenCV 5 gives (N, 2) and (N,). Both give
None, () or an empty array when they find nothing. Here everything is (N, 2) float64 and (N,) int,
empty when nothing was found. OpenCV's own messages on stderr are turned off: what matters becomes
one BadInput line.
"""

from __future__ import annotations

import os
from collections.abc import Collection
from pathlib import Path
from typing import Any

from hil.core.files import replace_file

# Read by OpenCV's video backend when it opens its first file.
os.environ.setdefault("OPENCV_FFMPEG_LOGLEVEL", "-8")

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

from hil.core.errors import BadInput
from vision.picture_file import check_picture, without_orientation

cv2.utils.logging.setLogLevel(cv2.utils.logging.LOG_LEVEL_SILENT)

Array = NDArray[np.float64]
Ids = NDArray[np.int64]
Image = NDArray[np.uint8]
CharucoBoard = cv2.aruco.CharucoBoard
TagDetector = cv2.aruco.ArucoDetector
CvError = cv2.error

CORNER_WINDOW_PX = 11
ITERATIONS = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_MAX_ITER, 100, 1e-4)
# Half of each tag cell's width left out of the vote: bits survive blur and a slanted view.
CELL_MARGIN_RATIO = 0.3
CORNER_WINDOW_CELLS = 0.8
# solvePnP's start from a plane wants so many.
PLACE_POINTS_MIN = 4

IMAGE_SUFFIXES = {".jpg", ".jpeg", ".png", ".bmp", ".tif", ".tiff", ".webp", ".pgm", ".ppm"}
PICTURE_SUFFIXES = (".png", ".jpg")
# As the sensor saw it: an orientation tag turns the picture and not the lens before the sensor.
_AS_STORED = cv2.IMREAD_COLOR | cv2.IMREAD_IGNORE_ORIENTATION
# A 16-bit file with nothing above this once it is taken to 8 bits may hold fewer bits.
_DARK_DN = 64
_SENSOR_BITS = (8, 10, 12, 14)


def points(array: ArrayLike | None) -> Array:
    """Return image points as (N, 2) float64, (0, 2) for none."""
    if array is None or np.size(array) == 0:
        return np.empty((0, 2))
    return np.asarray(array, dtype=np.float64).reshape(-1, 2)


def ids(array: ArrayLike | None) -> Ids:
    """Return ids as (N,) int64, (0,) for none."""
    if array is None or np.size(array) == 0:
        return np.empty(0, dtype=np.int64)
    return np.asarray(array, dtype=np.int64).reshape(-1)


def read_image(path: Path) -> Image:
    """Return the image, (H, W, 3) BGR, in the sensor's own axes: orientation tags are not followed.

    BadInput when it is missing, damaged, no image, or larger than a camera file can describe; that
    is seen in the file's header, before anything is decoded. OpenCV returns a grey-filled picture
    for a JPEG that was cut off, so the file's end is checked too.

    Raises BadInput for a file that is no image.
    """
    try:
        data = path.read_bytes()
    except OSError as error:
        raise BadInput(f"{path}: cannot be read: {error.strerror}") from None
    check_picture(path, data)
    data = without_orientation(data)
    image = _decode(data, _AS_STORED)
    if image is None:
        raise BadInput(f"{path}: not an image OpenCV can read ({len(data)} bytes); is it damaged?")
    if image.max(initial=0) < _DARK_DN:
        image = _lifted(data, image)
    return np.asarray(image, dtype=np.uint8)


def _decode(data: bytes, flags: int) -> NDArray[Any] | None:
    try:
        image = cv2.imdecode(np.frombuffer(data, dtype=np.uint8), flags)
    except cv2.error:
        return None
    return None if image is None else np.asarray(image)


def _lifted(data: bytes, image: NDArray[Any]) -> NDArray[Any]:
    """Return the picture with 8 to 14 bits in a 16-bit file taken to 8 bits, else as it is."""
    deep = _decode(data, _AS_STORED | cv2.IMREAD_ANYDEPTH)
    if deep is None or deep.dtype != np.uint16:
        return image
    most = int(deep.max(initial=0))
    bits = next((b for b in _SENSOR_BITS if most < 1 << b), 16)
    return np.asarray(deep >> (bits - 8), dtype=np.uint8)


def write_image(path: Path, image: Image) -> None:
    """Write the image in one step: the file is there complete, or not at all."""
    require_place(path, PICTURE_SUFFIXES)
    _, data = cv2.imencode(path.suffix, image)
    write_atomic(path, data.tobytes())


def require_place(path: Path | None, suffixes: Collection[str] = ()) -> None:
    """Raise BadInput where a file could not be written, before the work whose result it is."""
    if path is None:
        return
    if not path.parent.is_dir():
        raise BadInput(f"{path}: the folder {path.parent} does not exist; make it first")
    if suffixes and path.suffix.lower() not in suffixes:
        raise BadInput(f"{path}: cannot be written as {path.suffix!r}; use {' or '.join(suffixes)}")


def write_atomic(path: Path, data: bytes) -> None:
    """Write a file beside its place and move it there; BadInput when the folder cannot be used."""
    try:
        replace_file(path, data)
    except OSError as error:
        raise BadInput(f"{path}: cannot be written: {error.strerror}") from None


def grey(image: Image) -> Image:
    """Return the image as (H, W) grey levels."""
    return image if image.ndim == 2 else np.asarray(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY))


def dictionary(name: str) -> cv2.aruco.Dictionary:
    """Return a predefined tag dictionary; BadInput names the known ones."""
    if not (name.startswith("DICT_") and hasattr(cv2.aruco, name)):
        known = sorted(n for n in dir(cv2.aruco) if n.startswith("DICT_4X4"))
        raise BadInput(f"tag dictionary {name!r}: unknown; for example {', '.join(known)}")
    return cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, name))


def tag_detector(
    name: str, side_px: float = 0.0, image_px: int = 0, *, refine: bool = False
) -> TagDetector:
    """Return a detector for one dictionary; `refine` takes corners to a tenth of a pixel or so.

    Where the tag's side is known, given with the longer side of the image, outlines of other sizes
    are not read: most of the time goes into those.
    """
    settings = _tag_settings()
    if side_px:
        perimeter_ratio = 4.0 * side_px / image_px
        settings.minMarkerPerimeterRate = 0.5 * perimeter_ratio
        settings.maxMarkerPerimeterRate = 2.2 * perimeter_ratio
    if refine:
        settings.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_SUBPIX
        # OpenCV's 0.3 of a cell is a window of 1 px on a small tag and leaves 0.4 px; this, 0.1 px.
        settings.relativeCornerRefinmentWinSize = CORNER_WINDOW_CELLS
    return cv2.aruco.ArucoDetector(dictionary(name), settings)


def _tag_settings() -> cv2.aruco.DetectorParameters:
    settings = cv2.aruco.DetectorParameters()
    settings.perspectiveRemoveIgnoredMarginPerCell = CELL_MARGIN_RATIO
    settings.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_NONE
    return settings


def detect_tags(detector: TagDetector, image: Image, enlarge: int = 1) -> tuple[Ids, Array]:
    """Return the ids (N,) and corners (N, 4, 2), clockwise in the image from the tag's top left.

    Cells of fewer than some 6 px are read better from the image enlarged by a whole factor.
    """
    corners, found, _ = detector.detectMarkers(_enlarged(image, enlarge))
    numbers = ids(found)
    px = points(np.array(corners) if numbers.size else None).reshape(-1, 4, 2)
    return numbers, (px + 0.5) / enlarge - 0.5


def _enlarged(image: Image, factor: int) -> Image:
    """Return the grey image enlarged; pixel p of it is (p + 0.5) / factor - 0.5 of the image."""
    level = grey(image)
    if factor == 1:
        return level
    size = (level.shape[1] * factor, level.shape[0] * factor)
    return np.asarray(cv2.resize(level, size, interpolation=cv2.INTER_CUBIC))


def dictionary_size(name: str) -> int:
    """Return how many tags a dictionary holds."""
    return len(dictionary(name).bytesList)


def tag_bits(name: str, number: int) -> NDArray[np.bool_]:
    """Return the cells of a tag with its border, (n, n), True for black, top row first."""
    family = dictionary(name)
    cells = family.markerSize + 2
    return np.asarray(cv2.aruco.generateImageMarker(family, number, cells)) < 128


def charuco_board(
    columns: int, rows: int, square: float, marker: float, name: str, *, old: bool = False
) -> CharucoBoard:
    """Return a ChArUco board of columns x rows squares, `old` for the pattern before OpenCV 4.6."""
    board = cv2.aruco.CharucoBoard((columns, rows), square, marker, dictionary(name))
    board.setLegacyPattern(old)
    return board


def detect_charuco(board: CharucoBoard, image: Image, enlarge: int = 1) -> tuple[Ids, Array]:
    """Return the ids (N,) and places (N, 2) of the board's inner corners that are seen."""
    detector = cv2.aruco.CharucoDetector(board)
    detector.setDetectorParameters(_tag_settings())
    corners, found, _, _ = detector.detectBoard(_enlarged(image, enlarge))
    return ids(found), (points(corners) + 0.5) / enlarge - 0.5


def find_chessboard(
    image: Image, columns: int, rows: int, detector: str = "sector"
) -> Array | None:
    """Return the inner corners of a chessboard, (columns * rows, 2), row by row, or None.

    `detector` "sector" fits the checker pattern over a neighbourhood (OpenCV's SB) and is the more
    exact on blurred views; "classic" is gradient based with cornerSubPix. The two differ by up to
    0.7 % in the focal length they lead to.
    """
    size = (columns, rows)
    if detector == "sector":
        seen, corners = cv2.findChessboardCornersSB(grey(image), size, flags=cv2.CALIB_CB_ACCURACY)
        return points(corners) if seen else None
    seen, corners = cv2.findChessboardCorners(grey(image), size)
    if not seen:
        return None
    window = (CORNER_WINDOW_PX, CORNER_WINDOW_PX)
    return points(cv2.cornerSubPix(grey(image), corners, window, (-1, -1), ITERATIONS))


def calibrate(
    board_points: list[Array], image_points: list[Array], size_px: tuple[int, int]
) -> tuple[Array, Array, Array, Array]:
    """Fit one pinhole lens (k1, k2, p1, p2, k3) to views of a flat board.

    `board_points` are (N, 3) in m and `image_points` (N, 2) in px for each view. Returns
    (fx, fy, cx, cy, k1, k2, p1, p2, k3), their standard deviations in the same order, the RMS
    residual of each view in px, and each view's rotation and translation vectors, (V, 6).
    """
    result = cv2.calibrateCameraExtended(
        [p.astype(np.float32) for p in board_points],
        [p.astype(np.float32) for p in image_points],
        size_px,
        np.eye(3),
        np.zeros(5),
    )
    _, matrix, dist, turns, shifts, sigmas, _, errors = result
    k = np.asarray(matrix)
    lens = np.r_[k[0, 0], k[1, 1], k[0, 2], k[1, 2], np.asarray(dist).ravel()[:5]]
    places: Array = np.hstack([_flat(turns).reshape(-1, 3), _flat(shifts).reshape(-1, 3)])
    return lens, _flat(sigmas)[:9], _flat(errors), places


def board_place(lens: Array, board_points: Array, image_points: Array) -> Array:
    """Return rotation and translation vectors, (6,), of one flat board for a known lens."""
    matrix, dist = _split(lens)
    _, turn, shift = cv2.solvePnP(board_points, image_points, matrix, dist)
    return np.concatenate((_flat(turn), _flat(shift)))


def project(lens: Array, place: Array, board_points: Array) -> Array:
    """Return the pixels, (N, 2), of board points, (N, 3), seen from `place`, (6,)."""
    matrix, dist = _split(lens)
    px, _ = cv2.projectPoints(board_points, place[:3], place[3:], matrix, dist)
    return points(px)


def plane_map(points_xy: Array, px: Array) -> Array:
    """Return the (3, 3) projective map from points of a plane, (N, 2), to pixels, (N, 2)."""
    matrix, _ = cv2.findHomography(points_xy, px)
    return np.eye(3) if matrix is None else np.asarray(matrix, dtype=np.float64)


def mapped(matrix: Array, points_xy: Array) -> Array:
    """Return points of a plane, (N, 2), under a projective map."""
    return points(cv2.perspectiveTransform(points_xy.reshape(1, -1, 2), matrix))


def rotation(vector: ArrayLike) -> Array:
    """Return the rotation matrix (3, 3) of a rotation vector (3,)."""
    matrix, _ = cv2.Rodrigues(np.asarray(vector, dtype=np.float64).reshape(3, 1))
    return np.asarray(matrix, dtype=np.float64)


def _flat(array: ArrayLike) -> Array:
    return np.asarray(array, dtype=np.float64).ravel()


def _split(lens: Array) -> tuple[Array, Array]:
    fx, fy, cx, cy = lens[:4]
    return np.array([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]]), lens[4:]
