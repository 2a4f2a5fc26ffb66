"""The viewer's file written by a process of its own, which loads the viewer's code while the run goes on.

Loading that code takes a third of a short run's time, and nothing of the run depends on it: a fork of this
process does it on another core, waits for the finished tables, and writes `run.rrd` from them. Where that
process cannot be had, or has gone away, the file is written here as ever.

This module loads what both processes need, and a command enters it before it loads the rest.
"""

from __future__ import annotations

import os
import signal
import threading
import warnings
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn, Self

from hil.record import layout
from hil.record.reader import read_run

if TYPE_CHECKING:
    from types import TracebackType

    from hil.record.reader import RunRecord

_DONE = b"done"
_END = b"\0"  # of a folder's name, which may have any other byte; the colour of the run's law goes before it
_NAME_BYTES = 65_536
_ANSWER_BYTES = 4096


class ViewerFile:
    """Writes a run's `run.rrd`: in another process while this object is entered, else here.

    It is entered before anything that a fork cannot take along: threads, ports, cameras.
    """

    def __init__(self) -> None:
        self._pid = 0
        self._ask = self._answer = -1

    def __enter__(self) -> Self:
        """Begin the other process, where the system can and this one has a single thread."""
        if hasattr(os, "fork") and threading.active_count() == 1 and _cores() > 1:
            asked, self._ask = os.pipe()
            self._answer, told = os.pipe()
            with warnings.catch_warnings():  # threads of numpy's, which sleep
                warnings.simplefilter("ignore", DeprecationWarning)
                self._pid = os.fork()
            if self._pid == 0:
                os.close(self._ask)
                os.close(self._answer)
                _serve(asked, told)
            os.close(asked)
            os.close(told)
        return self

    def __exit__(
        self,
        _kind: type[BaseException] | None,
        _error: BaseException | None,
        _trace: TracebackType | None,
    ) -> None:
        """End the other process; it has nothing to do any more."""
        if self._pid:
            os.kill(self._pid, signal.SIGKILL)  # it may still be loading, for nobody
            os.waitpid(self._pid, 0)
            os.close(self._ask)
            os.close(self._answer)
            self._pid = 0

    def write(self, run: RunRecord) -> None:
        """Write the file of a run whose tables are finished; raises OSError."""
        said = self._asked(run) if self._pid else b""
        if said == _DONE:
            return
        number, _, text = said.partition(b" ")
        if number.isdigit():
            raise OSError(int(number), text.decode(errors="replace"))
        from hil.record.rrd import write_rrd  # noqa: PLC0415 - a third of a second, only when used

        write_rrd(run.path / layout.RERUN, [run])

    def _asked(self, run: RunRecord) -> bytes:
        """Return the other process's answer, b"" where it has gone away."""
        from hil.core.registries import law_colour  # noqa: PLC0415 - the other process does without the laws

        colour = law_colour(run.manifest.outer).encode()
        with suppress(BrokenPipeError):
            os.write(self._ask, colour + b" " + os.fsencode(run.path.absolute()) + _END)
            return os.read(self._answer, _ANSWER_BYTES)
        return b""


def _cores() -> int:
    """Return how many cores this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def _serve(asked: int, told: int) -> NoReturn:
    """Load the writer, write the files whose folders come, and end when nobody asks any more."""
    try:
        for name in ("SIGINT", "SIGTERM", "SIGHUP"):  # the record's end is its parent's affair
            signal.signal(getattr(signal, name), signal.SIG_IGN)
        from hil.record.rrd import write_rrd  # noqa: PLC0415 - what this process is for

        heard = b""
        while piece := os.read(asked, _NAME_BYTES):
            heard += piece
            if heard.endswith(_END):
                colour, _, folder = heard.removesuffix(_END).partition(b" ")
                done = _written(write_rrd, Path(os.fsdecode(folder)), colour.decode())
                os.write(told, done[:_ANSWER_BYTES])
                heard = b""
    except BaseException:
        pass
    os._exit(0)


def _written(write_rrd: Any, folder: Path, colour: str) -> bytes:
    try:
        write_rrd(folder / layout.RERUN, [read_run(folder)], lambda _law: colour)
    except OSError as error:
        return f"{error.errno or 5} {error.strerror or error}".encode()
    return _DONE
