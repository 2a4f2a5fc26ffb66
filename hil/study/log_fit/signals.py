"""What a fit takes of a log: commands, wheel speeds, voltages and poses, cleaned, each on its times."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from hil.board._firmware import PWM_TOP
from hil.core.errors import BadInput

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from hil.config.robot import RobotConfig
    from hil.record.log_series import LogSeries, Series

    Array = NDArray[np.float64]

# Median of seven and six times the usual deviation from it: Hampel's filter with its usual numbers.
_HAMPEL_HALF, _HAMPEL_LIMIT = 3, 6.0
# Deviations from the median below these are noise and curvature, never outliers.
_LEAST_JUMP_M, _LEAST_JUMP_RAD = 0.02, 0.1
_HOLE_PERIODS, _LEAST_HOLE_S = 10.0, 0.6
MOST_POSES = 20_000
# Beyond these a log is in another unit (mm, degrees) or of no small wheeled robot.
_MOST_SPEED_M_S, _MOST_TURN_RAD_S = 30.0, 60.0
_LONGEST_S = 4 * 3600.0


@dataclass(frozen=True, slots=True)
class Pair2:
    """Two channels on ascending times: forward and turn, or left and right."""

    t_s: Array
    first: Array
    second: Array


@dataclass(frozen=True, slots=True)
class Poses:
    """Poses seen, theta unwrapped; `theta_rad` is None where the log has positions only."""

    t_s: Array
    x_m: Array
    y_m: Array
    theta_rad: Array | None


@dataclass(frozen=True, slots=True)
class LogSignals:
    """Signals of a log, None for what it does not have; `holes` are spans without commands.

    Commands of the body in m/s and rad/s (counter-clockwise), wheel speeds in rad/s, voltages in V
    over the motors (duty times battery), poses in m and rad.
    """

    body_command: Pair2 | None
    wheel_command: Pair2 | None
    wheels: Pair2 | None
    voltage: Pair2 | None
    poses: Poses | None
    holes: tuple[tuple[float, float], ...]
    notes: tuple[str, ...]

    @property
    def duration_s(self) -> float:
        """Return the time from the first to the last value of anything."""
        ends = [part.t_s[-1] for part in self._parts()]
        return float(max(ends)) if ends else 0.0

    def has(self) -> list[str]:
        """Return what the log has, in words."""
        told = {
            "commands of the body": self.body_command,
            "commands of the wheels": self.wheel_command,
            "wheel speeds": self.wheels,
            "motor voltages": self.voltage,
        }
        found = [name for name, part in told.items() if part is not None]
        if self.poses is not None:
            found.append("poses" if self.poses.theta_rad is not None else "positions, no heading")
        return found

    def _parts(self) -> list[Pair2 | Poses]:
        parts = (self.body_command, self.wheel_command, self.wheels, self.voltage, self.poses)
        return [part for part in parts if part is not None]


def signals_of(log: LogSeries, robot: RobotConfig, where: str) -> LogSignals:
    """Return what a fit takes of a log; raises BadInput when it can tell nothing."""
    series, notes = dict(log.series), list(log.notes)
    body = _body_command(series, notes)
    wheel_command = _both(series, "omega_cmd_left_rad_s", "omega_cmd_right_rad_s", notes)
    wheels = _both(series, "omega_meas_left_rad_s", "omega_meas_right_rad_s", notes)
    if body is None and wheel_command is not None:
        body = body_of(wheel_command, robot)
        notes.append("commands of the body are those of the wheels by the robot's geometry")
    poses = _poses(series, notes)
    _check_units(body, poses, where)
    found = LogSignals(
        body, wheel_command, wheels, _voltage(series, robot, notes), poses,
        _holes(body or wheel_command, notes), (),
    )  # fmt: skip
    has = found.has()
    inputs = [part for part in (body, wheel_command, wheels, found.voltage) if part is not None]
    if not inputs or (poses is None and wheels is None):
        lacks = "neither poses nor wheel speeds" if inputs else "no command, wheel speed or voltage"
        raise BadInput(
            f"{where}: has {', '.join(has) or 'nothing a fit uses'}, but {lacks}: a fit compares "
            "what was asked (or what the wheels did) with what was seen; name the columns with --map"
        )
    if found.duration_s > _LONGEST_S:
        raise BadInput(
            f"{where}: lasts {found.duration_s:.0f} s, the limit is {_LONGEST_S:.0f} s; is time in "
            "another unit (t.scale in the mapping), or cut out a part"
        )
    return LogSignals(
        body, wheel_command, wheels, found.voltage, poses, found.holes, tuple(notes)
    )  # fmt: skip


def body_of(wheels: Pair2, robot: RobotConfig) -> Pair2:
    """Return forward speed and turn rate of wheel speeds by the robot's geometry."""
    radius, track = robot.wheel_radius_m, robot.track_m
    left, right = wheels.first, wheels.second
    return Pair2(wheels.t_s, 0.5 * radius * (right + left), radius * (right - left) / track)


