"""`hil fit`: everything a log tells of a robot, what it does not, and how well the twin foretells.

Layers, each fitted where the log has what it needs:

    body      commands of the body -> poses: the twin (scales, lags, dead time, dead zones, veer, mount)
    odometry  wheel speeds -> poses: wheel radius, track, delay of the poses
    wheels    wheel commands -> wheel speeds: scales, lag, dead time, dead zone
    motors    motor voltages -> wheel speeds: motor constants, friction, mass, inertia (the plant itself)
"""

from __future__ import annotations

import hashlib
import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hil.core.errors import BadInput
from hil.record.log_series import read_series
from hil.study.log_fit.advice import Advice, advise
from hil.study.log_fit.estimate import Estimate, Found
from hil.study.log_fit.judge import Score, scores
from hil.study.log_fit.model import Grid, Track, body_track, grid_over, odometry_track
from hil.study.log_fit.motion import MotionFit, fit_body, fit_odometry, odd_signs
from hil.study.log_fit.motors import fit_motors, motor_values
from hil.study.log_fit.page import Page
from hil.study.log_fit.signals import LogSignals, Pair2, body_of, held, signals_of
from hil.study.log_fit.wheels import fit_wheels
from hil.study.log_fit.windows import Mount, Windows, cut

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from hil.config.robot import RobotConfig

    Array = NDArray[np.float64]

