"""What a localiser must do, checked: on rendered pictures whose truth is known."""

from __future__ import annotations

import math
import random
import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from hil.config.camera import CameraConfig
from hil.config.load import load_scenario
from hil.core.registries import LOCALISERS
from hil.core.types import Pose, PoseMeasurement, wrap_pi
from hil.tools.conformance.floor import mirrored_pose
from hil.tools.conformance.laws import SCENARIO
from hil.tools.conformance.report import Checks, Named, Report, Violation, entry_of
from hil.tools.conformance.watch import Heard, require_no_clock, require_no_random, watch
from sim_twin.camera_sim import RenderedCamera
from vision.localisers.making import make_localiser

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from vision.tracker import Localiser

    Image = NDArray[np.uint8]

# Most that a pose may be off in a picture of a robot at rest.
ERROR_M, ERROR_RAD = 0.01, 0.06
_PICTURES = 8
_SEED = 5


@dataclass(frozen=True, slots=True)
class Bench:
    """A camera's file, and pictures of its floor with the robot at known poses and without it."""

    camera: CameraConfig
    pictures: tuple[Image, ...]
    poses: tuple[Pose, ...]
    empty: Image

    def make(self) -> Localiser:
        """Return a new instance."""
        return make_localiser(self.camera)


def check_localiser(
    localiser: Named, *, scenario: str = SCENARIO, overrides: Sequence[str] = ()
) -> Report:
    """Return the report on a localiser that keeps every rule of the kit.

    Raises AssertionError that names the checks that do not hold, BadInput when there is none such.
    """
    return localiser_report(localiser, scenario=scenario, overrides=overrides).required()


def localiser_report(
    localiser: Named, *, scenario: str = SCENARIO, overrides: Sequence[str] = ()
) -> Report:
    """Return what the kit finds of a localiser; raises BadInput when there is none such."""
    with entry_of(LOCALISERS, localiser) as entry:
        texts = (f"camera.localiser={entry.name}", *overrides)
        bench = _bench(load_scenario(scenario, texts).camera)
        checks = Checks("localiser", entry.name, entry.origin)
        checks.run("finds the robot", lambda: _finds(bench))
        checks.run("near a prediction", lambda: _predicted(bench))
        checks.run("negative control", lambda: _turned(bench))
        checks.run("nothing where nothing is", lambda: _empty(bench))
        checks.run("honest figures", lambda: _figures(bench))
        checks.run("deterministic", lambda: _deterministic(bench))
        checks.run("no state shared", lambda: _shared(bench))
        checks.run("picture left as it is", lambda: _untouched(bench))
        heard = Heard()
        checks.run("no clock", lambda: _no_clock(bench, heard))
        checks.run("no unseeded random number", lambda: require_no_random(heard))
        checks.run("step time", lambda: _step_time(bench))
        return checks.report()


def _bench(camera: CameraConfig) -> Bench:
    rng = random.Random(_SEED)
    renderer = RenderedCamera(camera, _SEED)
    poses = [
        Pose(rng.uniform(-0.6, 0.6), rng.uniform(-0.35, 0.35), rng.uniform(-math.pi, math.pi))
        for _ in range(_PICTURES)
    ]
    pictures = [
        renderer.make(i, [(pose.x_m, pose.y_m, pose.theta_rad)] * 2) for i, pose in enumerate(poses)
    ]
    return Bench(camera, tuple(pictures), tuple(poses), renderer.make(_PICTURES, []))


def _all(localiser: Localiser, bench: Bench) -> list[PoseMeasurement]:
    """Return what is seen in every picture, without a prediction."""
    radius_m = bench.camera.search_radius_m
    found = [localiser.locate(picture, None, radius_m) for picture in bench.pictures]
    for answer in found:
        if not isinstance(answer, PoseMeasurement):
            raise Violation(f"locate returned {type(answer).__name__}, a PoseMeasurement is needed")
    return found


def _require_near(found: Sequence[PoseMeasurement], truths: Sequence[Pose]) -> str:
    off_m, off_rad = [], []
    for place, (seen, truth) in enumerate(zip(found, truths, strict=True)):
        if seen.pose is None:
            raise Violation(f"picture {place}, robot at {_told(truth)}: not seen ({seen.reason})")
        away_m = math.hypot(seen.pose.x_m - truth.x_m, seen.pose.y_m - truth.y_m)
        turn_rad = abs(wrap_pi(seen.pose.theta_rad - truth.theta_rad))
        if not (away_m <= ERROR_M and turn_rad <= ERROR_RAD):
            raise Violation(
                f"picture {place}, robot at {_told(truth)}: seen at {_told(seen.pose)}; at most "
                f"{1e3 * ERROR_M:g} mm and {ERROR_RAD:g} rad off"
            )
        off_m.append(away_m)
        off_rad.append(turn_rad)
    return f"{len(off_m)} pictures, worst {1e3 * max(off_m):.2f} mm, {max(off_rad):.4f} rad"