def _body_command(series: Series, notes: list[str]) -> Pair2 | None:
    if "curvature_cmd_1_m" in series and "theta_dot_cmd_rad_s" not in series:
        if "eta1_cmd_m_s" not in series:
            notes.append("curvature without forward speed commanded: not used")
            return None
        pair = _joined(series["eta1_cmd_m_s"], series["curvature_cmd_1_m"])
        return Pair2(pair.t_s, pair.first, pair.first * pair.second)
    return _both(series, "eta1_cmd_m_s", "theta_dot_cmd_rad_s", notes, alone_is_zero=True)


def _both(
    series: Series, first: str, second: str, notes: list[str], *, alone_is_zero: bool = False
) -> Pair2 | None:
    """Return two signals on the times of both, each holding its latest value."""
    if first in series and second in series:
        return _joined(series[first], series[second])
    here = first if first in series else second
    if here not in series:
        return None
    other = second if here == first else first
    if not alone_is_zero:
        notes.append(f"{here} without {other}: not used")
        return None
    t_s, values = series[here]
    notes.append(f"no {other} in the log: taken as 0")
    zero = np.zeros_like(values)
    return Pair2(t_s, values, zero) if here == first else Pair2(t_s, zero, values)


def _joined(first: tuple[Array, Array], second: tuple[Array, Array]) -> Pair2:
    if np.array_equal(first[0], second[0]):
        return Pair2(first[0], first[1], second[1])
    t_s = np.union1d(first[0], second[0])
    return Pair2(t_s, held(*first, t_s), held(*second, t_s))


def held(t_s: Array, values: Array, at_s: Array) -> Array:
    """Return the latest value at each time; the first one before it."""
    return values[np.clip(np.searchsorted(t_s, at_s, side="right") - 1, 0, None)]


def _voltage(series: Series, robot: RobotConfig, notes: list[str]) -> Pair2 | None:
    direct = _both(series, "motor_left_v", "motor_right_v", notes)
    if direct is not None:
        return direct
    pwm = _both(series, "pwm_left_counts", "pwm_right_counts", notes)
    if pwm is None:
        return None
    battery = robot.battery
    if "battery_v" in series:
        supply = held(*series["battery_v"], pwm.t_s)
    else:
        open_v = battery.empty_v + (battery.full_v - battery.empty_v) * battery.charge_start_ratio
        notes.append(f"no battery voltage in the log: {open_v:.2f} V of the robot file taken")
        supply = np.full_like(pwm.t_s, open_v)
    return Pair2(pwm.t_s, pwm.first / PWM_TOP * supply, pwm.second / PWM_TOP * supply)


def _poses(series: Series, notes: list[str]) -> Poses | None:
    if "est_x_m" not in series or "est_y_m" not in series:
        return None
    x, y = series["est_x_m"], series["est_y_m"]
    t_s = np.intersect1d(x[0], y[0])
    xy = [pair[1][np.searchsorted(pair[0], t_s)] for pair in (x, y)]
    theta = None
    if "est_theta_rad" in series:
        at_s, angle = series["est_theta_rad"]
        theta = np.interp(t_s, at_s, np.unwrap(angle), left=math.nan, right=math.nan)
        near = np.abs(t_s - at_s[_nearest(at_s, t_s)])
        period_s = float(np.median(np.diff(at_s))) if at_s.size > 1 else 0.0
        theta[near > max(2.0 * period_s, 0.05)] = math.nan
        keep = np.isfinite(theta)
        t_s, xy, theta = t_s[keep], [part[keep] for part in xy], theta[keep]
    if t_s.size < 20:
        notes.append(f"{t_s.size} whole poses: too few to use")
        return None
    if t_s.size > MOST_POSES:
        stride = math.ceil(t_s.size / MOST_POSES)
        notes.append(f"{t_s.size} poses: every {stride}. one used")
        t_s, xy = t_s[::stride], [part[::stride] for part in xy]
        theta = theta[::stride] if theta is not None else None
    return _without_outliers(t_s, xy[0], xy[1], theta, notes)


