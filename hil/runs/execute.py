"""From a scenario to a finished run record: builds the parts, runs the session, closes the record."""

from __future__ import annotations

import time
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

import cv2

from hil.analysis.metrics import LinkStats
from hil.board.wheel_laws import WHEEL_LAWS
from hil.config.fit import check_fit
from hil.config.limits import check_edges, wheel_speed_max_rad_s
from hil.config.robot import BUILT_IN_PLANT
from hil.control.estimators.making import make_estimator
from hil.control.laws.axes import in_axes
from hil.control.laws.hold import HoldAtGoal
from hil.control.laws.let_go import LetGo
from hil.control.laws.turn_first import TurnFirst
from hil.control.laws.within import WithinWheelSpeed
from hil.control.references import make_reference
from hil.control.task_notes import notes
from hil.control.vehicles.vehicle import make_vehicle
from hil.core.clocks import CameraClock
from hil.core.errors import stop_status
from hil.core.figures import metric_of
from hil.core.registries import ESTIMATORS, FIGURES, LOCALISERS, OUTER_LAWS, REFERENCES, VEHICLES
from hil.core.registry import BUILT_IN, Entry, SourceText, in_one_line
from hil.record.manifest import (
    FigureTerm,
    Manifest,
    Plugin,
    TraceTerm,
    collect_versions,
    git_revision,
)
from hil.record.memory import MemoryRecorder
from hil.record.recorder import Recorder
from hil.record.schema import own_columns
from hil.record.tape import TapedRig
from hil.record.timeline import Timeline
from hil.rigs.opening import REPLAY, is_simulated, open_rig
from hil.runs.interruption import CtrlC
from hil.runs.law_guard import GuardedLaw
from hil.runs.orders import OperatorOrders, RetunedLaw, SteppedReference, with_orders
from hil.runs.outside import fault_of
from hil.runs.parts import Ending, Parts, Progress, Publish
from hil.runs.session import Session
from hil.runs.watched import WatchedSink
from hil.wire.identity import board_hashes
from hil.wire.link import BoardLink
from vision.localisers.making import make_localiser
from vision.looking import looker

if TYPE_CHECKING:
    from hil.config.camera import CameraConfig
    from hil.config.scenario import Scenario
    from hil.control.vehicles.vehicle import Vehicle
    from hil.core.registry import Entry
    from hil.core.rig import Picture, Rig
    from hil.core.types import OuterLaw, Pose, PoseMeasurement
    from hil.record.memory import RunSink
    from hil.record.reader import RunRecord
    from hil.runs.orders import OrderSource
    from hil.runs.watched import Watch
    from vision.looking import Looker


@dataclass(frozen=True, slots=True)
class RunSpec:
    """Everything that decides a run; two runs of equal specs on a simulated target are equal."""

    scenario: Scenario
    target: str
    camera: str
    outer: str
    inner: str
    seed: int
    out: Path
    record_camera: bool = False
    small_video: bool = False
    rerun: bool = True
    command: str = ""


def exit_status(record: RunRecord) -> int:
    """Return the exit status of a run: 0 held, 1 a requirement failed, 3 rig fault, 128 + signal."""
    outcome = record.manifest.outcome
    if outcome != "complete":
        return stop_status(record.manifest.outcome_detail) if outcome == "interrupted" else 3
    return 0 if all(verdict.holds for verdict in record.verdicts()) else 1


def judged_status(records: Iterable[RunRecord]) -> int:
    """Return the exit status of a command that looks at recorded runs.

    As a run's own, the gravest of all; but a record that was stopped by Ctrl-C or cut off has failed
    its requirements (1): this command was not stopped.
    """
    return max(3 if r.manifest.outcome == "fault" else min(exit_status(r), 1) for r in records)


def camera_for(scenario: Scenario, target: str, asked: str | None) -> str:
    """Return the camera asked for, or the target's default one."""
    if target.startswith(REPLAY):
        return "as recorded"
    return asked or (scenario.camera_source if is_simulated(target) else "0")


