"""Jobs that kill their worker; a module of its own, quick to import in a new process."""

from __future__ import annotations

import gc
import os
import signal
from collections.abc import Sequence
from pathlib import Path


class DiesOnce:
    """Kills its own process on job 3 unless a marker says that it did so before."""

    def __init__(self, marker: Path) -> None:
        self._marker = marker

    def __call__(self, job: int) -> int:
        if job == 3 and not self._marker.exists():
            self._marker.touch()
            os.kill(os.getpid(), signal.SIGKILL)
        return job * job


def always_dies(job: int) -> int:
    """Kill the process."""
    os.kill(os.getpid(), signal.SIGKILL)
    return job


def dies_on_three(job: int) -> int:
    """Kill the process on job 3 each time."""
    if job == 3:
        os.kill(os.getpid(), signal.SIGKILL)
    return job * job


class Counts:
    """Returns each job with how many were done side by side."""

    def __call__(self, job: int) -> tuple[int, int]:
        """Return it alone."""
        return self.many([job])[0]

    def many(self, jobs: Sequence[int]) -> list[tuple[int, int]]:
        """Return them."""
        return [(job, len(jobs)) for job in jobs]


def ctrl_c(_job: int) -> tuple[bool, bool]:
    """Return whether Ctrl-C is held back from this process, and whether it is ignored here."""
    held = signal.SIGINT in signal.pthread_sigmask(signal.SIG_BLOCK, ())
    return held, signal.getsignal(signal.SIGINT) is signal.SIG_IGN


def looked_through(_job: int) -> tuple[int, bool]:
    """Return the process, and whether what it held was put aside from the search for cycles."""
    return os.getpid(), gc.get_freeze_count() > 0
