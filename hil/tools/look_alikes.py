"""`hil bench vision --empty`: scenes of coloured things and of what looks like the robot.

Each scene holds a dozen things of the marks' colours and one or two look-alikes. Most of its frames
are without the robot, where nothing may be found; in the others the robot stands among them.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from random import Random
from typing import Literal

from hil.config.camera import (
    CameraConfig,
    CameraPoseConfig,
    ClutterConfig,
    MarksConfig,
    SceneConfig,
)
from hil.core.types import Pose, PoseMeasurement, wrap_pi
from sim_twin.camera_sim import RenderedCamera
from vision.camera_setup import camera_model
from vision.localisers.marks import TWO_PLACES, MarkLocaliser

Progress = Callable[[str], None]
Kind = Literal["distance", "size", "colour", "reflection", "no plate", "square", "second robot"]

KINDS: tuple[Kind, ...] = (
    "distance", "size", "colour", "reflection", "no plate", "square", "second robot",
)  # fmt: skip
FRAMES_PER_SCENE = 50
WITH_ROBOT_EVERY = 5
CLEAR_M = 0.4  # of the robot from look-alikes and from what stands on the floor
GROSS_M, GROSS_RAD = 0.02, math.radians(5.0)
PLATE = (0.05, 0.05, 0.05)
RED, GREEN = (0.07, 0.06, 0.62), (0.12, 0.42, 0.08)
# A shining floor shows the robot as far below it as it stands above; drawn on the floor that is so
# much smaller for a camera some 2.2 m up, and darker.
REFLECTION_RATIO, REFLECTED_RATIO = 0.957, (0.3, 0.7)


@dataclass(frozen=True, slots=True)
class Empty:
    """What was seen in scenes without the robot, and beside look-alikes.

    `accepted` of `frames` without the robot had a pose; of `with_robot` frames `found` had the
    robot's and `wrong` another. Where a second robot stands and nobody said which is ours, `wrong` is
    every pose. `accepted_by` counts the look-alikes of the scenes in which one was taken for it, and
    `taken_in` has the numbers of these scenes, to be looked at.
    """

    scenes: int
    frames: int
    accepted: int
    with_robot: int = 0
    found: int = 0
    wrong: int = 0
    accepted_by: tuple[tuple[str, int], ...] = ()
    taken_in: tuple[int, ...] = ()


@dataclass(slots=True)
class _Count:
    frames: int = 0
    accepted: int = 0
    with_robot: int = 0
    found: int = 0
    wrong: int = 0


def clutter(rng: Random, kind: Kind = "distance") -> tuple[ClutterConfig, ...]:
    """Return a look-alike and a dozen things of the marks' colours and of others.

    Some discs have the marks' own size, and some lie on a dark sheet as marks do. Only two of both
    colours, at the robot's own distance on dark ground, would be the robot's equal.
    """
    place = Pose(rng.uniform(-0.6, 0.6), rng.uniform(-0.4, 0.4), rng.uniform(-3.0, 3.0))
    things = list(look_alike(rng, place, kind))
    for _ in range(12):
        colour = rng.choice((RED, GREEN, RED, GREEN, (0.5, 0.2, 0.05), (0.08, 0.5, 0.55)))
        size_m = rng.choice((0.06, rng.uniform(0.02, 0.2)))
        at = {
            "x_m": rng.uniform(-0.9, 0.9),
            "y_m": rng.uniform(-0.6, 0.6),
            "theta_rad": rng.uniform(0.0, 3.0),
        }
        if rng.random() < 0.3:
            sheet = (size_m + rng.uniform(0.03, 0.1), size_m + rng.uniform(0.03, 0.1))
            things.append(
                ClutterConfig(shape="box", size_m=sheet, height_m=1e-4, colour=PLATE, **at)
            )
        shape: Literal["disc", "box"] = rng.choice(("disc", "disc", "box"))
        size = (size_m, size_m if shape == "disc" else rng.uniform(0.02, 0.2))
        height_m = rng.choice((0.001, 0.001, 0.1, rng.uniform(0.0, 0.2)))
        things.append(
            ClutterConfig(shape=shape, size_m=size, height_m=height_m, colour=colour, **at)
        )
    return tuple(things)


def look_alike(rng: Random, pose: Pose, kind: Kind) -> Iterator[ClutterConfig]:
    """Yield a plate with two marks that are the robot's but for one thing; a second robot's are equal.

    Distance: 10 to 40 % off. Size: 20 to 50 % off. Colour: both marks of one. Reflection: as seen in a
    shining floor. No plate: marks on the bare floor. Square: of the marks' width.
    """
    marks = MarksConfig()
    away = rng.choice((-1.0, 1.0))
    gap = 1.0 + away * rng.uniform(0.1, 0.4) if kind == "distance" else 1.0
    size = rng.choice((rng.uniform(0.5, 0.8), rng.uniform(1.2, 1.5))) if kind == "size" else 1.0
    height_m, light = marks.height_m, 1.0
    if kind == "reflection":
        gap = size = REFLECTION_RATIO
        height_m, light = 0.002, rng.uniform(*REFLECTED_RATIO)
    elif kind == "no plate":
        height_m = 0.001
    colours = [mark.colour for mark in (marks.front, marks.rear)]
    if kind == "colour":
        colours = [rng.choice(colours)] * 2
    if kind != "no plate":
        yield ClutterConfig(
            shape="box", x_m=pose.x_m, y_m=pose.y_m, theta_rad=pose.theta_rad,
            size_m=(0.32, 0.16), height_m=height_m - 0.001, colour=PLATE,
        )  # fmt: skip
    c, s = math.cos(pose.theta_rad), math.sin(pose.theta_rad)
    for mark, (b, g, r) in zip((marks.front, marks.rear), colours, strict=True):
        yield ClutterConfig(
            shape="box" if kind == "square" else "disc", theta_rad=pose.theta_rad,
            x_m=pose.x_m + gap * mark.x_m * c, y_m=pose.y_m + gap * mark.x_m * s,
            size_m=(size * marks.diameter_m,) * 2, height_m=height_m,
            colour=(light * b, light * g, light * r),
        )  # fmt: skip


def empty_scenes(
    frames: int,
    views: tuple[CameraPoseConfig, ...],
    progress: Progress | None = None,
    seed: int = 20,
    per_scene: int = FRAMES_PER_SCENE,
    first: int = 0,
) -> Empty:
    """Return how often a robot is seen where there is none, or elsewhere than it stands.

    Scenes, of `per_scene` frames without the robot, have one kind of look-alike after the other, seen
    in the first of `views`, then in the next. From scene `first` on they are those that a call from the
    start would show: a long one can be made in pieces, whose counts add up (`together`).
    """
    rng = Random(seed)
    scenes = math.ceil(frames / per_scene)
    count, by, taken = _Count(), Counter[str](), []
    for scene in range(first + scenes):
        kind = KINDS[scene % len(KINDS)]
        if scene < first:
            _place(rng, clutter(rng, kind))
            continue
        if progress is not None:
            progress(f"empty scene {scene - first + 1} of {scenes}")
        before = count.accepted + count.wrong
        few = min(per_scene, frames - count.frames)
        _show(rng, kind, views[scene // len(KINDS) % len(views)], scene, few, count)
        if count.accepted + count.wrong > before:
            by[kind] += count.accepted + count.wrong - before
            taken.append(scene)
    return Empty(
        scenes, count.frames, count.accepted, count.with_robot, count.found, count.wrong,
        tuple(by.items()), tuple(taken),
    )  # fmt: skip


def together(pieces: Sequence[Empty]) -> Empty:
    """Return what pieces of one long run, each with scenes of its own, have shown in all."""
    by = Counter[str]()
    for piece in pieces:
        by.update(dict(piece.accepted_by))
    names = ("scenes", "frames", "accepted", "with_robot", "found", "wrong")
    return Empty(
        **{name: sum(getattr(piece, name) for piece in pieces) for name in names},
        accepted_by=tuple(by.items()),
        taken_in=tuple(sorted(scene for piece in pieces for scene in piece.taken_in)),
    )


def most_ratio(events: int, tried: int) -> float:
    """Return the upper end of the one-sided 95 % interval of a share (Clopper and Pearson 1934)."""
    from scipy import stats  # noqa: PLC0415 - takes a second, and few ask

    return 1.0 if events >= tried else float(stats.beta.ppf(0.95, events + 1, tried - events))


def _show(
    rng: Random, kind: Kind, view: CameraPoseConfig, scene: int, frames: int, count: _Count
) -> None:
    """Show one scene: `frames` without the robot, and a fifth as many with it."""
    things = clutter(rng, kind)
    # A second robot is an equal: it is shown only beside ours.
    alone = things[3:] if kind == "second robot" else things
    look = SceneConfig(clutter=alone, read_noise_dn=3.0, full_well_e=3000.0)
    camera = CameraConfig(pose=view, scene=look)
    localiser = MarkLocaliser(camera_model(camera), camera.marks)
    bare = RenderedCamera(camera, seed=scene)
    for index in range(frames):
        seen = localiser.locate(bare.make(index, ()), None, 0.0)
        count.accepted += seen.pose is not None
        count.frames += 1
    ours = _place(rng, things)
    if ours is None:
        return
    beside = camera.model_copy(update={"scene": look.model_copy(update={"clutter": things})})
    crowded = RenderedCamera(beside, seed=scene)
    which = _which(beside, ours) if kind == "second robot" else localiser
    for index in range(frames // WITH_ROBOT_EVERY):
        image = crowded.make(index, [(ours.x_m, ours.y_m, ours.theta_rad)] * 2)
        seen = which.locate(image, None, 0.0)
        count.with_robot += 1
        good = seen.pose is not None and _right(seen.pose, ours)
        count.found += good
        count.wrong += seen.pose is not None and not good
        if kind == "second robot":
            count.wrong += not _undecided(localiser.locate(image, None, 0.0), ours)


def _which(camera: CameraConfig, ours: Pose) -> MarkLocaliser:
    """Return a localiser that was told where our robot stands, a hand's width off."""
    told = camera.marks.model_copy(update={"which_m": (ours.x_m + 0.05, ours.y_m - 0.05)})
    return MarkLocaliser(camera_model(camera), told)


def _undecided(seen: PoseMeasurement, ours: Pose) -> bool:
    """Return whether, of two equals, none was taken; where one is hidden, ours may be."""
    return seen.reason == TWO_PLACES or seen.pose is None or _right(seen.pose, ours)


def _right(seen: Pose, truth: Pose) -> bool:
    off_m = math.hypot(seen.x_m - truth.x_m, seen.y_m - truth.y_m)
    return off_m <= GROSS_M and abs(wrap_pi(seen.theta_rad - truth.theta_rad)) <= GROSS_RAD


def _place(rng: Random, things: tuple[ClutterConfig, ...]) -> Pose | None:
    """Return a place of the robot clear of what stands; None where there is no room."""
    high = [thing for k, thing in enumerate(things) if k < 3 or thing.height_m > 0.05]
    for _ in range(100):
        pose = Pose(rng.uniform(-0.6, 0.6), rng.uniform(-0.4, 0.4), rng.uniform(-3.0, 3.0))
        if all(math.hypot(t.x_m - pose.x_m, t.y_m - pose.y_m) > CLEAR_M for t in high):
            return pose
    return None