def new_folder(stem: str, root: Path = Path("runs")) -> Path:
    """Return a folder in `root` that does not exist yet, named after `stem` and the time."""
    stamp = datetime.now().astimezone().strftime("%Y%m%d-%H%M%S")
    folder = root / f"{stem}-{stamp}"
    number = 2
    while folder.exists():
        folder = folder.with_name(f"{stem}-{stamp}-{number}")
        number += 1
    return folder


def execute(
    spec: RunSpec,
    progress: Progress | None = None,
    rig: Rig | None = None,
    publish: Publish | None = None,
    watch: Watch | None = None,
    orders: OrderSource | None = None,
) -> RunRecord:
    """Run the spec and return its closed record; raises BadInput before anything is written.

    A record that cannot be written raises RecordFault, a signal that comes while it is closed Stopped
    (the record is whole then), and an error of the harness itself is raised once robot and record
    are left in good order.

    `rig` is another one than the spec's target names; it is closed here. `publish` is given the
    estimate of every tick, `watch` everything that the record is given, after it; `orders` are an operator's.
    """
    cv2.setNumThreads(1)  # search windows are small: handing them to threads costs more
    check_fit(spec.scenario)
    parameters = board_parameters(spec.scenario, spec.inner)
    law = make_law(spec)
    rig = rig or open_rig(spec.target, spec.scenario, spec.camera, spec.seed)
    manifest = make_manifest(spec)
    ctrl_c = CtrlC()
    try:
        with ctrl_c:
            recorder = Recorder(
                spec.out,
                manifest,
                plugins=plugins_of(spec),
                record_camera=spec.record_camera,
                small_video=spec.small_video,
                frame_rate_hz=spec.scenario.camera.rate_hz,
                rerun=spec.rerun,
            )
            sink = recorder if watch is None else WatchedSink(recorder, watch)
            try:
                taped = TapedRig(rig, recorder.tape, ctrl_c.obey)
                if orders is None:
                    parts = make_parts(spec, taped, sink, law)
                else:
                    noted = with_orders(orders, recorder.tape.order)
                    parts = make_ordered_parts(spec, taped, sink, noted)
                if watch is not None:
                    watch.began(parts)
                session = Session(
                    spec.scenario, parts, parameters, board_hashes, progress, publish
                )  # fmt: skip
            except Exception as error:
                ctrl_c.close()
                recorder.close("fault", in_one_line(error))
                raise fault_of(error, used_things(spec)) or error from None
            ending = _conduct(session, ctrl_c, used_things(spec))
            record = recorder.close(ending.outcome, ending.detail, link_stats(parts.link))
        if session.error is not None and fault_of(session.error, used_things(spec)) is None:
            raise session.error
        ctrl_c.obey()  # pressed after the last wait: this run is whole, whatever follows is not begun
        return record
    finally:
        rig.close()


def _conduct(session: Session, ctrl_c: CtrlC, used: Sequence[tuple[str, Entry]]) -> Ending:
    """Run the session to its end, whatever that is; from then on signals wait for the record."""
    try:
        ending = session.run()
    except KeyboardInterrupt as again:  # while the robot was being stopped
        ctrl_c.close()
        session.halt()
        return Ending("interrupted", str(again))
    ctrl_c.close()
    fault = fault_of(session.error, used) if session.error is not None else None
    return Ending("fault", str(fault)) if fault is not None else ending


def execute_in_memory(
    spec: RunSpec, rig: Rig | None = None, law: OuterLaw | None = None
) -> RunRecord:
    """Run the spec and return what a record would hold, without writing one (spec.out is unused).

    `rig` is another one than the spec's target names; it is closed here. `law` is another one than a
    new one of the spec.
    """
    check_fit(spec.scenario)
    parameters = board_parameters(spec.scenario, spec.inner)
    law = law or make_law(spec)
    rig = rig or open_rig(spec.target, spec.scenario, spec.camera, spec.seed)
    try:
        recorder = MemoryRecorder(make_manifest(spec))
        parts = make_parts(spec, rig, recorder, law)
        session = Session(spec.scenario, parts, parameters, board_hashes)
        ending = session.run()
        if session.error is not None:
            raise fault_of(session.error, used_things(spec)) or session.error
        return recorder.close(ending.outcome, ending.detail, link_stats(parts.link))
    finally:
        rig.close()


