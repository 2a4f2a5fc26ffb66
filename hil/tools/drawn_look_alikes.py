"""`hil bench vision --drawn`: look-alikes of many kinds, each scene another one, one frame of each.

Every scene is drawn flat (`flat_scenes`), under a light, lens and sensor of the bench's conditions, from one
of four views, on a bright or a dark floor, with or without coloured things around it. Scenes in which two
discs happen to be the robot's equals, within what is accepted of it, are left out and counted.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from random import Random

import numpy as np

from hil.config.camera import CameraConfig, CameraPoseConfig, ClutterConfig, MarksConfig
from hil.core.types import Pose
from hil.tools.bench_vision import VIEWS as BENCH_VIEWS
from hil.tools.flat_scenes import FlatScenes, apparent
from hil.tools.look_alikes import GREEN, PLATE, RED, clutter, look_alike
from hil.tools.vision_conditions import CONDITIONS, VIEWS, Image, develop
from vision.camera import CameraModel
from vision.camera_setup import camera_model
from vision.localisers.marks import MarkLocaliser

Progress = Callable[[str], None]
Colour = tuple[float, float, float]
Things = Iterator[ClutterConfig]

DIAMETER_M, HALF_M = 0.06, 0.08
TOP_M = 0.1
COLOURS = ((HALF_M, RED), (-HALF_M, GREEN))
GREY = (0.36, 0.41, 0.44)
FLOORS = (GREY, GREY, GREY, (0.06, 0.06, 0.06), (0.15, 0.15, 0.16))
SIZES_PX = ((640, 480), (640, 480), (640, 480), (1280, 720))
LIGHTS = ("clean", "moderate", "severe", "extreme", "noise", "defocus", "jpeg", "gradient")
# Two discs are the robot's equals within so much of its marks' size and distance.
EQUAL_SIZE, EQUAL_DISTANCE = 0.08, 0.055


@dataclass(frozen=True, slots=True)
class Drawn:
    """What was taken for the robot in drawn scenes, by kind: (kind, scenes shown, scenes accepted)."""

    kinds: tuple[tuple[str, int, int], ...]
    equals: int
    taken_in: tuple[int, ...] = ()

    @property
    def scenes(self) -> int:
        """How many scenes were shown."""
        return sum(shown for _, shown, _ in self.kinds)

    @property
    def accepted(self) -> int:
        """In how many a robot was seen, where there is none."""
        return sum(taken for _, _, taken in self.kinds)


def at(pose: Pose, x_m: float, y_m: float = 0.0) -> tuple[float, float]:
    """Return the place of a point of something that lies at a pose."""
    c, s = math.cos(pose.theta_rad), math.sin(pose.theta_rad)
    return pose.x_m + c * x_m - s * y_m, pose.y_m + s * x_m + c * y_m


def _box(
    place_m: tuple[float, float], size_m: tuple[float, float], turn: float, colour: Colour
) -> ClutterConfig:
    return ClutterConfig(
        shape="box", x_m=place_m[0], y_m=place_m[1], size_m=size_m, theta_rad=turn, height_m=TOP_M,
        colour=colour,
    )  # fmt: skip


def _disc(place_m: tuple[float, float], diameter_m: float, colour: Colour) -> ClutterConfig:
    return ClutterConfig(
        x_m=place_m[0],
        y_m=place_m[1],
        size_m=(diameter_m, diameter_m),
        height_m=TOP_M,
        colour=colour,
    )


def _plate(rng: Random, pose: Pose) -> Things:
    size_m = (rng.uniform(0.26, 0.34), rng.uniform(0.12, 0.2))
    if rng.random() < 0.8:
        yield _box((pose.x_m, pose.y_m), size_m, pose.theta_rad, PLATE)


def _way(rng: Random) -> float:
    return rng.uniform(-math.pi, math.pi)


def _box_end(rng: Random, pose: Pose) -> Things:
    """One or both marks are the end of a box or tape of their colour, about as wide as they are."""
    yield from _plate(rng, pose)
    which = rng.choice(((0,), (1,), (0, 1)))
    for k, (x_m, colour) in enumerate(COLOURS):
        if k not in which:
            yield _disc(at(pose, x_m), DIAMETER_M, colour)
            continue
        wide, long = DIAMETER_M * rng.uniform(0.8, 1.25), rng.uniform(0.08, 0.5)
        turn, out = _way(rng), 0.5 * long - 0.5 * wide * rng.uniform(0.7, 1.1)
        x, y = at(pose, x_m)
        yield _box((x + out * math.cos(turn), y + out * math.sin(turn)), (long, wide), turn, colour)


def _stripe(rng: Random, pose: Pose) -> Things:
    """One or both marks are a stripe of their width."""
    yield from _plate(rng, pose)
    which = rng.choice(((0,), (1,), (0, 1)))
    for k, (x_m, colour) in enumerate(COLOURS):
        if k in which:
            size_m = (rng.uniform(0.2, 0.8), DIAMETER_M * rng.uniform(0.8, 1.2))
            yield _box(at(pose, x_m), size_m, _way(rng), colour)
        else:
            yield _disc(at(pose, x_m), DIAMETER_M, colour)


def _tail(rng: Random, pose: Pose) -> Things:
    """One or both marks go on as a tape of 0.7 to 1 of their width."""
    yield from _plate(rng, pose)
    which = rng.choice(((0,), (1,), (0, 1)))
    for k, (x_m, colour) in enumerate(COLOURS):
        x, y = at(pose, x_m)
        yield _disc((x, y), DIAMETER_M * rng.uniform(0.95, 1.05), colour)
        if k in which:
            wide, long, turn = DIAMETER_M * rng.uniform(0.7, 1.0), rng.uniform(0.08, 0.3), _way(rng)
            middle = (x + 0.5 * long * math.cos(turn), y + 0.5 * long * math.sin(turn))
            yield _box(middle, (long, wide), turn, colour)


def _ring(rng: Random, pose: Pose) -> Things:
    """One or both marks are rings, as a letter O."""
    yield from _plate(rng, pose)
    which, hole = rng.choice(((0,), (1,), (0, 1))), rng.uniform(0.45, 0.8)
    for k, (x_m, colour) in enumerate(COLOURS):
        yield _disc(at(pose, x_m), DIAMETER_M * rng.uniform(0.95, 1.05), colour)
        if k in which:
            yield _disc(
                at(pose, x_m), DIAMETER_M * hole, rng.choice((PLATE, GREY, COLOURS[1 - k][1]))
            )


def _cross(rng: Random, pose: Pose) -> Things:
    """Crosses of the marks' width."""
    yield from _plate(rng, pose)
    for x_m, colour in COLOURS:
        turn, wide = _way(rng), DIAMETER_M * rng.uniform(0.9, 1.1)
        thin = wide * rng.uniform(0.3, 0.6)
        yield _box(at(pose, x_m), (wide, thin), turn, colour)
        yield _box(at(pose, x_m), (thin, wide), turn, colour)


