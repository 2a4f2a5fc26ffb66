"""The controlled part of a run in native code, where every part of it has a native form.

The ticks are native/drive.hpp; it comes back for what only Python knows: procedures, texts of the board,
what ends a run, and the step of a law that is not translated. Where something is looked at or changed on the
way (a caller that steps, a watcher, an operator, a reference of somebody's own), the session goes tick by
tick instead: the same run.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from hil.control import _outer
from hil.control.estimators.geometry import BelievedGeometry
from hil.control.translated import native_forms
from hil.record.memory import MemoryRecorder
from hil.record.schema import TRACE_KEYS
from hil.runs import _native
from hil.runs.parts import NoOrders

if TYPE_CHECKING:
    from collections.abc import Callable

    from hil.runs.intake import Intake
    from hil.runs.parts import Parts


def make_drive(
    parts: Parts,
    pump: _native.Pump,
    watch: _native.Watch,
    t0_s: float,
    period_s: float,
    ticks: int,
) -> _native.Drive | None:
    """Return what runs the ticks natively; None where a part has no native form."""
    geometry = parts.vehicle.geometry
    if type(parts.orders) is not NoOrders:
        return None
    if type(geometry) is not BelievedGeometry:
        return None
    forms = native_forms(parts.law, parts.reference, parts.own_terms)
    if forms is None:
        return None
    law, reference = forms
    known = (*_outer.TRACE_KEYS, *parts.own_terms)
    places = {key: place for place, key in enumerate(known)}
    return _native.Drive(
        pump=pump,
        watch=watch,
        law=law,
        reference=reference,
        geometry=geometry,
        t0_s=t0_s,
        period_s=period_s,
        ticks=ticks,
        common=[places.get(str(key), -1) for key in TRACE_KEYS],
        own=[places.get(key, -1) for key in parts.own_terms],
    )


def drive_to_end(
    drive: _native.Drive,
    parts: Parts,
    pump: _native.Pump,
    intake: Intake,
    board: Callable[[], tuple[int, float, float]],
    check_safety: Callable[[float], None],
) -> None:
    """Run all ticks; raises as `check_safety` (asked at the host's time) and everybody on the way do."""
    link, recorder = parts.link, parts.recorder
    assert isinstance(recorder, MemoryRecorder)  # else there is no pump
    stop = -1
    try:
        while stop != _native.DONE:
            stop = drive.run(link.busy, bool(intake.refusal), board())
            if stop == _native.DRIVE_HEARD:
                intake.hear(pump)
            elif stop == _native.DRIVE_TAKEN:
                intake.note_texts()
            elif stop == _native.ASKED:
                check_safety(parts.rig.now_s())
            recorder.rows.take(drive.take_rows())
    finally:
        recorder.rows.take(drive.take_rows())
        link.t_s = max(link.t_s, drive.reached_s)