def _told(pose: Pose) -> str:
    return f"({pose.x_m:.3f} m, {pose.y_m:.3f} m, {pose.theta_rad:.3f} rad)"


def _finds(bench: Bench) -> str:
    return _require_near(_all(bench.make(), bench), bench.poses)


def _predicted(bench: Bench) -> str:
    localiser, radius_m = bench.make(), bench.camera.search_radius_m
    found = [
        localiser.locate(
            picture, Pose(pose.x_m + 0.004, pose.y_m - 0.003, pose.theta_rad + 0.02), radius_m
        )
        for picture, pose in zip(bench.pictures, bench.poses, strict=True)
    ]
    return _require_near(found, bench.poses)


def _turned(bench: Bench) -> str:
    try:
        _require_near(_all(bench.make(), bench), [mirrored_pose(pose) for pose in bench.poses])
    except Violation as seen:
        return f"against the floor with its lateral sign turned: {seen}"
    raise Violation("its answers pass against the floor with its lateral sign turned too")


def _empty(bench: Bench) -> str:
    localiser, radius_m = bench.make(), bench.camera.search_radius_m
    black = np.zeros_like(bench.empty)
    for name, picture in (("the empty floor", bench.empty), ("a black picture", black)):
        for predicted in (None, bench.poses[0]):
            seen = localiser.locate(picture, predicted, radius_m)
            if seen.pose is not None:
                raise Violation(f"{name}: seen at {_told(seen.pose)}")
            if not seen.reason:
                raise Violation(f"{name}: not seen, and no reason given")
    return "no pose and a reason, on the empty floor and in a black picture"


def _figures(bench: Bench) -> str:
    found = [seen for seen in _all(bench.make(), bench) if seen.pose is not None]
    for place, seen in enumerate(found):
        for name in ("sigma_xy_m", "sigma_theta_rad"):
            value = getattr(seen, name)
            if not (math.isfinite(value) and value > 0.0):
                raise Violation(f"picture {place}: {name} = {value!r}, above 0 is needed")
        if not 0.0 <= seen.quality <= 1.0:
            raise Violation(f"picture {place}: quality = {seen.quality!r}, 0 to 1 is needed")
    return f"sigmas above 0 and quality from 0 to 1 in {len(found)} pictures"


def _bits(seen: PoseMeasurement) -> tuple[Any, ...]:
    return repr(seen.pose), repr(seen.quality), repr(seen.sigma_xy_m), repr(seen.sigma_theta_rad)


def _require_same(
    one: Sequence[PoseMeasurement], two: Sequence[PoseMeasurement], what: str
) -> None:
    for place, (a, b) in enumerate(zip(one, two, strict=True)):
        if _bits(a) != _bits(b):
            raise Violation(f"{what}: picture {place}: {a.pose} against {b.pose}")


def _deterministic(bench: Bench) -> str:
    one, two = (_all(bench.make(), bench) for _ in range(2))
    _require_same(one, two, "two new ones, the same pictures")
    return "two new ones agree to the last bit"


def _shared(bench: Bench) -> str:
    """Two instances in turns, one through the pictures forwards and one backwards."""
    radius_m = bench.camera.search_radius_m
    alone = _all(bench.make(), bench)
    first, second = bench.make(), bench.make()
    there: list[PoseMeasurement] = []
    back: list[PoseMeasurement] = []
    for one, two in zip(bench.pictures, reversed(bench.pictures), strict=True):
        there.append(first.locate(one, None, radius_m))
        back.append(second.locate(two, None, radius_m))
    _require_same(alone, there, "alone, and in turns with another instance")
    _require_same(alone, back[::-1], "the pictures forwards and backwards")
    return "a picture gives the same, whatever was seen before"


def _untouched(bench: Bench) -> str:
    before = [picture.copy() for picture in bench.pictures]
    _all(bench.make(), bench)
    for place, (one, two) in enumerate(zip(before, bench.pictures, strict=True)):
        if not np.array_equal(one, two):
            raise Violation(f"picture {place} was changed; the recorder still needs it")
    return f"{len(before)} pictures are as they were"


def _no_clock(bench: Bench, heard: Heard) -> str:
    with watch(heard):
        _all(bench.make(), bench)
    return require_no_clock(heard, "a picture says all there is to say")


def _step_time(bench: Bench) -> str:
    localiser, taken_s = bench.make(), []
    for picture, pose in zip(bench.pictures, bench.poses, strict=True):
        began_s = time.thread_time()
        localiser.locate(picture, pose, bench.camera.search_radius_m)
        taken_s.append(time.thread_time() - began_s)
    # Processor time, and the least of all: what else runs on the machine only adds to it.
    frame_s, least_s = 1.0 / bench.camera.rate_hz, min(taken_s)
    said = f"{least_s * 1e3:.2f} ms a picture of processor time (least), a frame every {frame_s * 1e3:.1f} ms"
    if least_s > frame_s:
        raise Violation(f"{said}; frames would be dropped")
    return said