def _rectangle(rng: Random, pose: Pose) -> Things:
    """Rectangles of about a mark's area."""
    yield from _plate(rng, pose)
    for x_m, colour in COLOURS:
        side, aspect = 0.94 * DIAMETER_M * rng.uniform(0.9, 1.1), rng.uniform(0.75, 1.33)
        size_m = (side * math.sqrt(aspect), side / math.sqrt(aspect))
        yield _box(at(pose, x_m), size_m, _way(rng), colour)


def _cut(rng: Random, pose: Pose) -> Things:
    """Discs 20 to 60 % too large, cut straight."""
    yield from _plate(rng, pose)
    grown = rng.uniform(1.2, 1.6)
    for x_m, colour in COLOURS:
        x, y = at(pose, x_m)
        yield _disc((x, y), DIAMETER_M * grown, colour)
        turn, out = _way(rng), DIAMETER_M * rng.uniform(0.5, 0.8)
        sheet = (x + out * math.cos(turn), y + out * math.sin(turn))
        yield _box(sheet, (DIAMETER_M, 2.0 * DIAMETER_M), turn, rng.choice((PLATE, PLATE, GREY)))


def _crescent(rng: Random, pose: Pose) -> Things:
    """Discs of another size, a round piece of each hidden."""
    yield from _plate(rng, pose)
    grown = rng.choice((rng.uniform(1.2, 1.5), rng.uniform(0.7, 0.85)))
    for x_m, colour in COLOURS:
        x, y = at(pose, x_m)
        yield _disc((x, y), DIAMETER_M * grown, colour)
        turn, out = _way(rng), DIAMETER_M * rng.uniform(0.4, 0.8)
        over = (x + out * math.cos(turn), y + out * math.sin(turn))
        yield _disc(over, DIAMETER_M * rng.uniform(0.8, 1.4), rng.choice((PLATE, PLATE, GREY)))


