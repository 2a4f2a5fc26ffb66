"""From a scenario to a finished run record: builds the parts, runs the session, closes the record."""

from __future__ import annotations

from typing import TYPE_CHECKING

import cv2

from hil.analysis.metrics import LinkStats
from hil.config.fit import board_parameters, check_fit
from hil.core.registry import in_one_line
from hil.record.memory import MemoryRecorder
from hil.record.recorder import Recorder
from hil.record.tape import TapedRig
from hil.rigs.opening import open_rig
from hil.runs.assembly import make_ordered_parts, make_parts
from hil.runs.interruption import CtrlC
from hil.runs.law_guard import make_law
from hil.runs.orders import with_orders
from hil.runs.outside import fault_of
from hil.runs.parts import Ending, Progress, Publish
from hil.runs.provenance import Used, make_manifest, used_things
from hil.runs.session import Session
from hil.runs.spec import RunSpec, camera_for, exit_status, judged_status, new_folder
from hil.runs.watched import WatchedSink
from hil.wire.identity import board_hashes

if TYPE_CHECKING:
    from hil.core.rig import Rig
    from hil.core.types import OuterLaw
    from hil.record.reader import RunRecord
    from hil.runs.orders import OrderSource
    from hil.runs.watched import Watch
    from hil.wire.link import BoardLink

# What most callers need beside it stands in hil.runs.spec.
__all__ = [
    "RunSpec", "camera_for", "execute", "execute_in_memory", "exit_status", "judged_status",
    "link_stats", "new_folder",
]  # fmt: skip


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
    law = make_law(spec.outer, spec.scenario)
    rig = rig or open_rig(spec.target, spec.scenario, spec.camera, spec.seed, spec.key)
    used = used_things(spec)
    manifest = make_manifest(spec, parameters, used)
    ctrl_c = CtrlC()
    try:
        with ctrl_c:
            recorder = Recorder(
                spec.out,
                manifest,
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
                raise fault_of(error, used) or error from None
            ending = _conduct(session, ctrl_c, used)
            record = recorder.close(ending.outcome, ending.detail, link_stats(parts.link))
        if session.error is not None and fault_of(session.error, used) is None:
            raise session.error
        ctrl_c.obey()  # pressed after the last wait: this run is whole, whatever follows is not begun
        return record
    finally:
        rig.close()


def _conduct(session: Session, ctrl_c: CtrlC, used: Used) -> Ending:
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
    law = law or make_law(spec.outer, spec.scenario)
    rig = rig or open_rig(spec.target, spec.scenario, spec.camera, spec.seed, spec.key)
    used = used_things(spec)
    try:
        recorder = MemoryRecorder(make_manifest(spec, parameters, used))
        parts = make_parts(spec, rig, recorder, law)
        session = Session(spec.scenario, parts, parameters, board_hashes)
        ending = session.run()
        if session.error is not None:
            raise fault_of(session.error, used) or session.error
        return recorder.close(ending.outcome, ending.detail, link_stats(parts.link))
    finally:
        rig.close()


def link_stats(link: BoardLink) -> LinkStats:
    """Return the counters of the host's end of the link."""
    counters = link.counters
    return LinkStats(
        frames_sent=link.frames_sent,
        frames_received=counters.frames,
        frames_lost=counters.lost,
        bytes_rejected=counters.skipped_bytes,
    )
