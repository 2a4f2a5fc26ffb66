"""Board views gathered from a folder, a video or a live camera."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hil.core.errors import BadInput
from vision import cv_compat
from vision.calibration.advice import advise, coverage
from vision.calibration.boards import Board, BoardView, not_seen_hint
from vision.calibration.intrinsics import distance_px, off_lens_px, slant_deg
from vision.calibration.one_size import SizedView, at_one_size
from vision.sources import ImageFolder, LiveCamera, VideoFile, image_files

Image = NDArray[np.uint8]
Report = Callable[[str], None]

# A video is looked at this often; a hand needs about so long to bring the board elsewhere.
LOOKS_PER_S = 5.0
LOOK_TOLERANCE_S = 0.005  # containers round stamps to milliseconds
STILL_RATIO = 0.004
NEW_PLACE_RATIO = 0.06
NEW_CELLS = 2


@dataclass(slots=True)
class Views:
    """Views of one board at one image size; `missed` names images in which it was not seen.

    `faults` has why what was seen in an image is not the board, `looked` the images looked at and
    `where` names them: "12 images of DIR". `brought` says which were scaled or turned to the size.
    """

    size_px: tuple[int, int]
    views: list[BoardView] = field(default_factory=list)
    missed: list[str] = field(default_factory=list)
    faults: list[str] = field(default_factory=list)
    looked: int = 0
    where: str = ""
    hint: str = ""
    brought: list[str] = field(default_factory=list)

    def look_for_other(self, board: Board, image: Image) -> None:
        """Keep what is seen in place of the board, as long as nothing else was."""
        if not self.views and not self.hint:
            self.hint = not_seen_hint(board, image)

    def sound(self, view: BoardView | None) -> BoardView | None:
        """Return the view of the next image if it shows the board described, and count it."""
        self.looked += 1
        if view is not None and view.fault:
            self.faults.append(view.fault)
            return None
        return view

    def require(self, count: int) -> Views:
        """Raise BadInput where fewer views show the board, with what else was seen."""
        if len(self.views) >= max(count, len(self.faults)):
            return self
        if self.faults and len(self.faults) >= len(self.views):
            most, times = Counter(self.faults).most_common(1)[0]
            raise BadInput(
                f"another board than described in {len(self.faults)} of {self.where} ({times} times:"
                f" {most}); count its squares, not its corners, and give them as --board"
            )
        if not self.views:
            hint = self.hint or "; is it the board described?"
            raise BadInput(f"board not seen in any of {self.where}{hint}")
        raise BadInput(
            f"lens: {len(self.views)} usable views of the board in {self.where}, at least {count} are"
            " needed; add views from other sides and tilts, or is it another board than described?"
        )


def views_of_folder(board: Board, folder: Path, report: Report) -> Views:
    """Return a view of every image of the folder that shows the board; raises BadInput.

    Images of one sensor in several sizes, or turned by 90 degrees, are brought to one size.
    """
    found = Views((0, 0))
    sized: list[SizedView] = []
    for file in image_files(folder):
        image = cv_compat.read_image(file)
        seen = board.find(image, file.name)
        if seen is None and not sized:
            found.look_for_other(board, image)
        view = found.sound(seen)
        if view is not None:
            report(f"{file.name}: {len(view.px)} corners")
            sized.append(SizedView(view, image.shape[1::-1]))
        else:
            what = "board not seen" if seen is None else f"not this board: {seen.fault}"
            report(f"{file.name}: {what}")
            found.missed.append(file.name)
    found.where = f"{found.looked} images of {folder}"
    if sized:
        same = at_one_size(sized, off_lens_px)
        found.size_px, found.views = same.size_px, same.views
        found.brought = [*same.scaled, *same.turned]
    return found.require(1)


def views_of_video(board: Board, path: Path, report: Report) -> Views:
    """Return views of a video taken while the board is held still in new places."""
    source = VideoFile(path)
    found = Views((source.width_px, source.height_px))
    picker = Picker(found.size_px)
    next_look_s = -math.inf
    for frame in source.frames():
        # By stamps and not by number: browsers record at a rate of their own, and do not say which.
        if frame.t_cam_s < next_look_s - LOOK_TOLERANCE_S:
            continue
        next_look_s = frame.t_cam_s + 1.0 / LOOKS_PER_S
        assert frame.image is not None
        name = f"frame {frame.index} at {frame.t_cam_s:.2f} s"
        seen = board.find(frame.image, name)
        if seen is None:
            found.look_for_other(board, frame.image)
        view = picker.offer(found.sound(seen))
        if view is not None:
            found.views.append(view)
            report(f"{name}: view {len(found.views)}, {len(view.px)} corners")
    source.close()
    found.where = f"{found.looked} frames looked at of {path}"
    return found.require(1)


def views_of_camera(board: Board, camera: LiveCamera, wanted: int, report: Report) -> Views:
    """Return views from a live camera, saying what to show next, until `wanted` are taken."""
    found = Views((camera.width_px, camera.height_px))
    picker = Picker(found.size_px)
    next_look_s = -math.inf
    while len(found.views) < wanted:
        frame = camera.read()
        if frame.note:
            report(f"{camera.name}: {frame.note}")
        if frame.t_cam_s < next_look_s:
            continue
        next_look_s = frame.t_cam_s + 1.0 / LOOKS_PER_S
        assert frame.image is not None
        view = picker.offer(found.sound(board.find(frame.image, f"view {len(found.views) + 1}")))
        if view is not None:
            found.views.append(view)
            cells = coverage([v.px for v in found.views], found.size_px)
            hints = advise(cells, [slant_deg(v) for v in found.views])
            report(f"{view.name} of {wanted}: {hints[0] if hints else 'enough; more steady it'}")
    return found


class Picker:
    """Takes views that are still and show the board in a new place or new cells of the image."""

    def __init__(self, size_px: tuple[int, int]) -> None:
        self._size_px = size_px
        self._previous: BoardView | None = None
        self._taken: list[BoardView] = []

    def offer(self, view: BoardView | None) -> BoardView | None:
        """Return the view if it is worth keeping, None otherwise; offered in order of time."""
        previous, self._previous = self._previous, view
        if view is None or previous is None:
            return None
        width_px = self._size_px[0]
        if distance_px(view, previous) > STILL_RATIO * width_px or not self._is_new(view):
            return None
        self._taken.append(view)
        return view

    def _is_new(self, view: BoardView) -> bool:
        if all(distance_px(view, t) > NEW_PLACE_RATIO * self._size_px[0] for t in self._taken):
            return True
        before = coverage([t.px for t in self._taken], self._size_px) > 0
        now = coverage([view.px], self._size_px) > 0
        return int(np.sum(now & ~before)) >= NEW_CELLS


def floor_images(source: Path) -> Iterator[tuple[str, Image]]:
    """Yield (name, image) of an image file, a folder, or the first frame of a video."""
    if source.is_dir():
        folder = ImageFolder(source)
        frames: Iterable[tuple[str, Image | None]] = (
            (folder.files[frame.index].name, frame.image) for frame in folder.frames()
        )
    elif source.suffix.lower() in cv_compat.IMAGE_SUFFIXES or not source.exists():
        frames = [(source.name, cv_compat.read_image(source))]
    else:
        video = VideoFile(source)
        frames = [(source.name, next(video.frames()).image)]
        video.close()
    for name, image in frames:
        assert image is not None
        yield name, image


def blank_image(size_px: tuple[int, int]) -> Image:
    """Return a grey image to draw on where there is no photograph."""
    return np.full((size_px[1], size_px[0], 3), 96, dtype=np.uint8)