def _pieces(rng: Random, pose: Pose) -> Things:
    """Small pieces where the marks would be: letters, scraps."""
    yield from _plate(rng, pose)
    for x_m, colour in COLOURS:
        for _ in range(rng.randint(3, 9)):
            turn, out = _way(rng), 0.42 * DIAMETER_M * math.sqrt(rng.random())
            place = at(pose, x_m + out * math.cos(turn), out * math.sin(turn))
            size_m = (rng.uniform(0.012, 0.03), rng.uniform(0.01, 0.03))
            if rng.random() < 0.5:
                yield _disc(place, size_m[0], colour)
            else:
                yield _box(place, size_m, _way(rng), colour)


def _two(rng: Random, pose: Pose, away: float, sizes: tuple[float, float]) -> Things:
    yield from _plate(rng, pose)
    for (x_m, colour), size in zip(COLOURS, sizes, strict=True):
        yield _disc(at(pose, x_m * away), DIAMETER_M * size, colour)


def _off(rng: Random, least: float, most: float) -> float:
    return 1.0 + rng.choice((-1.0, 1.0)) * rng.uniform(least, most)


def _near_distance(rng: Random, pose: Pose) -> Things:
    """Discs 8 to 14 % too near or too far apart."""
    yield from _two(rng, pose, _off(rng, 0.08, 0.14), (1.0, 1.0))


def _near_size(rng: Random, pose: Pose) -> Things:
    """Discs 13 to 20 % too large or small."""
    size = _off(rng, 0.13, 0.20)
    yield from _two(rng, pose, 1.0, (size, size))


def _one_size(rng: Random, pose: Pose) -> Things:
    """One disc 15 to 30 % too large or small."""
    sizes = [1.0, _off(rng, 0.15, 0.30)]
    rng.shuffle(sizes)
    yield from _two(rng, pose, 1.0, (sizes[0], sizes[1]))


def _at_the_border(rng: Random, _: Pose) -> Things:
    """Two marks too far apart, too near, or of another size, cut by the picture's border."""
    side = rng.choice((-1.0, 1.0))
    upright = Pose(side * rng.uniform(0.75, 1.0), rng.uniform(-0.5, 0.5), _way(rng))
    flat = Pose(rng.uniform(-0.8, 0.8), side * rng.uniform(0.5, 0.75), _way(rng))
    yield from look_alike(
        rng, rng.choice((upright, flat)), rng.choice(("distance", "size", "square"))
    )


def _crossed_plates(rng: Random, pose: Pose) -> Things:
    """Two robots' plates over one another: of each one mark is seen, not the robot's distance apart."""
    yield _box((pose.x_m, pose.y_m), (0.3, 0.16), pose.theta_rad, PLATE)
    yield _disc(at(pose, HALF_M), DIAMETER_M, RED)
    away, turn = 2.0 * HALF_M * _off(rng, 0.1, 0.3), rng.uniform(-0.5, 0.5)
    x, y = at(pose, HALF_M - away * math.cos(turn), away * math.sin(turn))
    over = _way(rng)
    middle = (x + HALF_M * math.cos(over), y + HALF_M * math.sin(over))
    yield _box(middle, (0.3, 0.16), over, PLATE)
    yield _disc((x, y), DIAMETER_M, GREEN)


def _crowd(rng: Random, _: Pose) -> Things:
    """Fifty discs and boxes of both colours."""
    for _count in range(50):
        colour = rng.choice((RED, GREEN))
        size_m = rng.choice(
            (rng.uniform(0.03, 0.05), rng.uniform(0.05, 0.07), rng.uniform(0.07, 0.1))
        )
        place = (rng.uniform(-0.9, 0.9), rng.uniform(-0.6, 0.6))
        if rng.random() < 0.5:
            yield _disc(place, size_m, colour)
        else:
            yield _box(place, (size_m, rng.uniform(0.03, 0.1)), _way(rng), colour)


KINDS: dict[str, Callable[[Random, Pose], Things]] = {
    "box end": _box_end, "stripe": _stripe, "tail": _tail, "ring": _ring, "cross": _cross,
    "rectangle": _rectangle, "cut disc": _cut, "crescent": _crescent, "pieces": _pieces,
    "distance": _near_distance, "size": _near_size, "one size": _one_size,
    "at the border": _at_the_border, "crossed plates": _crossed_plates, "crowd": _crowd,
}  # fmt: skip
# Of these the look-alike itself is made of discs of the marks' size, which are no equals as they are changed.
CHANGED = ("tail", "ring", "cut disc", "crescent")


@dataclass(frozen=True, slots=True)
class Scene:
    """One scene: what lies there, and how it is seen."""

    kind: str
    look_alike: tuple[ClutterConfig, ...]
    around: tuple[ClutterConfig, ...]
    view: str
    size_px: tuple[int, int]
    light: str
    floor: Colour


