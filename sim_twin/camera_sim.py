"""The rendered camera: frames of the robot on the floor as a linear 8-bit colour sensor sees them.

The geometry (lens, floor, robot, blur over the exposure) and the sensor noise are in
`native/render*.cpp`; here the configuration is turned into the renderer's numbers, and the floor's
texture and the light are drawn once.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import cv2
import numpy as np
from numpy.typing import NDArray

from hil.config.camera import (
    BarConfig,
    CameraConfig,
    ClutterConfig,
    GlareConfig,
    RobotLookConfig,
    SceneConfig,
    ShadowEdgeConfig,
    TagConfig,
)
from hil.core.errors import BadInput
from sim_twin import _native
from vision.camera import TERMS
from vision.camera_setup import camera_model

if TYPE_CHECKING:
    from hil.core.rig import Picture

TEXTURE_SIZE = 800
TEXTURE_PERIOD_M = 2.0  # about; a whole number of tiles
JOINT_M = 0.004
JOINT_RATIO = 0.75

# A rolling shutter is drawn in bands of so many rows: 0.2 mm at 0.5 m/s and 30 us a row.
BAND_ROWS = 16
BAND_POSES = 5
ROBOT_REACH_M = 0.3

BLOCK_PX = 8

Map = NDArray[np.float64]
PoseTuple = tuple[float, float, float]
Window = tuple[int, int, int, int]  # left, top, right, bottom, px


class RenderedCamera:
    """Frames of one camera over one floor, the same for the same seed, index and poses."""

    def __init__(self, camera: CameraConfig, seed: int) -> None:
        self.width_px = camera.width_px
        self.height_px = camera.height_px
        self._renderer = _renderer(camera).reseeded(seed)
        self._camera = camera

    def make(self, index: int, poses: Sequence[PoseTuple]) -> NDArray[np.uint8]:
        """Return frame `index`, (height, width, 3) uint8 BGR.

        `poses` are (x_m, y_m, theta_rad) of the robot in world axes, evenly spaced from the start
        to the end of the exposure (two or more show motion blur); none gives the empty floor. With a
        rolling shutter that is from the start of the first row's exposure to the end of the last's.
        """
        if self._rolls(poses):
            return self._rolled(index, np.asarray(poses, np.float64))
        image: NDArray[np.uint8] = self._renderer.make(index, poses)
        return image

    def draw(self, index: int, poses: Sequence[PoseTuple]) -> Picture:
        """Return frame `index` as `make` does, drawn only where it is looked at."""
        if self._rolls(poses):
            return self.make(index, poses)
        return DrawnFrame(self._renderer, index, tuple(poses), (self.height_px, self.width_px, 3))

    def _rolls(self, poses: Sequence[PoseTuple]) -> bool:
        return self._camera.line_time_s > 0.0 and len(poses) > 1

    def _rolled(self, index: int, poses: Map) -> NDArray[np.uint8]:
        """Return a frame put together from bands of rows, each drawn as the robot was then."""
        camera = self._camera
        whole_s = camera.exposure_s + camera.line_time_s * (camera.height_px - 1)
        image: NDArray[np.uint8] | None = None
        for top in range(0, camera.height_px, BAND_ROWS):
            row = min(top + 0.5 * (BAND_ROWS - 1), camera.height_px - 1.0)
            if image is not None and not self._holds_robot(poses, row):
                continue
            start_s = row * camera.line_time_s
            then = np.linspace(start_s, start_s + camera.exposure_s, BAND_POSES) / whole_s
            at = then * (len(poses) - 1)
            now = np.column_stack(
                [np.interp(at, np.arange(len(poses)), column) for column in poses.T]
            )
            drawn = self._renderer.make(index, [(float(x), float(y), float(t)) for x, y, t in now])
            image = drawn.copy() if image is None else image
            image[top : top + BAND_ROWS] = drawn[top : top + BAND_ROWS]
        assert image is not None
        return image

    def _holds_robot(self, poses: Map, row: float) -> bool:
        """Return whether the robot, or its shade, may be in a band of rows."""
        corners = ROBOT_REACH_M * np.array([(-1, -1), (-1, 1), (1, -1), (1, 1)])
        floor = (poses[[0, -1], None, :2] + corners).reshape(-1, 2)
        points = np.vstack([np.column_stack((floor, np.full(8, z))) for z in (0.0, 0.15)])
        rows = camera_model(self._camera).project(points)[:, 1]
        return bool(rows.min() - BAND_ROWS <= row <= rows.max() + BAND_ROWS)


class DrawnFrame:
    """A frame drawn where it is looked at, in blocks of BLOCK_PX; every pixel is that of the whole frame.

    A robot that stands is so drawn once, though where it is expected jitters by a pixel.
    """

    def __init__(
        self,
        renderer: _native.Renderer,
        index: int,
        poses: tuple[PoseTuple, ...],
        shape: tuple[int, int, int],
    ) -> None:
        self._renderer = renderer
        self._index = index
        self._poses = poses
        self._image = renderer.blank()
        self._windows: list[Window] = []
        self.shape = shape

    @property
    def content(self) -> object:
        """What drawings of equal pixels have equal: no two frames of a camera have the same noise."""
        return id(self._renderer), self._index, self._poses

    def part(self, window: Window) -> NDArray[np.uint8]:
        """Return the whole frame's array, of which `window` at least is drawn."""
        height, width, _ = self.shape
        left, top = (max(0, edge // BLOCK_PX * BLOCK_PX) for edge in window[:2])
        right, bottom = (-(-edge // BLOCK_PX) * BLOCK_PX for edge in window[2:])
        wanted = (left, top, min(right, width), min(bottom, height))
        if not any(_holds(drawn, wanted) for drawn in self._windows):
            self._renderer.draw(self._index, self._poses, wanted, self._image)
            self._windows.append(wanted)
        return self._image

    def whole(self) -> NDArray[np.uint8]:
        """Return the frame, (height, width, 3) uint8 BGR."""
        return self.part((0, 0, self.shape[1], self.shape[0]))


def _holds(drawn: Window, wanted: Window) -> bool:
    """Return whether one window lies in another; one without pixels lies in any."""
    if wanted[2] <= wanted[0] or wanted[3] <= wanted[1]:
        return True
    begins = drawn[0] <= wanted[0] and drawn[1] <= wanted[1]
    return begins and drawn[2] >= wanted[2] and drawn[3] >= wanted[3]


# The renderer of the last camera, by its configuration: the next run mostly has the same.
_kept: dict[str, _native.Renderer] = {}


def _renderer(camera: CameraConfig) -> _native.Renderer:
    """Return a camera's renderer; lines of sight, floor and light take a third of a second.

    None of them depends on the seed, which is 0 here.
    """
    key = camera.model_dump_json()
    found = _kept.get(key)
    if found is None:
        view = _view(camera)
        floor_m = np.asarray(_native.floor_map(view))
        found = _native.Renderer(view, _scene(camera.scene, floor_m), _robot(camera), 0)
        _kept.clear()
        _kept[key] = found
    return found


def _view(camera: CameraConfig) -> _native.View:
    model = camera_model(camera)
    view = _native.View()
    view.width, view.height = model.width_px, model.height_px
    view.fx, view.fy, view.cx, view.cy = model.fx_px, model.fy_px, model.cx_px, model.cy_px
    view.dist = list(model.dist[:TERMS])
    view.below = list(model.dist[TERMS:] or (0.0, 0.0, 0.0))
    view.fisheye = model.fisheye
    view.R = model.R_world_cam.ravel().tolist()
    view.t = model.t_world_cam_m.tolist()
    return view


def _robot(camera: CameraConfig) -> _native.Robot:
    look, marks = camera.robot_look, camera.marks
    robot = _native.Robot()
    robot.half_length, robot.half_width = 0.5 * look.plate_length_m, 0.5 * look.plate_width_m
    robot.bottom, robot.top = look.body_bottom_m, marks.height_m
    robot.wheel_radius, robot.wheel_half_width = look.wheel_radius_m, 0.5 * look.wheel_width_m
    robot.half_track, robot.half_base = 0.5 * look.track_m, 0.5 * look.wheelbase_m
    robot.axle_x = look.axle_x_m
    robot.plate, robot.side = look.plate_colour, look.side_colour
    robot.tyre, robot.hub = look.tyre_colour, look.hub_colour
    colours = [mark.colour for mark in marks.all]
    if marks.swapped_marks:
        colours[:2] = reversed(colours[:2])
    tag = camera.tag
    patches = [] if tag else [_board(look)]
    for mark, colour in zip(marks.all, colours, strict=True):
        disc = _native.Patch()
        disc.disc = disc.mark = True
        disc.x, disc.y, disc.half_x = mark.x_m, mark.y_m, 0.5 * marks.diameter_m
        disc.colour = colour
        patches.append(disc)
    robot.patches = patches
    if tag:
        robot.tag = _tag(tag)
    return robot


def _board(look: RobotLookConfig) -> _native.Patch:
    board = _native.Patch()
    board.half_x, board.half_y = 0.5 * look.board_size_m[0], 0.5 * look.board_size_m[1]
    board.colour = look.board_colour
    return board


def _tag(tag: TagConfig) -> _native.Grid:
    """Return the tag's cells, black border included; raises BadInput for an unknown tag."""
    number = getattr(cv2.aruco, tag.dictionary, None)
    if number is None:
        raise BadInput(
            f"camera.robot_look.tag.dictionary: OpenCV has no {tag.dictionary!r}; try DICT_4X4_50"
        )
    dictionary = cv2.aruco.getPredefinedDictionary(number)
    if tag.tag_id >= len(dictionary.bytesList):
        raise BadInput(
            f"camera.robot_look.tag.tag_id = {tag.tag_id}: {tag.dictionary} ends at"
            f" {len(dictionary.bytesList) - 1}"
        )
    cells = dictionary.markerSize + 2
    image = cv2.aruco.generateImageMarker(dictionary, tag.tag_id, cells)
    grid = _native.Grid()
    grid.cells, grid.x, grid.y, grid.half = cells, tag.x_m, tag.y_m, 0.5 * tag.size_m
    grid.margin = tag.margin_ratio * tag.size_m
    grid.white = (image.ravel() > 127).astype(int).tolist()
    return grid


def _scene(scene: SceneConfig, floor_m: Map) -> _native.Scene:
    native = _native.Scene()
    native.floor = scene.floor_colour
    native.blocks = [_block(thing) for thing in scene.clutter]
    native.bars = [_bar(bar) for bar in scene.bars]
    native.white_balance = scene.white_balance
    native.blur = scene.blur_px
    native.read_noise = scene.read_noise_dn
    native.dn_per_electron = 255.0 / scene.full_well_e
    native.lamp_x, native.lamp_y = scene.lamp_lean
    native.shade = scene.robot_shade_ratio
    native.set_texture(*_texture(scene))
    light = scene.white_dn * _gradient(scene, floor_m) * _shadow(scene.shadow_edge, floor_m)
    native.set_light(light.astype(np.float32), _glare(scene.glare, floor_m).astype(np.float32))
    return native


def _block(thing: ClutterConfig) -> _native.Block:
    block = _native.Block()
    block.disc = thing.shape == "disc"
    block.x, block.y, block.theta = thing.x_m, thing.y_m, thing.theta_rad
    block.half_x, block.half_y = 0.5 * thing.size_m[0], 0.5 * thing.size_m[1]
    block.top = thing.height_m
    block.colour = thing.colour
    return block


def _bar(config: BarConfig) -> _native.Bar:
    bar = _native.Bar()
    bar.body = config.frame == "body"
    bar.x0, bar.y0 = config.start_m
    bar.x1, bar.y1 = config.end_m
    bar.half_width, bar.z = 0.5 * config.width_m, config.height_m
    bar.colour = config.colour
    return bar


def _texture(scene: SceneConfig) -> tuple[NDArray[np.float32], float]:
    """Return the floor's reflectance factor, (N, N) and periodic, and its step in m."""
    tiles = max(1, round(TEXTURE_PERIOD_M / scene.tile_m))
    step_m = tiles * scene.tile_m / TEXTURE_SIZE
    rng = np.random.default_rng(scene.texture_seed)
    spectrum = np.fft.rfft2(rng.standard_normal((TEXTURE_SIZE, TEXTURE_SIZE)))
    ky = np.fft.fftfreq(TEXTURE_SIZE, step_m)[:, None]
    kx = np.fft.rfftfreq(TEXTURE_SIZE, step_m)[None, :]
    cycles = np.hypot(kx, ky)
    # Blotches of decimetres and grain of some 6 mm, about equal in strength.
    weight = 1.0 / (1.0 + (cycles / 4.0) ** 1.5) + 0.05 * np.exp(-((cycles * 0.006) ** 2))
    weight[0, 0] = 0.0
    speckle = np.fft.irfft2(spectrum * weight, s=(TEXTURE_SIZE, TEXTURE_SIZE))
    texture = 1.0 + scene.texture_ratio * speckle / speckle.std()
    to_joint = np.abs(np.arange(TEXTURE_SIZE) * step_m % scene.tile_m - 0.5 * scene.tile_m)
    joint = to_joint < 0.5 * JOINT_M
    texture[joint, :] *= JOINT_RATIO
    texture[:, joint] *= JOINT_RATIO
    return np.clip(texture, 0.2, 2.0).astype(np.float32), step_m


def _gradient(scene: SceneConfig, floor_m: Map) -> Map:
    """Return the light's fall across the image, 1 at its bright end."""
    height, width = floor_m.shape[:2]
    v, u = np.mgrid[0:height, 0:width]
    across = math.cos(scene.gradient_azimuth_rad) * u + math.sin(scene.gradient_azimuth_rad) * v
    span = (across - across.min()) / (across.max() - across.min())
    return np.asarray(1.0 - scene.gradient_ratio * (1.0 - span))


def _shadow(edge: ShadowEdgeConfig | None, floor_m: Map) -> Map:
    """Return the share of light a shadow edge leaves: shade lies left of its direction."""
    if edge is None:
        return np.ones(floor_m.shape[:2])
    normal = (-math.sin(edge.azimuth_rad), math.cos(edge.azimuth_rad))
    into_m = (floor_m - np.array(edge.through_m)) @ np.array(normal)
    t = np.clip(into_m / max(edge.softness_m, 1e-6) + 0.5, 0.0, 1.0)
    return np.asarray(1.0 - edge.depth_ratio * t * t * (3.0 - 2.0 * t))


def _glare(glare: GlareConfig | None, floor_m: Map) -> Map:
    """Return the white light added by a mirrored lamp, DN."""
    if glare is None:
        return np.zeros(floor_m.shape[:2])
    away = np.sum((floor_m - np.array((glare.x_m, glare.y_m))) ** 2, axis=2)
    return np.asarray(glare.peak_dn * np.exp(-0.5 * away / glare.radius_m**2))