def board_parameters(scenario: Scenario, inner: str) -> dict[str, float]:
    """Return every board parameter as this run needs it; raises BadInput where the board cannot count."""
    parameters = scenario.board | {
        "ENC_COUNTS": float(scenario.robot.encoder_counts_per_turn),
        "LAW": WHEEL_LAWS[inner],
    }
    check_edges(parameters)
    return parameters


def make_law(spec: RunSpec) -> OuterLaw:
    """Return the outer law of a run, guarded where it comes from outside.

    Raises BadInput for an unknown one, RigFault for one that fails while it is made.
    """
    control = spec.scenario.control
    entry = OUTER_LAWS.get(spec.outer)
    law = _bare_law(spec, entry, control.active_gains.of(entry))
    return HoldAtGoal(law, control.limits) if _rests(entry) else law


def _bare_law(spec: RunSpec, entry: Entry, gains: Any) -> OuterLaw:
    """Return the law with these gains, without the rest at the goal."""
    limits, d0_m = spec.scenario.control.limits, spec.scenario.robot.d0_m
    if entry.origin == BUILT_IN:
        law: OuterLaw = entry.factory(gains, limits, d0_m)
        return law
    return GuardedLaw(entry, lambda: entry.factory(gains, limits, d0_m), limits)


def _rests(entry: Entry) -> bool:
    return entry.origin == BUILT_IN or bool(entry.extra.get("hold", True))


def plugins_of(spec: RunSpec) -> list[Plugin]:
    """Return what ran that is not part of the harness, for the record."""
    used = used_things(spec)
    found = [Plugin.of(kind, entry) for kind, entry in used if entry.origin != BUILT_IN]
    return found + _plant_of(spec)


def used_things(spec: RunSpec) -> list[tuple[str, Entry]]:
    """Return what the registries gave for a run, each with its kind."""
    control = spec.scenario.control
    used = (
        (OUTER_LAWS, spec.outer),
        (ESTIMATORS, control.estimator),
        (LOCALISERS, spec.scenario.camera.localiser),
        (REFERENCES, spec.scenario.reference.kind),
        (VEHICLES, spec.scenario.robot.vehicle.kind),
    )
    figures = ((FIGURES, name) for name in spec.scenario.own_figures)
    return [(registry.kind, registry.get(name)) for registry, name in (*used, *figures)]


def _plant_of(spec: RunSpec) -> list[Plugin]:
    """Return what worked out the robot's motion where the harness did not, for the record."""
    where = spec.scenario.robot.plant
    if not is_simulated(spec.target) or where == BUILT_IN_PLANT:
        return []
    path = Path(where)
    text = None if where.startswith("tcp:") or not path.is_file() else path.read_text("utf-8")
    source = None if text is None else SourceText(path, text)
    return [Plugin.of("plant", Entry(where, type(None), "", origin=where, source=source))]


def make_parts(spec: RunSpec, rig: Rig, recorder: RunSink, law: OuterLaw | None = None) -> Parts:
    """Return the parts of a session over `rig`; `law` is another one than a new one of the spec."""
    scenario, control = spec.scenario, spec.scenario.control
    vehicle = make_vehicle(scenario.robot)
    timeline = Timeline(recorder, _unix_us)
    return Parts(
        rig=rig,
        link=BoardLink(rig.stream, timeline.link_frame),
        camera_clock=CameraClock(scenario.camera.latency_s),
        localiser=_localiser_of(spec),
        estimator=make_estimator(control.estimator, control, vehicle.geometry),
        law=_limited(law or make_law(spec), vehicle, scenario),
        reference=make_reference(scenario.reference),
        vehicle=vehicle,
        recorder=recorder,
        timeline=timeline,
        own_terms=tuple(OUTER_LAWS.get(spec.outer).trace),
    )


