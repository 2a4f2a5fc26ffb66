"""The process that looks at a camera for the Set-up page: `python -m hil.console.camera_worker`.

One order on standard input, then commands, a JSON line each; on standard output what `hil.console.hand_over`
says: pictures with what was found in them, and how it stands. It ends with its standard input.
"""

from __future__ import annotations

import json
import math
import os
import queue
import select
import sys
import threading
import time
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hil.console.hand_over import FRAME_LENGTH, HEAD, JSON, PICTURE, jpeg
from hil.core.errors import HilError, RigFault
from hil.rigs.frames import open_source
from vision import cv_compat
from vision.calibration.advice import advise, coverage
from vision.calibration.boards import Board, BoardView, parse_board
from vision.calibration.files import read_camera
from vision.calibration.intrinsics import slant_deg
from vision.calibration.views import Picker
from vision.localisers.making import make_localiser
from vision.sources import LOCKS, CameraControls, LiveCamera, image_files

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from hil.rigs.frames import FrameSource

    Image = NDArray[np.uint8]

# Looked at this often: a hand needs longer to bring a board elsewhere.
LOOKS_PER_S = 6.0
_MOST_VIEWS = 200


class Sight:
    """What was found in one picture, for drawing: `head` as JSON, in the picture's own pixels."""

    def __init__(self, **head: Any) -> None:
        self.head = head
        self.view: BoardView | None = None


class BoardFinder:
    """Looks for a calibration board, and keeps the pictures of views worth keeping."""

    def __init__(self, board: Board, folder: Path) -> None:
        self._board = board
        self._folder = folder
        self.views: dict[str, BoardView] = {}
        self._size_px = (0, 0)
        self._picker: Picker | None = None

    def begin(self, size_px: tuple[int, int]) -> None:
        """Take the views that lie in the folder already, of pictures of this size."""
        self._size_px = size_px
        self._picker = Picker(size_px)
        files = image_files(self._folder) if any(self._folder.iterdir()) else []
        for file in files[:_MOST_VIEWS]:
            image = cv_compat.read_image(file)
            view = self._board.find(image, file.name)
            if view is not None and not view.fault and image.shape[1::-1] == size_px:
                self.views[file.name] = view

    def look(self, image: Image) -> Sight:
        """Find the board in a picture."""
        view = self._board.find(image, "live")
        if view is None:
            return Sight(corners=[], said="board not seen")
        sight = Sight(corners=view.px.round(1).tolist(), said=view.fault)
        sight.view = None if view.fault else view
        return sight

    def worth(self, view: BoardView | None) -> bool:
        """Say whether a view is still, and new; offered in order of time."""
        return self._picker is not None and self._picker.offer(view) is not None

    def keep(self, image: Image, view: BoardView) -> None:
        """Keep a picture and its view."""
        number = 1
        while (place := self._folder / f"live-{number:03d}.png").exists():
            number += 1
        cv_compat.write_image(place, image)
        self.views[place.name] = view

    def drop(self, name: str) -> None:
        """Throw a view and its picture away."""
        if self.views.pop(name, None) is not None:
            (self._folder / name).unlink(missing_ok=True)

    def state(self) -> dict[str, Any]:
        """Return the views, the cells of the image that they cover, and what to show next."""
        cells = coverage([view.px for view in self.views.values()], self._size_px)
        return {
            "views": [{"name": name, "corners": len(v.px)} for name, v in self.views.items()],
            "covered": (cells > 0).astype(int).tolist(),
            "hints": advise(cells, [slant_deg(view) for view in self.views.values()]),
        }


class TagFinder:
    """Looks for tags of a dictionary, whatever their numbers."""

    def __init__(self, dictionary: str) -> None:
        self._detector = cv_compat.tag_detector(dictionary)

    def look(self, image: Image) -> Sight:
        """Find every tag."""
        numbers, corners = cv_compat.detect_tags(self._detector, image)
        tags: list[dict[str, Any]] = [
            {"id": int(number), "corners": four.round(1).tolist()}
            for number, four in zip(numbers.ravel().tolist(), corners, strict=True)
        ]
        tags.sort(key=lambda tag: int(tag["id"]))
        return Sight(tags=tags, said=f"{len(tags)} tags" if tags else "no tag seen")