def _nearest(t_s: Array, at_s: Array) -> NDArray[np.intp]:
    right = np.clip(np.searchsorted(t_s, at_s), 1, max(t_s.size - 1, 1))
    right = np.minimum(right, t_s.size - 1)
    left = np.maximum(right - 1, 0)
    return np.where(np.abs(t_s[left] - at_s) <= np.abs(t_s[right] - at_s), left, right)


def _without_outliers(
    t_s: Array, x_m: Array, y_m: Array, theta: Array | None, notes: list[str]
) -> Poses:
    out = _strays(x_m, _LEAST_JUMP_M) | _strays(y_m, _LEAST_JUMP_M)
    if theta is not None:
        out |= _strays(theta, _LEAST_JUMP_RAD)
    keep = ~out
    if out.any():
        notes.append(f"{np.count_nonzero(out)} of {t_s.size} poses jump and come back: left out")
    return Poses(t_s[keep], x_m[keep], y_m[keep], theta[keep] if theta is not None else None)


def _strays(values: Array, least: float) -> NDArray[np.bool_]:
    width = 2 * _HAMPEL_HALF + 1
    padded = np.pad(values, _HAMPEL_HALF, mode="edge")
    around = np.lib.stride_tricks.sliding_window_view(padded, width)
    middle = np.median(around, axis=1)
    off = np.abs(values - middle)
    usual = 1.4826 * float(np.median(off))
    steps = np.abs(np.diff(values, prepend=values[:1]))
    pace = np.median(
        np.lib.stride_tricks.sliding_window_view(np.pad(steps, _HAMPEL_HALF, mode="edge"), width),
        axis=1,
    )
    limit = np.maximum(np.maximum(_HAMPEL_LIMIT * usual, least), 2.0 * _HAMPEL_HALF * pace)
    return np.asarray(off > limit)


def _check_units(body: Pair2 | None, poses: Poses | None, where: str) -> None:
    """Raise BadInput for speeds that no small wheeled robot has: another unit."""
    if body is not None:
        worst_m_s, worst_rad_s = (float(np.abs(part).max()) for part in (body.first, body.second))
        if worst_m_s > _MOST_SPEED_M_S:
            raise BadInput(
                f"{where}: forward speed commanded up to {worst_m_s:.3g} m/s, the limit is "
                f"{_MOST_SPEED_M_S:g} m/s; in mm/s? then scale = 0.001 in the mapping"
            )
        if worst_rad_s > _MOST_TURN_RAD_S:
            raise BadInput(
                f"{where}: turn rate commanded up to {worst_rad_s:.3g} rad/s, the limit is "
                f"{_MOST_TURN_RAD_S:g} rad/s; in degrees? then scale = 0.0174533 in the mapping"
            )
    if poses is None or poses.t_s.size < 2:
        return
    dt_s = np.diff(poses.t_s)
    speed = float(np.median(np.hypot(np.diff(poses.x_m), np.diff(poses.y_m)) / dt_s))
    if speed > _MOST_SPEED_M_S:
        raise BadInput(
            f"{where}: the poses move at {speed:.3g} m/s as a rule, the limit is "
            f"{_MOST_SPEED_M_S:g} m/s; positions in mm (scale = 0.001) or time in ms (t.scale)?"
        )


def _holes(command: Pair2 | None, notes: list[str]) -> tuple[tuple[float, float], ...]:
    """Return the spans in which a regular stream of commands is missing.

    A log that writes commands only when they change has no regular stream, and no holes.
    """
    if command is None or command.t_s.size < 20:
        return ()
    gaps = np.diff(command.t_s)
    period_s = float(np.median(gaps))
    if np.quantile(gaps, 0.95) > 3.0 * period_s:
        return ()
    limit_s = max(_HOLE_PERIODS * period_s, _LEAST_HOLE_S)
    holes = [(float(a), float(b)) for a, b in itertools.pairwise(command.t_s) if b - a > limit_s]
    if holes:
        notes.append(
            f"{len(holes)} holes in the commands, {sum(b - a for a, b in holes):.3g} s together: what "
            "happens in them, and just after, is not used"
        )
    return tuple(holes)