def make_ordered_parts(
    spec: RunSpec, rig: Rig, recorder: RunSink, source: OrderSource, *, keep_gains: bool = False
) -> Parts:
    """Return the parts of a session whose operator may order; with `keep_gains`, not of the law."""
    entry, control = OUTER_LAWS.get(spec.outer), spec.scenario.control
    gains = control.active_gains.of(entry)
    law = RetunedLaw(entry, gains, lambda now: _bare_law(spec, entry, now))
    around = HoldAtGoal(law, control.limits) if _rests(entry) else law
    parts = make_parts(spec, rig, recorder, around)
    goal = SteppedReference(parts.reference, spec.scenario.safety)
    own = None if keep_gains else law
    orders = OperatorOrders(source, parts.link, parts.timeline, goal, own)
    return replace(parts, orders=orders, reference=goal)


def _limited(law: OuterLaw, vehicle: Vehicle, scenario: Scenario) -> OuterLaw:
    """Return the law in its axes, under what holds for every law."""
    limits = scenario.control.limits
    law = in_axes(law, scenario.control.axes_rad)
    law = WithinWheelSpeed(law, vehicle, wheel_speed_max_rad_s(scenario))
    law = TurnFirst(law, limits.turn_missing_rad_s)
    return LetGo(law, vehicle, limits.let_go_rad_s)


class _WhenAsked:
    """The localiser of a run whose frames bring their poses: made when an image comes after all."""

    def __init__(self, camera: CameraConfig) -> None:
        self._camera = camera
        self._made: Looker | None = None

    def locate(
        self, image_bgr: Picture, predicted: Pose | None, search_radius_m: float
    ) -> PoseMeasurement:
        """Return what the camera's localiser says."""
        self._made = self._made or looker(make_localiser(self._camera))
        return self._made.locate(image_bgr, predicted, search_radius_m)


def _localiser_of(spec: RunSpec) -> Looker:
    """Return the localiser of a run; where poses are drawn its projections need not be worked out."""
    if is_simulated(spec.target) and spec.camera == "pose":
        return _WhenAsked(spec.scenario.camera)
    return looker(make_localiser(spec.scenario.camera))


def make_manifest(spec: RunSpec) -> Manifest:
    """Return the manifest a record opens with."""
    law = OUTER_LAWS.get(spec.outer)
    gains = spec.scenario.control.active_gains.of(law)
    now_us = _unix_us()
    return Manifest(
        command=spec.command,
        scenario=spec.scenario.model_dump(mode="json"),
        seed=spec.seed,
        target=spec.target,
        camera=spec.camera,
        outer=law.name,
        inner=spec.inner,
        gains={
            "outer": gains.model_dump(mode="json") if gains is not None else {},
            "set": spec.scenario.control.gain_set,
            "board": board_parameters(spec.scenario, spec.inner),
        },
        plugins=plugins_of(spec),
        trace=trace_terms(law),
        figures=[FigureTerm.of(metric_of(name)) for name in spec.scenario.own_figures],
        open_loop_of=spec.target.removeprefix(REPLAY) if spec.target.startswith(REPLAY) else "",
        notes=notes(spec.scenario),
        versions=collect_versions(),
        git_revision=git_revision(),
        start_time_utc=datetime.fromtimestamp(now_us * 1e-6, UTC).isoformat(timespec="seconds"),
        start_unix_us=now_us,
    )


def trace_terms(law: Entry) -> list[TraceTerm]:
    """Return the columns that a law brings along, for a manifest; raises BadInput."""
    return [
        TraceTerm(name=column.name, unit=column.unit, meaning=column.meaning)
        for column in own_columns(law)
    ]


def _unix_us() -> int:
    return time.time_ns() // 1000


def link_stats(link: BoardLink) -> LinkStats:
    """Return the counters of the host's end of the link."""
    counters = link.counters
    return LinkStats(
        frames_sent=link.frames_sent,
        frames_received=counters.frames,
        frames_lost=counters.lost,
        bytes_rejected=counters.skipped_bytes,
    )
