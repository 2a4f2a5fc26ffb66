"""What decides a run, and what its record means for the exit status of a command."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING

from hil.core.errors import stop_status
from hil.rigs.opening import REPLAY, is_simulated

if TYPE_CHECKING:
    from hil.config.scenario import Scenario
    from hil.record.reader import RunRecord
    from hil.wire.signing import Key


@dataclass(frozen=True, slots=True)
class RunSpec:
    """Everything that decides a run; two runs of equal specs on a simulated target are equal.

    With a signing `key` the link is signed; nothing of it is recorded.
    """

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
    key: Key | None = None

    @property
    def is_simulated(self) -> bool:
        """Say whether its target waits for the host and repeats itself by its seed."""
        return is_simulated(self.target)


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
    return max(
        3 if r.manifest.outcome == "fault" and not r.manifest.is_cut_off else min(exit_status(r), 1)
        for r in records
    )
