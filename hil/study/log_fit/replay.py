"""A log replayed against a twin fitted before: its commands go in, what was seen judges."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hil.core.errors import BadInput
from hil.record.log_series import read_series
from hil.record.manifest import read_manifest
from hil.record.source import recorded_scenario
from hil.study.log_fit.fit import LEAST_WINDOWS, USUAL, fit_log, foretellers, windows_of
from hil.study.log_fit.judge import Score, scores
from hil.study.log_fit.model import Grid, Track, body_track, grid_over
from hil.study.log_fit.motion import mount_of
from hil.study.log_fit.page import Page, verdict
from hil.study.log_fit.signals import LogSignals, body_of, signals_of
from hil.study.log_fit.windows import Mount, Windows

if TYPE_CHECKING:
    from hil.config.robot import RobotConfig


@dataclass(frozen=True, slots=True)
class LogReplay:
    """A fitted twin on a log, window by window, beside plain odometry."""

    log: Path
    robot: RobotConfig
    fitted_to: str
    signals: LogSignals
    grid: Grid
    windows: Windows
    foretellers: dict[str, tuple[Track | None, Mount]]
    scores: dict[str, Score]

    def to_json(self) -> dict[str, Any]:
        """Return the answer for a JSON document."""
        return {
            "log": str(self.log),
            "robot": self.robot.name,
            "fitted_to": self.fitted_to,
            "windows": len(self.windows.held_out),
            "window_s": self.windows.length_s,
            "scores": {name: score.to_json() for name, score in self.scores.items()},
            "notes": list(self.signals.notes),
        }

    def text(self) -> str:
        """Return the answer for a person."""
        lines = [
            f"{self.log.name} on the twin fitted to {self.fitted_to}: {len(self.windows.held_out)} "
            f"windows of {self.windows.length_s:.2g} s; error of the position foretold, RMS (at the "
            "window's end):",
            *(f"  {name}: {score.text()}" for name, score in self.scores.items()),
        ]
        return "\n".join([*lines, *(f"note: {note}" for note in self.signals.notes)])

    def page(self) -> Page:
        """Return what the page shows."""
        return Page(
            f"{self.log.name} on a fitted twin", f"fitted to {self.fitted_to}", self.scores,
            self.signals.poses, self.windows, self.foretellers, self.grid,
            notes=(verdict(self.scores), *self.signals.notes),
        )  # fmt: skip


def replay_log(log: Path, mapping: Path | None, robot: RobotConfig) -> LogReplay:
    """Send a log's commands through the twin of a robot file that `hil fit` wrote; raises BadInput."""
    if robot.log_fit is None:
        raise BadInput(
            f"robot {robot.name!r}: has no fitted twin ([log_fit]); fit one with `hil fit LOG --robot "
            "FILE`"
        )
    unknown = sorted(set(robot.log_fit.twin) - set(USUAL))
    if unknown or not robot.log_fit.twin:
        what = f"unknown {', '.join(unknown)}" if unknown else "is empty: that log had no commands"
        raise BadInput(f"robot {robot.name!r}: log_fit.twin: {what}; fit again with `hil fit`")
    values = dict(USUAL) | robot.log_fit.twin
    signals = signals_of(read_series(log, mapping), robot, str(log))
    if signals.body_command is None or signals.poses is None:
        raise BadInput(
            f"{log}: has {', '.join(signals.has())}; a replay against a fitted twin needs commands "
            "and poses"
        )
    windows = windows_of(signals, [])
    if windows is None:
        raise BadInput(
            f"{log}: too short or too still to be replayed: {LEAST_WINDOWS} windows needed"
        )
    windows = Windows((), (*windows.fitted, *windows.held_out), windows.length_s)
    grid = grid_over(signals.duration_s)
    turned = body_of(signals.wheels, robot) if signals.wheels is not None else None
    twin = (body_track(signals.body_command, grid, values), mount_of(values))
    told = {"fitted twin": twin} | foretellers(signals, grid, None, None, turned)
    return LogReplay(
        log, robot, robot.log_fit.log, signals, grid, windows, told,
        scores(signals.poses, windows.held_out, told, grid),
    )  # fmt: skip


def is_imported(run: Path) -> bool:
    """Say whether a record was made of another program's log, and so holds no inputs to replay."""
    return read_manifest(run).target.startswith("import:")


def replay_imported(run: Path) -> tuple[LogReplay, dict[str, Any]]:
    """Fit a twin to an imported record and replay the part held out; raises BadInput.

    Returns the replay and the fit as a JSON tree.
    """
    robot = recorded_scenario(read_manifest(run), run).robot
    fit = fit_log(run, None, robot)
    if fit.body is None or fit.windows is None:
        raise BadInput(
            f"{run}: has {', '.join(fit.signals.has())}; a twin needs commands and poses while it moves"
        )
    answer = LogReplay(
        run, robot, f"the first {len(fit.windows.fitted)} windows of {run.name}", fit.signals,
        fit.grid, fit.windows, fit.foretellers, fit.scores,
    )  # fmt: skip
    return answer, fit.to_json()
