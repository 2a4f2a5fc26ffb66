"""Writes a run record while the run goes on; what was written survives a crash at any instant."""

from __future__ import annotations

import dataclasses
import json
import math
import shutil
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hil.analysis import metrics
from hil.core.errors import RecordFault
from hil.record import layout
from hil.record.beside import ViewerFile
from hil.record.camera import CameraKeeper
from hil.record.closing import finish, give_up
from hil.record.journal import Journal
from hil.record.manifest import Manifest, Outcome, keep_texts, write_manifest
from hil.record.schema import FRAME_NAMES
from hil.record.tape import TapeWriter
from hil.record.tlog import log_entry
from hil.record.writing import Keeping

if TYPE_CHECKING:
    from hil.core.rig import Picture
    from hil.record.reader import RunRecord

_FLUSH_PERIOD_S = 1.0
_PICTURE_PERIOD_S = 0.5


class Recorder:
    """One open run record.

    Times are host times in s since the start of the controlled part (negative before it). `append`
    takes one row of samples in the order of the manifest's sample_names and costs a few microseconds; rows,
    frames and events reach the system at least once per second of run time.

    Once something cannot be written RecordFault is raised, and whatever follows is dropped.
    """

    def __init__(
        self,
        out_dir: Path,
        manifest: Manifest,
        *,
        record_camera: bool = False,
        small_video: bool = False,
        frame_rate_hz: float = 30.0,
        rerun: bool = True,
        viewer: ViewerFile | None = None,
    ) -> None:
        self.path = out_dir
        self._manifest = manifest
        self._viewer = (viewer or ViewerFile()) if rerun else None
        self._keeping = keeping = Keeping.of_new_folder(out_dir)
        try:
            keep_texts(out_dir, manifest.plugins)
            write_manifest(out_dir, manifest)
            self._samples, self._frames = (
                Journal(keeping.open(name), columns)
                for name, columns in (
                    (layout.SAMPLES_JOURNAL, manifest.sample_names),
                    (layout.FRAMES_JOURNAL, FRAME_NAMES),
                )
            )
            self._link = keeping.open(layout.LINK)
            self._events = keeping.open(layout.EVENTS)
            self.tape = TapeWriter(keeping.open(layout.TAPE))
        except OSError as error:
            raise keeping.fail(error) from None
        self._camera: CameraKeeper | None = None
        kept = layout.CAMERA_SMALL if small_video else layout.CAMERA
        self._video = out_dir / kept if record_camera or small_video else None
        self._frame_rate_hz = frame_rate_hz
        self._start_unix_us = manifest.start_unix_us
        self._next_flush_s = -math.inf
        self._rows = 0
        self._write_row, self._write_link = self._samples.write, self._link.write

    def _put_manifest(self) -> None:
        if self._keeping.fault is not None:
            return
        try:
            write_manifest(self.path, self._manifest)
        except OSError as error:
            raise self._keeping.fail(error, self.path / layout.MANIFEST) from None

    def start(self, unix_us: int) -> None:
        """Take the wall time of t_s = 0, which dates every frame of link.tlog."""
        self._start_unix_us = unix_us
        self._manifest = self._manifest.model_copy(update={"start_unix_us": unix_us})
        self._put_manifest()

    def link_frame(self, t_s: float, frame: bytes) -> None:
        """Append one whole MAVLink frame, sent or received at `t_s`."""
        self._write_link(log_entry(self._start_unix_us + round(t_s * 1e6), frame))

    def append(self, row: Sequence[float]) -> None:
        """Append one outer tick, values in the order of the manifest's sample_names, NaN for unknown."""
        self._write_row(row)
        self._rows += 1
        if row[0] >= self._next_flush_s:
            self._next_flush_s = row[0] + _FLUSH_PERIOD_S
            self.flush()

    def frame(self, row: Sequence[float], image: Picture | None = None) -> None:
        """Append one camera frame, values in the order of schema.FRAME_NAMES, and its image.

        The image (H, W, 3) uint8 BGR must not be changed afterwards: it is encoded later.
        """
        self._frames.write(row)
        if image is not None and self._keeping.fault is None:
            if self._camera is None:
                try:
                    self._camera = self._open_camera()
                except OSError as error:
                    raise self._keeping.fail(error) from None
            self._camera.take(row[0], image)
            if self._camera.error and self._keeping.fault is None:
                raise self._keeping.fail(OSError(self._camera.error))

    def _open_camera(self) -> CameraKeeper:
        folder = self.path / layout.PICTURES
        return CameraKeeper(folder, _PICTURE_PERIOD_S, self._frame_rate_hz, self._video)

    def event(self, t_s: float, kind: str, text: str) -> None:
        """Append one line of what happened: arming, stop, fault, disturbance, board's text."""
        line = json.dumps({"t_s": t_s, "kind": kind, "text": text}, ensure_ascii=False)
        self._events.write(line.encode(errors="replace") + b"\n")

    def identify(self, dialect_hash: str, parameter_hash: str, firmware_build_id: str) -> None:
        """Put into the manifest who the board said it is."""
        self._manifest = self._manifest.model_copy(
            update={
                "dialect_hash": dialect_hash,
                "parameter_hash": parameter_hash,
                "firmware_build_id": firmware_build_id,
            }
        )
        self._put_manifest()

    def flush(self) -> None:
        """Hand everything so far to the system."""
        self._keeping.check(self.path / layout.MANIFEST)
        self._keeping.flush()

    def close(
        self, outcome: Outcome, detail: str = "", link: metrics.LinkStats | None = None
    ) -> RunRecord:
        """Finish the record: tables, pictures, figures, Rerun file, and the manifest last.

        Where that cannot be done, what is there is left readable, the outcome becomes a fault, and
        RecordFault is raised; so it is when something could not be written before.
        """
        ended = self._ended(outcome, detail, link or metrics.LinkStats())
        try:
            self._keeping.check(self.path / layout.MANIFEST)
            self._stop_writers()
            if self._keeping.fault is None:
                return finish(self._keeping, ended, self._viewer)
        except OSError as error:
            self._keeping.fail(error)
        except RecordFault:
            pass
        except Exception as error:
            with suppress(RecordFault):  # what is not found any more shows in many ways
                self._keeping.check(self.path / layout.MANIFEST)
            if self._keeping.fault is None:
                self._give_up("fault", f"the record could not be finished: {error}")
                raise
        except KeyboardInterrupt as stop:  # by a figure of one's own: signals wait for the end
            self._give_up("interrupted", str(stop) or "Ctrl-C")
            raise
        assert self._keeping.fault is not None
        before = (
            f"{detail}; "
            if outcome != "complete" and detail not in str(self._keeping.fault)
            else ""
        )
        self._give_up("fault", f"{before}{self._keeping.fault}")
        raise self._keeping.fault

    def discard(self) -> None:
        """Remove what was written: the folder was made, or found empty, for this record."""
        with suppress(OSError, RecordFault):
            self._stop_writers()
        shutil.rmtree(self.path, ignore_errors=True)

    def _ended(
        self, outcome: Outcome, detail: str, link: metrics.LinkStats | None = None
    ) -> Manifest:
        """Return the manifest with how the run ended."""
        ended: dict[str, Any] = {
            "outcome": outcome,
            "outcome_detail": detail,
            "tick_count": self._rows,
        }
        if link is not None:
            ended["link"] = {key: float(value) for key, value in dataclasses.asdict(link).items()}
        return self._manifest.model_copy(update=ended)

    def _stop_writers(self) -> None:
        self._keeping.close()
        if self._camera is not None:
            self._camera.close()

    def _give_up(self, outcome: Outcome, detail: str) -> None:
        with suppress(OSError, RecordFault):
            self._stop_writers()
        give_up(self._keeping, self._ended(outcome, detail))