def scene(number: int, seed: int = 30) -> Scene:
    """Return a scene by its number, each drawn by itself; one kind comes after the other."""
    rng = Random(f"{seed}:{number}")
    kind = list(KINDS)[number % len(KINDS)]
    pose = Pose(rng.uniform(-0.6, 0.6), rng.uniform(-0.4, 0.4), _way(rng))
    things = tuple(KINDS[kind](rng, pose))
    around = clutter(rng, "no plate")[2:] if kind != "crowd" and rng.random() < 0.6 else ()
    view, size_px, light = rng.choice(list(_views())), rng.choice(SIZES_PX), rng.choice(LIGHTS)
    floor = FLOORS[-2] if kind == "crowd" else rng.choice(FLOORS)
    return Scene(kind, things, around, view, size_px, light, floor)


def _views() -> dict[str, CameraPoseConfig]:
    own: dict[str, CameraPoseConfig] = {str(name): view for name, view in BENCH_VIEWS.items()}
    return own | {"near": VIEWS["oblique"], "boom": CameraPoseConfig()}


@lru_cache(maxsize=8)
def _seen_from(
    view: str, size_px: tuple[int, int]
) -> tuple[CameraModel, FlatScenes, MarkLocaliser]:
    camera = CameraConfig(width_px=size_px[0], height_px=size_px[1], pose=_views()[view])
    model = camera_model(camera)
    return model, FlatScenes(model, TOP_M), MarkLocaliser(model, MarksConfig())


def has_equal(shown: Scene) -> bool:
    """Return whether two discs, as they seem at the marks' height, are the robot's marks but for a little."""
    model, _, _ = _seen_from(shown.view, shown.size_px)
    things = shown.around if shown.kind in CHANGED else (*shown.look_alike, *shown.around)
    discs = [apparent(model, t, TOP_M) for t in things if t.shape == "disc"]
    alike = [d for d in discs if abs(d.size_m[0] / DIAMETER_M - 1.0) < EQUAL_SIZE]
    return any(
        abs(math.dist((a.x_m, a.y_m), (b.x_m, b.y_m)) / (2.0 * HALF_M) - 1.0) < EQUAL_DISTANCE
        for a in alike if a.colour == RED
        for b in alike if b.colour == GREEN
    )  # fmt: skip


def picture(shown: Scene, number: int) -> Image:
    """Return the one frame of a scene."""
    _, flat, _ = _seen_from(shown.view, shown.size_px)
    sharp = flat.draw((*shown.around, *shown.look_alike), shown.floor)
    return develop(sharp, CONDITIONS[shown.light], np.random.default_rng(number))


def drawn_scenes(first: int, last: int, progress: Progress | None = None, seed: int = 30) -> Drawn:
    """Return in how many of the scenes `first` to `last` a robot is seen."""
    shown, taken, equals, numbers = Counter[str](), Counter[str](), 0, []
    for number in range(first, last + 1):
        if progress is not None and number % 100 == 0:
            progress(f"drawn scene {number}")
        one = scene(number, seed)
        if has_equal(one):
            equals += 1
            continue
        finder = _seen_from(one.view, one.size_px)[2]
        shown[one.kind] += 1
        if finder.locate(picture(one, number), None, 0.0).pose is not None:
            taken[one.kind] += 1
            numbers.append(number)
    return Drawn(tuple((kind, shown[kind], taken[kind]) for kind in KINDS), equals, tuple(numbers))


def together(pieces: Sequence[Drawn]) -> Drawn:
    """Return what pieces of a long run have shown in all."""
    shown, taken = Counter[str](), Counter[str]()
    for piece in pieces:
        for kind, scenes, accepted in piece.kinds:
            shown[kind] += scenes
            taken[kind] += accepted
    return Drawn(
        tuple((kind, shown[kind], taken[kind]) for kind in shown),
        sum(piece.equals for piece in pieces),
        tuple(sorted(number for piece in pieces for number in piece.taken_in)),
    )


def as_markdown(found: Drawn) -> str:
    """Return what was shown and taken for the robot, by kind, as docs/vision.md keeps it."""
    rows = [f"| {kind} | {shown} | {taken} |" for kind, shown, taken in found.kinds]
    rows.append(f"| all | {found.scenes} | {found.accepted} |")
    head = ["| kind | scenes | accepted |", "| --- | --- | --- |"]
    return "\n".join([*head, *rows])
