"""A film and a folder of pictures by the twin's camera, to calibrate and localise without a rig.

What is drawn is known: the truth lies beside the pictures.
"""

from __future__ import annotations

import math
from pathlib import Path

import cv2
import numpy as np

from hil.config.camera import CameraConfig
from hil.core.errors import BadInput
from sim_twin.board_pictures import LENS, TagFloor, board_image, hand_held
from sim_twin.camera_sim import RenderedCamera
from vision.calibration.boards import parse_board
from vision.camera_setup import camera_model
from vision.cv_compat import require_place, write_atomic, write_image

FILM_SUFFIXES = (".avi", ".mkv")
BOARD = "charuco:8x6:30:22"
BOARD_VIEWS = 12
# Lower left corners of the tags on a sheet of 2.0 x 1.5 m whose middle is the world's origin.
TAGS = {1: (0.15, 0.15), 2: (1.0, 0.12), 3: (1.75, 0.15), 4: (0.2, 0.7), 5: (1.7, 0.7),
        6: (0.15, 1.25), 7: (1.0, 1.25), 8: (1.75, 1.25)}  # fmt: skip
TAG_M = 0.096
CORNER_M = np.array([-1.0, -0.75, 0.0])
# A figure of eight, 0.42 m/s at its fastest.
EIGHT_M, EIGHT_S = (0.55, 0.3), 12.0
ROBOT_POSE = (0.6, 0.4, 1.0)
EXPOSURE_POSES = 3

Place = tuple[float, float, float]


def eight(t_s: float) -> Place:
    """Return the pose (x m, y m, theta rad) at a time on a figure of eight, driven forward."""
    w = 2.0 * math.pi / EIGHT_S
    ax, ay = EIGHT_M
    dx, dy = ax * math.cos(w * t_s), 2.0 * ay * math.cos(2.0 * w * t_s)
    return ax * math.sin(w * t_s), ay * math.sin(2.0 * w * t_s), math.atan2(dy, dx)


def write_film(path: Path, camera: CameraConfig, duration_s: float, seed: int) -> Path:
    """Film the robot on a figure of eight as motion JPEG and return the CSV of its true poses.

    Raises BadInput where the film cannot be written; it is there complete, or not at all.
    """
    require_place(path, FILM_SUFFIXES)
    part = path.with_name(f".{path.stem}.part{path.suffix}")
    size = (camera.width_px, camera.height_px)
    code = cv2.VideoWriter.fourcc(*"MJPG")
    writer = cv2.VideoWriter(str(part), code, camera.rate_hz, size)
    if not writer.isOpened():
        raise BadInput(f"{path}: cannot be written as motion JPEG")
    rows = ["frame,t_s,x_m,y_m,theta_rad"]
    try:
        twin = RenderedCamera(camera, seed)
        for k in range(max(1, round(duration_s * camera.rate_hz))):
            t_s = k / camera.rate_hz
            steps = np.linspace(-0.5, 0.5, EXPOSURE_POSES) * camera.exposure_s
            writer.write(twin.make(k, [eight(t_s + step) for step in steps]))
            rows.append(f"{k},{t_s:.6f}," + ",".join(f"{value:.6f}" for value in eight(t_s)))
        writer.release()
        part.replace(path)
    finally:
        writer.release()
        part.unlink(missing_ok=True)
    truth = path.with_suffix(".csv")
    write_atomic(truth, ("\n".join(rows) + "\n").encode())
    return truth


def write_samples(folder: Path, camera: CameraConfig, film_s: float, seed: int) -> list[str]:
    """Fill a new or empty folder with all that the calibration page asks for; return what is there.

    Raises BadInput for a folder that holds something already.
    """
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise BadInput(f"{folder}: is there already; give the name of a new folder")
    require_place(folder)
    (folder / "boards").mkdir(parents=True)
    board = parse_board(BOARD)
    for k, (R, t) in enumerate(hand_held(board, BOARD_VIEWS)):
        write_image(folder / "boards" / f"view{k + 1:02d}.png", board_image(LENS, board, R, t, k))
    tags = TagFloor(TAGS, TAG_M)
    write_image(folder / "floor.png", board_image(camera_model(camera), tags, np.eye(3), CORNER_M))
    rows = ["id,x_m,y_m"]
    for number, (x, y) in TAGS.items():
        centre = (x + 0.5 * TAG_M + CORNER_M[0], y + 0.5 * TAG_M + CORNER_M[1])
        rows.append(f"{number},{centre[0]:.4f},{centre[1]:.4f}")
    write_atomic(folder / "tags.csv", ("\n".join(rows) + "\n").encode())
    picture = RenderedCamera(camera, seed).make(0, [ROBOT_POSE, ROBOT_POSE])
    write_image(folder / "robot.png", picture)
    write_film(folder / "drive.mkv", camera, film_s, seed)
    write_atomic(folder / "truth.toml", _truth(camera).encode())
    front, rear = (
        _pixel(camera, mark.x_m, mark.y_m) for mark in (camera.marks.front, camera.marks.rear)
    )
    return [
        f"boards/: {BOARD_VIEWS} views of {BOARD}",
        "floor.png, tags.csv: eight tags on the floor and the places of their centres",
        f"robot.png: front mark at pixel {front}, rear mark at {rear}",
        f"drive.mkv, drive.csv: {film_s:g} s of driving, and the true poses",
        "truth.toml: the camera that drew all this, to compare with",
    ]


def _pixel(camera: CameraConfig, x_m: float, y_m: float) -> str:
    x, y, theta = ROBOT_POSE
    c, s = math.cos(theta), math.sin(theta)
    height_m = camera.marks.height_m
    u, v = camera_model(camera).project_point(
        x + c * x_m - s * y_m, y + s * x_m + c * y_m, height_m
    )
    return f"{u:.0f},{v:.0f}"


def _truth(camera: CameraConfig) -> str:
    """Return lens, pose and marks as a camera file."""
    model = camera_model(camera)
    rotation = ", ".join(f"[{', '.join(f'{x:.9f}' for x in row)}]" for row in model.R_world_cam)
    names = ("fx_px", "fy_px", "cx_px", "cy_px", "k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6")
    values = (model.fx_px, model.fy_px, model.cx_px, model.cy_px, *model.dist)
    lens = "\n".join(f"{name} = {value!r}" for name, value in zip(names, values, strict=False))
    eye = ", ".join(f"{x!r}" for x in map(float, model.t_world_cam_m))
    return (
        f"width_px = {model.width_px}\nheight_px = {model.height_px}\n\n"
        f"[lens]\nfisheye = {str(model.fisheye).lower()}\n"
        f"at_width_px = {model.width_px}\nat_height_px = {model.height_px}\n{lens}\n\n"
        f"[pose]\neye_m = [{eye}]\nR_world_cam = [{rotation}]\n"
    )
