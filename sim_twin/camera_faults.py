"""What faults do to the pictures and stamps of the simulated camera.

Times are host times of the exposure's begin, in s; poses are (x_m, y_m, theta_rad) in world axes.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Protocol

import numpy as np

from hil.config.events import OF_PICTURES
from hil.core.errors import BadInput

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from hil.config.camera import CameraConfig
    from hil.config.events import Fault
    from hil.core.rig import Picture
    from sim_twin.camera_timing import Span
    from sim_twin.drawn_poses import PoseTuple


class FrameMaker(Protocol):
    """Draws frames; see `sim_twin.camera_sim.RenderedCamera`."""

    def make(self, index: int, poses: Sequence[PoseTuple]) -> NDArray[np.uint8]:
        """Return the image of frame `index`; no poses: the robot is not to be seen."""

    def draw(self, index: int, poses: Sequence[PoseTuple]) -> Picture:
        """Return the same, drawn where it is looked at."""


class FaultyMaker:
    """Draws frames with what is wrong at their time; raises BadInput for a fault it has no picture for.

    `covered` gives the maker of a robot whose front mark cannot be told from its plate.
    """

    def __init__(
        self, maker: FrameMaker | None, faults: Sequence[Fault], covered: Callable[[], FrameMaker]
    ) -> None:
        self._maker = maker
        self._faults = [fault for fault in faults if fault.kind in OF_PICTURES]
        self._spans: list[Span] = []
        self._covered = None
        for fault in self._faults:
            if maker is None:
                raise BadInput(
                    f"faults: {fault.kind} is a fault of pictures, and drawn poses have none; "
                    "take --camera rendered"
                )
            if fault.kind == "camera_mark_covered":
                self._covered = covered()

    @property
    def any(self) -> bool:
        """Whether pictures are faulty at some time."""
        return bool(self._faults)

    def begin(self, span: Callable[[Fault], Span]) -> None:
        """Let the faults' times be those that `span` gives."""
        self._spans = [span(fault) for fault in self._faults]

    def make(self, t_s: float, index: int, poses: Sequence[PoseTuple]) -> Picture:
        """Return the picture of frame `index`, exposed from `t_s` on; drawn at once where it is faulty."""
        assert self._maker is not None
        now = [
            fault
            for fault, (start_s, end_s) in zip(self._faults, self._spans, strict=True)
            if start_s <= t_s < end_s
        ]
        if not now:
            return self._maker.draw(index, poses)
        covered = any(fault.kind == "camera_mark_covered" for fault in now)
        image = ((self._covered if covered else None) or self._maker).make(index, poses)
        for fault in now:
            image = self._disturbed(fault, image, index)
        return image

    def _disturbed(self, fault: Fault, image: NDArray[np.uint8], index: int) -> NDArray[np.uint8]:
        if fault.kind == "camera_exposure":
            lit: NDArray[np.uint8] = np.clip(image * fault.light_ratio, 0.0, 255.0).astype(np.uint8)
            return lit
        if fault.kind == "camera_colours":
            return np.ascontiguousarray(image[:, :, ::-1])
        if fault.kind == "camera_second_robot":
            return self._joined(image, index, (fault.x_m, fault.y_m, 0.0))
        return image

    def _joined(self, image: NDArray[np.uint8], index: int, other: PoseTuple) -> NDArray[np.uint8]:
        """Return the image with a second robot: the noise of a frame is the same whatever it shows."""
        assert self._maker is not None
        alone, empty = self._maker.make(index, (other, other)), self._maker.make(index, ())
        there = np.any(alone != empty, axis=2, keepdims=True)
        joined: NDArray[np.uint8] = np.where(there, alone, image)
        return joined


def covered_front(camera: CameraConfig) -> CameraConfig:
    """Return the camera over a robot whose front mark has the colour of its plate."""
    marks, look = camera.marks, camera.robot_look
    front = marks.front.model_copy(update={"colour": look.plate_colour})
    return camera.model_copy(update={"marks": marks.model_copy(update={"front": front})})
