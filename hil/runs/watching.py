"""Those who judge a run between its ticks, and what they judge by. The code is native/*.hpp.

- Supervision: when the host stops the robot by itself (board, link, camera, fence, camera against wheels).
- Plausibility: residuals between commands, wheels, PWM and camera, each a named fault with its evidence.
  What the board judges by itself (stall, runaway, overspeed, silence) stays with it and comes first; the
  host sees what needs the command, the camera or more time: a side that only creeps, frames that repeat,
  sides exchanged, an encoder that comes and goes, a robot that gets nowhere. A side that is weak is told
  and stops nothing. False-alarm and detection figures: docs/faults.md.
- Limits: which side stands at the board's limit, from what the board reports, and what that cost. A side
  is at its limit when the duty it reports is the most that PWM_MAX lets it give, in the direction of the
  speed it lacks.

Nothing here reads a clock. World frame, SI; sides are (left, right), positive is forward.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from hil.control.estimators.fused import Fused, excess
from hil.control.vehicles.vehicle import TwoSided
from hil.core.rig import whole
from hil.core.types import Pose
from hil.record.memory import MemoryRecorder
from hil.record.tick_rows import marks_of
from hil.runs import _native

if TYPE_CHECKING:
    from hil.config.camera import CameraConfig
    from hil.config.scenario import ReactionsConfig, Scenario
    from hil.core.rig import Frame, Picture
    from hil.runs.parts import Parts

Note = Callable[[str, str], None]
PoseTuple = tuple[float, float, float]
DIAGNOSIS = "diagnosis"  # kind of the record's events that the verdict repeats
# Of every how many rows and columns of an image one is compared with the image before.
_EVERY = 16


def stops(reactions: ReactionsConfig) -> list[bool]:
    """Return which of `_native.REACTIONS` end the run; the others are told once."""
    return [getattr(reactions, name) == "stop" for name in _native.REACTIONS]


def make_watch(scenario: Scenario, parts: Parts, note: Note) -> _native.Watch:
    """Return the judges of one run; they raise RigFault when the robot has to stop."""
    safety = scenario.safety
    return _native.Watch(
        fence_m=[
            safety.fence_x_min_m,
            safety.fence_x_max_m,
            safety.fence_y_min_m,
            safety.fence_y_max_m,
        ],
        link_lost_s=safety.link_lost_s,
        pose_lost_s=safety.pose_lost_s,
        stops=stops(safety.reactions),
        note=note,
        uplink_s=scenario.link.latency_s,
        rad_per_count=parts.vehicle.geometry.rad_per_count,
    )


def make_pump(
    parts: Parts, watch: _native.Watch, note: Note, camera: CameraConfig
) -> _native.Pump | None:
    """Return what takes bytes and frames in natively; None where somebody asks for them.

    It needs a simulated rig that native code drives, the default estimator itself, wheels as that believes
    them to be, and a record in memory. Into Python it steps for pictures.
    """
    handle = getattr(parts.rig, "native", None)
    sink = parts.recorder
    if handle is None or type(parts.estimator) is not Fused:
        return None
    if type(sink) is not MemoryRecorder or sink.keep_link:
        return None
    rig = handle()
    two_sided = getattr(type(parts.vehicle), "wheels", None) is TwoSided.wheels
    if rig is None or not two_sided:
        return None
    eye = _eye(parts, camera)
    return _native.Pump(
        rig, parts.link.native, parts.camera_clock, parts.estimator, watch, note, eye
    )


def _eye(parts: Parts, camera: CameraConfig) -> Callable[[PoseTuple | None], tuple[Any, ...]]:
    """Return what finds the robot in the picture of the frame that native code took last.

    It is given where the robot is expected, if that is known, and returns what native/bindings.cpp takes.
    """
    locate, radius_m, rig = parts.localiser.locate, camera.search_radius_m, parts.rig

    def look(expected: PoseTuple | None) -> tuple[Any, ...]:
        picture: Picture = rig.picture()  # type: ignore[attr-defined] # of those rigs that have a pump
        predicted = None if expected is None else Pose(*expected)
        seen = locate(picture, predicted, radius_m)
        pose, details = seen.pose, seen.details
        return (
            None if pose is None else (pose.x_m, pose.y_m, pose.theta_rad),
            seen.quality,
            seen.sigma_xy_m,
            seen.sigma_theta_rad,
            seen.reason,
            None if pose is None else excess(seen),
            seen.covariance,
            marks_of(details) if details else None,
        )

    return look


def picture_of(frame: Frame) -> bytes:
    """Return what equal pictures have equal, b"" where there is nothing to compare."""
    picture = frame.picture
    if picture is not None:
        content: object = getattr(picture, "content", None)
        if content is not None:
            return repr(content).encode()
        return bytes(whole(picture)[::_EVERY, ::_EVERY].tobytes())
    pose = frame.pose.pose if frame.pose is not None else None
    if pose is None:
        return b""
    return struct.pack("3d", pose.x_m + 0.0, pose.y_m + 0.0, pose.theta_rad + 0.0)