class RobotFinder:
    """Looks for the robot as a run would, with the camera's file as it is now."""

    def __init__(self, file: Path) -> None:
        self._localiser = make_localiser(read_camera(file))

    def look(self, image: Image) -> Sight:
        """Find the robot."""
        seen = self._localiser.locate(image, None, 0.0)
        if seen.pose is None:
            return Sight(marks=[], said=f"robot not seen: {seen.reason}")
        at = seen.details
        marks = [
            [at[f"{mark}_u_px"], at[f"{mark}_v_px"]]
            for mark in ("front", "rear")
            if math.isfinite(at.get(f"{mark}_u_px", math.nan))
        ]
        x, y, degrees = seen.pose.x_m, seen.pose.y_m, math.degrees(seen.pose.theta_rad)
        return Sight(
            marks=marks, said=f"robot at ({x:.3f}, {y:.3f}) m, {degrees:.1f} deg, "
            f"quality {seen.quality:.2f}",
        )  # fmt: skip


class NoFinder:
    """Shows the picture alone."""

    def look(self, _image: Image) -> Sight:
        """Find nothing."""
        return Sight(said="")


def controls_of(source: FrameSource, asked: CameraControls) -> list[dict[str, Any]]:
    """Return what each control of a live camera was asked for and what is in force; none of other sources."""
    if not isinstance(source, LiveCamera):
        return []
    return [
        {
            "name": name,
            "asked": getattr(asked, name),
            "in_force": source.locked.get(name),
            "state": "locked" if name in source.locked else "left to the camera",
            "refused": any(name == other for other, _, _ in source.refused),
        }
        for name in LOCKS
    ]


