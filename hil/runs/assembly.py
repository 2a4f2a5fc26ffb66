"""The parts of a session, put together for a run."""

from __future__ import annotations

import time
from dataclasses import replace
from typing import TYPE_CHECKING

from hil.config.limits import wheel_speed_max_rad_s
from hil.control.estimators.making import make_estimator
from hil.control.laws.making import at_rest, bare_law, limited, make_outer_law
from hil.control.references import make_reference
from hil.control.vehicles.vehicle import make_vehicle
from hil.core.clocks import CameraClock
from hil.core.registries import OUTER_LAWS
from hil.record.timeline import Timeline
from hil.runs.orders import OperatorOrders, RetunedLaw, SteppedReference
from hil.runs.parts import Parts
from hil.wire.link import BoardLink
from vision.localisers.making import localiser_of_frames

if TYPE_CHECKING:
    from hil.config.scenario import SafetyConfig, Scenario
    from hil.core.rig import Rig
    from hil.core.types import OuterLaw
    from hil.record.memory import RunSink
    from hil.runs.orders import OrderSource
    from hil.runs.spec import RunSpec


def make_law(outer: str, scenario: Scenario) -> OuterLaw:
    """Return the outer law of a run; raises BadInput, and RigFault where one from outside fails."""
    control = scenario.control
    return make_outer_law(outer, control.active_gains, control.limits, scenario.robot.d0_m)


def make_live_law(outer: str, scenario: Scenario) -> tuple[OuterLaw, RetunedLaw]:
    """Return the same law made so that its gains can be changed, and what changes them; raises as `make_law`."""
    entry, control, d0_m = OUTER_LAWS.get(outer), scenario.control, scenario.robot.d0_m
    gains = control.active_gains.of(entry)
    live = RetunedLaw(entry, gains, lambda now: bare_law(entry, now, control.limits, d0_m))
    return at_rest(entry, live, control.limits), live


def make_parts(spec: RunSpec, rig: Rig, recorder: RunSink, law: OuterLaw) -> Parts:
    """Return the parts of a session over `rig` with its outer law; raises BadInput."""
    scenario, control = spec.scenario, spec.scenario.control
    vehicle = make_vehicle(scenario.robot)
    timeline = Timeline(recorder, _unix_us)
    return Parts(
        rig=rig,
        link=BoardLink(rig.stream, timeline.link_frame),
        camera_clock=CameraClock(scenario.camera.latency_s),
        localiser=localiser_of_frames(
            scenario.camera, drawn=spec.camera == "pose" and spec.is_simulated
        ),
        estimator=make_estimator(control.estimator, control, vehicle.geometry),
        law=limited(law, control, vehicle, wheel_speed_max_rad_s(scenario.board)),
        reference=make_reference(scenario.reference),
        vehicle=vehicle,
        recorder=recorder,
        timeline=timeline,
        own_terms=tuple(OUTER_LAWS.get(spec.outer).trace),
    )


def ordered(
    parts: Parts, source: OrderSource, safety: SafetyConfig, law: RetunedLaw | None
) -> Parts:
    """Return the parts of a session whose operator may order: steps of the goal, values of board and law.

    `law` is None where its gains are not to be touched.
    """
    goal = SteppedReference(parts.reference, safety)
    orders = OperatorOrders(source, parts.link, parts.timeline, goal, law)
    return replace(parts, orders=orders, reference=goal)


def _unix_us() -> int:
    return time.time_ns() // 1000
