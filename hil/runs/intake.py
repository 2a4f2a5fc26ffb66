"""What arrives at the host: bytes and frames taken as they come, and handed to estimator and judges."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from hil.core.types import PoseMeasurement
from hil.record.memory import MemoryRecorder
from hil.runs import _native
from hil.runs.watching import picture_of
from hil.wire.refusal import refused_set_point
from vision.rolling import unrolled

if TYPE_CHECKING:
    from hil.config.camera import CameraConfig
    from hil.core.rig import Frame
    from hil.runs.parts import Parts
    from hil.runs.watching import Note


class Intake:
    """Takes what arrives until a time; `refusal` is why the board refused a set-point, "" mostly.

    A `pump` does it in native code where nobody needs Python objects of it (native/pump.hpp).
    """

    def __init__(
        self,
        camera: CameraConfig,
        parts: Parts,
        watch: _native.Watch,
        note: Note,
        pump: _native.Pump | None,
    ) -> None:
        self._camera = camera
        self._parts = parts
        self._watch = watch
        self._note = note
        self._pump = pump
        self.refusal = ""
        self._texts_noted = 0
        self._camera_restarts = 0

    def until(self, until_s: float) -> None:
        """Take bytes and frames as they arrive until `until_s`; wait at least once, if for no time.

        Ctrl-C is obeyed in waits (`hil.runs.interruption`): a host that is always late must come to one too.
        """
        if self._pump is not None:
            self._go_on(self._pump, self._pump.begin(until_s, self._parts.link.busy))
            return
        rig = self._parts.rig
        waited = False
        while True:
            now_s = rig.now_s()
            self._watch.check_clock(now_s)
            self._take_all(now_s)
            if now_s >= until_s:
                break
            rig.wait(until_s)
            waited = True
        if not waited:
            rig.wait(now_s)

    def periods(self, period_s: float, last_s: float) -> None:
        """Do so for a period or more, until `last_s` at most, while a procedure is under way."""
        if self._pump is not None:
            self._go_on(self._pump, self._pump.begin_periods(period_s, last_s))
            return
        self.until(min(last_s, self._parts.rig.now_s() + period_s))

    def _go_on(self, pump: _native.Pump, stop: int) -> None:
        """Go on to the end in native code, which asks for what it does not know: procedures, texts."""
        link = self._parts.link
        while stop != _native.REACHED:
            if stop == _native.HEARD:
                self.hear(pump)
            else:
                self.note_texts()
            stop = pump.go_on(link.busy)
        link.t_s = pump.now_s

    def hear(self, pump: _native.Pump) -> None:
        """Take the messages that native code does not know, and move the procedure under way on."""
        link = self._parts.link
        link.t_s = pump.now_s
        for msg_id, frame in pump.others():
            link.heard(msg_id, frame)
        link.step()

    def _take_all(self, now_s: float) -> None:
        link = self._parts.link
        for report in link.poll(now_s):
            self._watch.take_report(report)
            self._parts.estimator.on_wheels(report.sample)
        poll_frame = self._parts.rig.poll_frame
        while (frame := poll_frame()) is not None:
            self._take_frame(frame, now_s)
        self.note_texts()

    def note_texts(self) -> None:
        """Record what the board has said since the last call."""
        link = self._parts.link
        new = link.texts_heard - self._texts_noted
        if not new:
            return
        self._texts_noted = link.texts_heard
        for text in list(link.texts)[-new:]:
            self._note("board", text.text)
            self.refusal = self.refusal or refused_set_point(text)

    def _take_frame(self, frame: Frame, now_s: float) -> None:
        """Localise one frame and hand the pose to the estimator at its exposure time.

        A frame whose stamp the camera's clock refuses is recorded and not looked at.
        """
        parts, clock = self._parts, self._parts.camera_clock
        if frame.note:
            self._note("camera", frame.note)
        stamped = clock.arrival(frame.t_cam_s, now_s)
        exposure_s = clock.to_host_s(frame.t_cam_s)
        if clock.restarts != self._camera_restarts:
            self._camera_restarts = clock.restarts
            self._note("camera", f"its clock has stepped by {clock.step_s:+.3f} s; tied anew")
        if not stamped:
            measurement = PoseMeasurement(None, 0.0, _native.odd_stamp(exposure_s - now_s))
        else:
            exposure_s = min(exposure_s, now_s)  # jitter aside, no frame is exposed after it came
            measurement = self._measured(frame, exposure_s)
            self._watch.camera_latency_s = now_s - exposure_s
        seen, estimator = measurement.pose is not None, parts.estimator
        believed = seen and estimator.on_pose(exposure_s, measurement)
        self._watch.take_frame(
            exposure_s=exposure_s,
            pose=measurement.pose,
            quality=measurement.quality,
            reason=measurement.reason,
            picture=picture_of(frame),
            believed=believed,
            agreement_age_s=estimator.agreement_age_s(exposure_s) if seen else math.inf,
        )
        parts.timeline.camera_frame(frame, now_s, exposure_s, measurement)

    def _measured(self, frame: Frame, exposure_s: float) -> PoseMeasurement:
        """Return the frame's own pose, else what the localiser finds near the estimate."""
        if frame.pose is not None:
            return frame.pose
        assert frame.picture is not None
        before = self._parts.estimator.estimate_at(exposure_s)
        camera = self._camera
        predicted = before.pose if before is not None else None
        seen = self._parts.localiser.locate(frame.picture, predicted, camera.search_radius_m)
        return unrolled(seen, camera, before)

    def hand_over_frames(self) -> None:
        """Record the frames that native code has taken."""
        origin_s = self._parts.timeline.origin_s
        if self._pump is not None and origin_s is not None:
            recorder = self._parts.recorder
            assert isinstance(recorder, MemoryRecorder)  # else there is no pump
            recorder.frames.take(self._pump.frame_rows(origin_s))