class Viewer:
    """Looks at a source until told to end."""

    def __init__(self, order: dict[str, Any]) -> None:
        self._out = os.fdopen(os.dup(1), "wb")
        os.dup2(2, 1)
        self._commands: queue.Queue[dict[str, Any]] = queue.Queue()
        self._folder = Path(str(order["folder"]))
        self._auto = bool(order["auto"])
        self._order = order
        self._image: Image | None = None
        self._view: BoardView | None = None
        self._finder: BoardFinder | TagFinder | RobotFinder | NoFinder = self._finder_of(order)
        self._ended = threading.Event()

    def _finder_of(self, order: dict[str, Any]) -> BoardFinder | TagFinder | RobotFinder | NoFinder:
        find = order["find"]
        if find == "board":
            return BoardFinder(parse_board(str(order["board"])), self._folder / "lens")
        if find == "tags":
            return TagFinder(str(order["dictionary"]))
        if find == "robot":
            return RobotFinder(Path(str(order["camera_file"])))
        return NoFinder()

    def say(self, kind: bytes, body: bytes) -> None:
        """Say one thing to the console."""
        self._out.write(HEAD.pack(kind, len(body)) + body)
        self._out.flush()

    def run(self) -> None:
        """Look until the end of the commands, or of the source; raises RigFault, BadInput."""
        threading.Thread(target=self._listen, name="commands", daemon=True).start()
        asked = CameraControls(**self._order["controls"])
        text = str(self._order["source"])
        source: FrameSource = (
            LiveCamera(int(text), asked, patience_s=20.0) if text.isdigit() else open_source(text)
        )
        try:
            self._controls = controls_of(source, asked)
            self._look_on(source)
        finally:
            source.close()

    def _listen(self) -> None:
        for line in sys.stdin:
            self._commands.put(json.loads(line))
        self._ended.set()

    def _look_on(self, source: FrameSource) -> None:
        next_look_s, rate = -math.inf, _Rate()
        while not self._ended.is_set():
            select.select([source.fileno()], [], [], 0.1)
            newest = None
            while (frame := source.poll()) is not None:
                newest = frame
                rate.take(frame.t_cam_s)
            self._obey()
            if newest is None or time.monotonic() < next_look_s:
                continue
            if newest.image is None:
                raise RigFault("this camera gives poses and no pictures; serve it with pictures")
            next_look_s = time.monotonic() + 1.0 / LOOKS_PER_S
            self._show(newest.image, rate.rate_hz, newest.note)

    def _show(self, image: Image, rate_hz: float, note: str) -> None:
        first = self._image is None
        self._image = image
        if first and isinstance(self._finder, BoardFinder):
            self._finder.begin((image.shape[1], image.shape[0]))
        sight = self._finder.look(image)
        self._view = sight.view
        took = (
            isinstance(self._finder, BoardFinder) and self._finder.worth(sight.view) and self._auto
        )
        if took:
            self._keep()
        head = sight.head | {
            "which": "camera", "size": [image.shape[1], image.shape[0]],
            "rate_hz": round(rate_hz, 1) if math.isfinite(rate_hz) else None, "took": took,
        }  # fmt: skip
        packed = json.dumps(head).encode()
        self.say(PICTURE, FRAME_LENGTH.pack(len(packed)) + packed + jpeg(image))
        if first or took or note:
            self._tell(note)

    def _tell(self, note: str = "") -> None:
        state: dict[str, Any] = {"controls": self._controls, "note": note}
        if isinstance(self._finder, BoardFinder):
            state |= self._finder.state()
        self.say(JSON, json.dumps({"camera": state}).encode())

    def _keep(self) -> None:
        if (
            isinstance(self._finder, BoardFinder)
            and self._image is not None
            and self._view is not None
        ):
            self._finder.keep(self._image, self._view)

    def _obey(self) -> None:
        while not self._commands.empty():
            command = self._commands.get()
            do = command.get("do")
            if do == "take":
                self._keep()
            elif do == "drop" and isinstance(self._finder, BoardFinder):
                self._finder.drop(str(command["name"]))
            elif do == "auto":
                self._auto = bool(command["wanted"])
            elif do == "picture" and self._image is not None:
                self._alone(self._folder / str(command["set"]))
            self._tell()

    def _alone(self, folder: Path) -> None:
        """Keep the present picture as the only one of a folder."""
        for file in folder.iterdir():
            file.unlink()
        assert self._image is not None
        cv_compat.write_image(folder / "live.png", self._image)
        self.say(JSON, json.dumps({"picture": folder.name}).encode())


class _Rate:
    """Frames per second over the last stamps."""

    def __init__(self) -> None:
        self._stamps_s: list[float] = []

    def take(self, t_s: float) -> None:
        """Take a frame's stamp."""
        self._stamps_s = [*self._stamps_s[-60:], t_s]

    @property
    def rate_hz(self) -> float:
        """Return the rate; NaN before there are two."""
        gaps: Sequence[float] = np.diff(self._stamps_s).tolist()
        return 1.0 / float(np.median(gaps)) if gaps and np.median(gaps) > 0.0 else math.nan


def main() -> int:
    """Look at what the first line says; status 0 when told to end."""
    order = json.loads(sys.stdin.readline() or "{}")
    if not order:
        return 0
    viewer = None
    try:
        viewer = Viewer(order)
        viewer.run()
    except (HilError, OSError) as error:
        said = json.dumps({"refused": " ".join(str(error).split())}).encode()
        out = viewer.say if viewer is not None else _say
        out(JSON, said)
        return 2
    except KeyboardInterrupt:
        return 130
    return 0


def _say(kind: bytes, body: bytes) -> None:
    sys.stdout.buffer.write(HEAD.pack(kind, len(body)) + body)
    sys.stdout.buffer.flush()


if __name__ == "__main__":
    sys.exit(main())
