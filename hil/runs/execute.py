"""From a scenario to a finished run record: builds the parts, runs the session, closes the record."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from hil.config.fit import board_parameters, check_fit
from hil.control.laws.making import law_and_gains, make_law, own_law
from hil.core.registry import in_one_line
from hil.record.memory import MemoryRecorder
from hil.record.recorder import Recorder
from hil.record.tape import TapedRig
from hil.rigs.opening import open_rig
from hil.runs.assembly import make_parts
from hil.runs.interruption import CtrlC
from hil.runs.orders import ordered, with_orders
from hil.runs.outside import fault_of
from hil.runs.parts import Ending, Progress, Publish, closed
from hil.runs.provenance import Used, make_manifest, used_things
from hil.runs.session import Session
from hil.runs.spec import RunSpec, camera_for, exit_status, judged_status, new_folder
from hil.runs.watched import WatchedSink
from hil.wire.identity import board_hashes

if TYPE_CHECKING:
    from hil.core.rig import Rig
    from hil.core.types import OuterLaw
    from hil.record.beside import ViewerFile
    from hil.record.manifest import Manifest
    from hil.record.reader import RunRecord
    from hil.runs.orders import OrderSource
    from hil.runs.parts import Parts
    from hil.runs.watched import Watch

# What most callers need beside it stands in hil.runs.spec.
__all__ = [
    "Checked", "InMemory", "RunSpec", "camera_for", "checked", "execute", "execute_in_memory",
    "exit_status", "judged_status", "new_folder",
]  # fmt: skip


class Checked(NamedTuple):
    """What follows from a spec that can be run: the board's parameters, what takes part, what is recorded."""

    parameters: dict[str, float]
    used: Used
    manifest: Manifest


def checked(spec: RunSpec) -> Checked:
    """Return what follows from a spec; raises BadInput where its values cannot work together."""
    parameters = board_parameters(spec.scenario, spec.inner)
    check_fit(spec.scenario)
    used = used_things(spec)
    return Checked(parameters, used, make_manifest(spec, parameters, used))


def execute(
    spec: RunSpec,
    progress: Progress | None = None,
    rig: Rig | None = None,
    publish: Publish | None = None,
    watch: Watch | None = None,
    orders: OrderSource | None = None,
    viewer: ViewerFile | None = None,
) -> RunRecord:
    """Run the spec and return its closed record; raises BadInput before anything is written.

    A record that cannot be written raises RecordFault, a signal that comes while it is closed Stopped
    (the record is whole then), and an error of the harness itself is raised once robot and record
    are left in good order.

    `rig` is another one than the spec's target names; it is closed here. `publish` is given the
    estimate of every tick, `watch` everything that the record is given, after it; `orders` are an operator's.
    `viewer` writes the viewer's file, beside the run where it has been entered.
    """
    _one_thread(spec)
    parameters, used, manifest = checked(spec)
    law, live = law_and_gains(spec.outer, spec.scenario, live=orders is not None)
    rig = rig or open_rig(spec.target, spec.scenario, spec.camera, spec.seed, spec.key)
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
                viewer=viewer,
            )
            taped = TapedRig(rig, recorder.tape, ctrl_c.obey)
            sink = recorder if watch is None else WatchedSink(recorder, watch)
            parts: Parts | None = None
            error: Exception | SystemExit | None = None
            try:
                parts = make_parts(spec, taped, sink, law)
                if orders is not None:
                    noted = with_orders(orders, recorder.tape.order)
                    parts = ordered(parts, noted, spec.scenario.safety, live)
                if watch is not None:
                    watch.began(parts)
                session = Session(
                    spec.scenario, parts, parameters, board_hashes, progress, publish
                )  # fmt: skip
                ending, error = _conducted(session, ctrl_c, used)
            except KeyboardInterrupt as stop:  # pressed again, while the robot was being stopped
                ending = Ending("interrupted", str(stop) or "Ctrl-C")
            except Exception as failed:
                ending, error = (
                    Ending("fault", in_one_line(failed)),
                    fault_of(failed, used) or failed,
                )
            ctrl_c.close()  # from now on signals wait for the record
            record = closed(recorder, ending, parts.link if parts is not None else None)
        if error is not None:
            raise error from None
        ctrl_c.obey()  # pressed after the last wait: this run is whole, whatever follows is not begun
        return record
    finally:
        rig.close()


def _one_thread(spec: RunSpec) -> None:
    """Have OpenCV search in one thread: windows are small, and handing them to threads costs more."""
    if spec.is_simulated and spec.camera == "pose":
        return
    import cv2  # noqa: PLC0415 - a tenth of a second, where there are pictures only

    cv2.setNumThreads(1)


def _conducted(
    session: Session, ctrl_c: CtrlC, used: Used
) -> tuple[Ending, Exception | SystemExit | None]:
    """Run the session to its end; return that, and an error of the harness itself that ended it."""
    try:
        ending = session.run()
    except KeyboardInterrupt:
        ctrl_c.close()  # nothing comes between the robot and its stop
        session.halt()
        raise
    if session.error is None:
        return ending, None
    fault = fault_of(session.error, used)
    return (Ending("fault", str(fault)), None) if fault is not None else (ending, session.error)


class InMemory:
    """A run to be made without a record, in its parts: everything that is opened is closed with it.

    `rig` is another one than the spec's target names; it is closed here. `law` is another one than a
    new one of the spec. Raises BadInput, and RigFault where the target cannot be had.
    """

    def __init__(self, spec: RunSpec, rig: Rig | None = None, law: OuterLaw | None = None) -> None:
        parameters, self._used, manifest = checked(spec)
        law = law or make_law(spec.outer, spec.scenario)
        self.own_law = own_law(law)
        self._rig = rig or open_rig(spec.target, spec.scenario, spec.camera, spec.seed, spec.key)
        try:
            self._recorder = MemoryRecorder(manifest)
            self._parts = make_parts(spec, self._rig, self._recorder, law)
            self.session = Session(spec.scenario, self._parts, parameters, board_hashes)
        except BaseException:
            self._rig.close()
            raise

    def record(self) -> RunRecord:
        """Return what a record would hold once the session has ended; raises what ended it otherwise."""
        if self.session.error is not None:
            raise fault_of(self.session.error, self._used) or self.session.error
        return closed(self._recorder, self.session.ending, self._parts.link)

    def close(self) -> None:
        """Close the rig."""
        self._rig.close()


def execute_in_memory(
    spec: RunSpec, rig: Rig | None = None, law: OuterLaw | None = None
) -> RunRecord:
    """Run the spec and return what a record would hold, without writing one (spec.out is unused).

    `rig` and `law` are those of `InMemory`.
    """
    run = InMemory(spec, rig, law)
    try:
        run.session.run()
        return run.record()
    finally:
        run.close()
