"""The parts of a session, put together for a run."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

from hil.config.limits import wheel_speed_max_rad_s
from hil.control.estimators.making import make_estimator
from hil.control.laws.axes import in_axes
from hil.control.laws.let_go import LetGo
from hil.control.laws.turn_first import TurnFirst
from hil.control.laws.within import WithinWheelSpeed
from hil.control.references import make_reference
from hil.control.vehicles.vehicle import make_vehicle
from hil.core.clocks import CameraClock
from hil.core.registries import OUTER_LAWS
from hil.record.memory import MemoryRecorder, RunSink
from hil.record.timeline import Timeline
from hil.runs.parts import Parts
from hil.wire.link import BoardLink
from vision.localisers.making import localiser_of_frames

if TYPE_CHECKING:
    from hil.core.rig import Rig
    from hil.core.types import OuterLaw
    from hil.runs.spec import RunSpec


def make_parts(spec: RunSpec, rig: Rig, recorder: RunSink, law: OuterLaw) -> Parts:
    """Return the parts of a session over `rig`, its law under what holds for every law; raises BadInput."""
    scenario, control = spec.scenario, spec.scenario.control
    vehicle, limits = make_vehicle(scenario.robot), control.limits
    law = in_axes(law, control.axes_rad)
    law = WithinWheelSpeed(law, vehicle, wheel_speed_max_rad_s(scenario.board))
    law = TurnFirst(law, limits.turn_missing_rad_s)
    timeline = Timeline(recorder, _unix_us)
    return Parts(
        rig=rig,
        link=BoardLink(rig.stream, timeline.link_frame if _keeps_link(recorder) else None),
        camera_clock=CameraClock(scenario.camera.latency_s),
        localiser=localiser_of_frames(
            scenario.camera, drawn=spec.camera == "pose" and spec.is_simulated
        ),
        estimator=make_estimator(control.estimator, control, vehicle.geometry),
        law=LetGo(law, vehicle, limits.let_go_rad_s),
        reference=make_reference(scenario.reference),
        vehicle=vehicle,
        recorder=recorder,
        timeline=timeline,
        own_terms=tuple(OUTER_LAWS.get(spec.outer).trace),
    )


def _keeps_link(recorder: RunSink) -> bool:
    return type(recorder) is not MemoryRecorder or recorder.keep_link


def _unix_us() -> int:
    return time.time_ns() // 1000