# How long after a hole in the commands what it left behind is still felt.
_SETTLE_S = 1.5
LEAST_WINDOWS = 6
USUAL = {
    "distance_scale_ratio": 1.0, "turn_scale_ratio": 1.0, "veer_rad_m": 0.0, "forward_lag_s": 0.0,
    "turn_lag_s": 0.0, "dead_time_s": 0.0, "forward_dead_zone_m_s": 0.0, "turn_dead_zone_rad_s": 0.0,
    "pose_ahead_m": 0.0, "pose_left_m": 0.0, "heading_offset_rad": 0.0, "pose_delay_s": 0.0,
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class LogFit:
    """What a log told. `robot_values` are values of the robot file by dotted key."""

    log: Path
    sha256: str
    signals: LogSignals
    robot: RobotConfig
    grid: Grid
    windows: Windows | None
    body: MotionFit | None
    odometry: MotionFit | None
    wheels: Found | None
    motors: Found | None
    robot_values: tuple[Estimate, ...]
    scores: dict[str, Score]
    foretellers: dict[str, tuple[Track | None, Mount]]
    advice: tuple[Advice, ...]
    notes: tuple[str, ...]

    @property
    def layers(self) -> dict[str, Found]:
        """Return the layers that were fitted."""
        whole = {
            "body": self.body.found if self.body else None,
            "odometry": self.odometry.found if self.odometry else None,
            "wheels": self.wheels,
            "motors": self.motors,
        }
        return {name: found for name, found in whole.items() if found is not None}

    def to_json(self) -> dict[str, Any]:
        """Return everything for a JSON document."""
        return {
            "log": str(self.log),
            "sha256": self.sha256,
            "has": self.signals.has(),
            "duration_s": self.signals.duration_s,
            "windows_fitted": len(self.windows.fitted) if self.windows else 0,
            "windows_held_out": len(self.windows.held_out) if self.windows else 0,
            "window_s": self.windows.length_s if self.windows else None,
            "layers": {
                name: {item.name: item.to_json() for item in found.estimates}
                for name, found in self.layers.items()
            },
            "robot": {item.name: item.to_json() for item in self.robot_values},
            "held_out": {name: score.to_json() for name, score in self.scores.items()},
            "not_told": [
                {"what": list(item.tells), "manoeuvre": item.manoeuvre} for item in self.advice
            ],
            "notes": list(self.notes),
        }

    def text(self) -> str:
        """Return the answer for a person."""
        lines = [
            f"{self.log.name}: {', '.join(self.signals.has())}; {self.signals.duration_s:.1f} s"
        ]
        for name, found in self.layers.items():
            lines.append(f"{_LAYER_TITLES[name]} ({found.windows} windows fitted):")
            lines += [f"  {item.text()}" for item in found.estimates]
        if self.robot_values:
            lines.append("robot file, 95 % intervals:")
            lines += [f"  {item.text()}" for item in self.robot_values]
        if self.windows is not None and self.scores:
            lines.append(
                f"held out: {len(self.windows.held_out)} windows of {self.windows.length_s:.2g} s at "
                "the end of the log; error of the position foretold, RMS (at the window's end):"
            )
            lines += [f"  {name}: {score.text()}" for name, score in self.scores.items()]
        if self.advice:
            lines.append("not told by this log, and what would tell it:")
            lines += [f"  {item.text()}" for item in self.advice]
        lines += [f"note: {note}" for note in self.notes]
        return "\n".join(lines)

    def page(self) -> Page:
        """Return what the page shows."""
        layers = [
            (_LAYER_TITLES[name].capitalize(), f"{found.windows} windows fitted.", found.estimates)
            for name, found in self.layers.items()
        ]
        if self.robot_values:
            layers.insert(0, ("Robot file", "Values that the fit puts there.", self.robot_values))
        return Page(
            f"{self.log.name}: a twin from a log",
            f"{', '.join(self.signals.has())}; {self.signals.duration_s:.1f} s",
            self.scores, self.signals.poses, self.windows, self.foretellers, self.grid, layers,
            self.advice, self.notes,
        )  # fmt: skip


_LAYER_TITLES = {
    "body": "commands to motion",
    "odometry": "wheel speeds to motion",
    "wheels": "wheel commands to wheel speeds",
    "motors": "motor voltages to wheel speeds",
}


def fit_log(log: Path, mapping: Path | None, robot: RobotConfig) -> LogFit:
    """Fit everything that a log tells; raises BadInput when that is nothing."""
    signals = signals_of(read_series(log, mapping), robot, str(log))
    grid = grid_over(signals.duration_s)
    notes = list(signals.notes)
    windows = windows_of(signals, notes)
    body = odometry = None
    turned = body_of(signals.wheels, robot) if signals.wheels is not None else None
    if windows is not None and signals.poses is not None:
        if signals.body_command is not None:
            body = fit_body(signals.body_command, signals.poses, windows, grid)
            notes += odd_signs(body.found)
        if turned is not None:
            odometry = fit_odometry(turned, signals.poses, windows, grid)
            notes += [f"wheel speeds: {said}" for said in odd_signs(odometry.found)]
    wheels = motors = None
    if signals.wheels is not None and signals.wheel_command is not None:
        wheels = fit_wheels(signals.wheel_command, signals.wheels, grid, signals.holes)
    values, fitted = _geometry(odometry, robot)
    if signals.wheels is not None and signals.voltage is not None:
        motors = fit_motors(signals.voltage, signals.wheels, fitted, signals.holes)
    if body is None and odometry is None and wheels is None and motors is None:
        raise BadInput(
            f"{log}: has {', '.join(signals.has())} over {signals.duration_s:.1f} s, but the robot "
            f"moves in too few windows ({LEAST_WINDOWS} are needed): log some 30 s of driving"
        )
    if motors is not None:
        values += motor_values(motors, fitted)
    told = foretellers(signals, grid, body, odometry, turned)
    judged = (
        scores(signals.poses, windows.held_out, told, grid)
        if windows is not None and signals.poses is not None
        else {}
    )
    fit = LogFit(
        log, _sha256(log), signals, robot, grid, windows, body, odometry, wheels, motors,
        tuple(values), judged, told, (), tuple(dict.fromkeys(notes)),
    )  # fmt: skip
    named = [(layer, item) for layer, found in fit.layers.items() for item in found.estimates]
    advice = advise(named, _missing(signals, fit))
    return replace(fit, advice=tuple(advice))


def _missing(signals: LogSignals, fit: LogFit) -> list[str]:
    found = []
    if signals.poses is None:
        found.append("poses")
    if signals.wheels is None:
        found.append("wheel speeds")
    if fit.motors is None:
        found.append("voltages")
    if signals.body_command is None and signals.wheel_command is None:
        found.append("commands")
    return found


def windows_of(signals: LogSignals, notes: list[str]) -> Windows | None:
    """Return the windows of the poses, None where there are too few."""
    poses = signals.poses
    source = signals.body_command or signals.wheels
    if poses is None or source is None:
        return None
    asked = np.abs(held(source.t_s, source.first, poses.t_s)) > 1e-9
    asked |= np.abs(held(source.t_s, source.second, poses.t_s)) > 1e-9
    asked &= poses.t_s >= source.t_s[0]
    avoid = [(a, b + _SETTLE_S) for a, b in signals.holes]
    if float(source.t_s[0]) > float(poses.t_s[0]) + 0.5:
        avoid.append((-math.inf, float(source.t_s[0])))
    last_s = float(source.t_s[-1])
    gap_s = float(np.median(np.diff(source.t_s))) if source.t_s.size > 1 else 1.0
    if float(poses.t_s[-1]) > last_s + max(2.0, 10.0 * gap_s):
        avoid.append((last_s + max(2.0, 10.0 * gap_s), math.inf))
    windows = cut(poses, avoid, asked)
    count = len(windows.fitted) + len(windows.held_out)
    if count < LEAST_WINDOWS:
        notes.append(
            f"{count} windows of {windows.length_s:.2g} s with motion and poses, {LEAST_WINDOWS} are "
            "needed to fit motion"
        )
        return None
    return windows


def foretellers(
    signals: LogSignals,
    grid: Grid,
    body: MotionFit | None,
    odometry: MotionFit | None,
    turned: Pair2 | None,
) -> dict[str, tuple[Track | None, Mount]]:
    """Return who foretells motion: the fitted twin first, standing still last."""
    found: dict[str, tuple[Track | None, Mount]] = {}
    if body is not None:
        found["fitted twin"] = (body.track, body.mount)
    if odometry is not None:
        found["fitted odometry"] = (odometry.track, odometry.mount)
    if turned is not None:
        found["plain odometry"] = (odometry_track(turned, grid, dict(USUAL)), Mount())
    if signals.body_command is not None:
        name = "commands taken at their word" if turned is not None else "plain odometry (commands)"
        found[name] = (body_track(signals.body_command, grid, dict(USUAL)), Mount())
    found["standing still"] = (None, Mount())
    return found


def _geometry(odometry: MotionFit | None, robot: RobotConfig) -> tuple[list[Estimate], RobotConfig]:
    """Return wheel radius and track as far as they are told, and the robot with them."""
    found: list[Estimate] = []
    fitted = robot
    if odometry is not None:
        geometry = {item.name: item for item in odometry.found.estimates}
        way, turn = geometry["distance_scale_ratio"], geometry["turn_scale_ratio"]
        if way.told and way.low > 0.0:
            radius = robot.wheel_radius_m
            found.append(Estimate("wheel_radius_m", "m", "way driven per turn of the wheels",
                                  radius * way.value, radius * way.low, radius * way.high,
                                  told=True))  # fmt: skip
            fitted = fitted.model_copy(update={"wheel_radius_m": radius * way.value})
        if way.told and turn.told and way.low > 0.0 and turn.low > 0.0:
            track = robot.track_m * way.value / turn.value
            share = math.hypot(
                (way.high - way.low) / way.value, (turn.high - turn.low) / turn.value
            )
            half = 0.5 * track * share
            found.append(Estimate("track_m", "m", "effective: of turns made, with what wheels scrub",
                                  track, track - half, track + half, told=True))  # fmt: skip
            fitted = fitted.model_copy(update={"track_m": track})
    return found, fitted


def twin_values(fit: LogFit) -> dict[str, float]:
    """Return every parameter of the fitted twin, usual values where the log does not tell."""
    if fit.body is None:
        return {}
    return {name: fit.body.found.values.get(name, usual) for name, usual in USUAL.items()
            if name != "pose_delay_s"}  # fmt: skip


def _sha256(log: Path) -> str:
    file = log / "samples.parquet" if log.is_dir() else log
    return hashlib.sha256(file.read_bytes()).hexdigest() if file.is_file() else ""
