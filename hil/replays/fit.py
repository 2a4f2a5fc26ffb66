"""A twin fitted to one record: parameters by least squares, judged on parts held out.

The twin gets the recorded set-points at the instants at which the recorded board had them. Its
parameters (true over believed, as in a scenario's `mismatch`) are fitted so that wheel speeds, PWM
and the motion seen by the camera agree in every other second; the seconds between are held out and
give the residual that any claim made with the fitted twin has to be read with.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from random import Random
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from scipy.optimize import least_squares
from scipy.stats import t as student

from hil.board._firmware import PWM_TOP
from hil.config.fit import board_parameters
from hil.config.mismatch import true_robot
from hil.core.errors import BadInput
from hil.core.types import wrap_pi
from hil.replays.firmware import Trace, decoded, read_reports, sent_frames
from hil.wire import dialect
from hil.wire.framing import FrameWriter
from hil.wire.identity import board_hashes
from hil.wire.messages import arming_message, is_arming, set_parameter_message

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from hil.config.scenario import Scenario
    from hil.record.source import Source

    Array = NDArray[np.float64]

# What is fitted: groups of values that a record of this kind cannot tell apart go together.
GROUPS: dict[str, tuple[str, ...]] = {
    "wheel radius": ("wheel_radius_m",),
    "track": ("track_m",),
    "motor constants": ("motor.emf_constant_v_s_rad", "motor.torque_constant_n_m_a"),
    "motor friction": ("motor.coulomb_n_m", "motor.stiction_n_m", "motor.viscous_n_m_s_rad"),
    "floor friction": ("floor.friction_ratio",),
}
_BOUNDS = (0.6, 1.6)
# A ratio that is known no better than this, or only as beyond the bounds, is not told by the record.
_KNOWN = 0.1
_MOST_EVALUATIONS = 15
# Quantised counts make the residual rough on a small scale: differences are taken over 2 %.
_STEP = 0.02
_SPAN, _SPAN_TIE_S = 0.06, 0.01  # and over twice these for the intervals
# Size of a usual disagreement of each kind, which makes the residual a pure number.
_SCALES = {"wheel speed": 0.3, "pwm": 15.0, "forward": 0.004, "turn": 0.02}
_COLUMNS = {"wheel speed": 2, "pwm": 2, "forward": 1, "turn": 1}
UNITS = {"wheel speed": "rad/s", "pwm": "counts", "forward": "m", "turn": "rad"}
_WINDOW_S = 0.5
_BLOCK_S = 1.0
_LEAST_WINDOWS = 6
_MOVING_RAD_S = 0.5
_START_US = 2_000_000
_PACE_US = 10_000
_LEAD_US = 200_000  # a frame before the first window, to date its beginning
_CLOCK_TIE_BOUND_S = 0.1


class Windows(NamedTuple):
    """What happened in each window: columns as _SCALES, both wheels in the first two."""

    values: dict[str, Array]


@dataclass(frozen=True, slots=True)
class Fit:
    """Ratios true/believed with 95 % intervals, and the RMS residuals that go with them."""

    ratios: dict[str, tuple[float, float, float]]
    camera_tie_s: float
    windows_fitted: int
    windows_held_out: int
    residual_fitted: dict[str, float]
    residual_held_out: dict[str, float]
    residual_unfitted: dict[str, float]
    converged: bool = True

    @property
    def notes(self) -> tuple[str, ...]:
        """Return what limits the ratios: the edge of the box that was searched, its budget."""
        margin = 0.01 * (_BOUNDS[1] - _BOUNDS[0])
        found = [
            f"{group} = {value:.3f} lies at the edge of what is searched "
            f"({_BOUNDS[0]:g} to {_BOUNDS[1]:g}): the true ratio may be beyond"
            for group, (value, _, _) in self.ratios.items()
            if not _BOUNDS[0] + margin < value < _BOUNDS[1] - margin
        ]
        if not self.converged:
            found.append(
                f"the search ended by its budget of {_MOST_EVALUATIONS} evaluations, not by itself"
            )
        return tuple(found)

    @property
    def mismatch(self) -> dict[str, float]:
        """Return the ratios by dotted robot key, as a scenario takes them."""
        return {key: self.ratios[group][0] for group, keys in GROUPS.items() for key in keys}

    def identifiable(self, group: str) -> bool:
        """Say whether the record tells a group's ratio: to 10 %, and within what was searched."""
        _, low, high = self.ratios[group]
        return 0.5 * (high - low) <= _KNOWN and _BOUNDS[0] < low and high < _BOUNDS[1]

    def to_json(self) -> dict[str, Any]:
        """Return the fit for a JSON document."""
        return {
            "ratios": {
                group: {
                    "value": value,
                    "interval_95": [low, high],
                    "identifiable": self.identifiable(group),
                    "keys": list(GROUPS[group]),
                }
                for group, (value, low, high) in self.ratios.items()
            },
            "searched": list(_BOUNDS),
            "converged": self.converged,
            "notes": list(self.notes),
            "camera_tie_s": self.camera_tie_s,
            "windows_fitted": self.windows_fitted,
            "windows_held_out": self.windows_held_out,
            "residual_rms": {
                name: {
                    "unit": unit,
                    "fitted_parts": self.residual_fitted[name],
                    "held_out_parts": self.residual_held_out[name],
                    "held_out_parts_unfitted_twin": self.residual_unfitted[name],
                }
                for name, unit in UNITS.items()
            },
        }


class Rehearsal:
    """Runs the twin on a record's set-points and cuts record and twin into the same windows."""

    def __init__(self, source: Source, scenario: Scenario) -> None:
        self.path = source.path
        self._scenario = scenario
        self._parameters = board_parameters(scenario, source.manifest.inner)
        trace, arrivals = read_reports(source)
        if not trace.armed.any():
            raise BadInput(f"{source.path}: no wheel report while armed, nothing to fit to")
        self._trace = trace
        self._sent = [item for item in sent_frames(source, arrivals) if _drives(item.frame)]
        self._shift_us = int(trace.t_us[np.argmax(trace.armed)]) - _START_US
        self._frames = _seen(source)
        # A first tie of host to board time: the report that came soonest after its tick.
        self._host_to_board_us = _tie_us(source, trace)
        self.edges_us = self._window_edges()

    def _window_edges(self) -> NDArray[np.int64]:
        """Return the borders of the windows, from the arming until the wheels rest for good."""
        armed = self._trace.t_us[self._trace.armed]
        counts = self._trace.counts[self._trace.armed]
        moved = np.flatnonzero(np.abs(np.diff(counts, axis=0)).max(axis=1) > 1)
        if moved.size == 0:
            raise BadInput(f"{self.path}: the robot never moves in this record, nothing to fit to")
        end = int(armed[moved[-1]]) + int(1e6 * _WINDOW_S)
        return np.arange(int(armed[0]), min(end, int(armed[-1])), int(1e6 * _WINDOW_S))

    def recorded(self, tie_s: float) -> Windows:
        """Return what the record has in each window."""
        trace, t_us, poses = self._trace, *self._poses_board(tie_s)
        at = np.searchsorted(trace.t_us, self.edges_us)
        return self._cut(trace.t_us, trace.counts, trace.pwm, at, t_us, poses)

    def _poses_board(self, tie_s: float) -> tuple[Array, Array]:
        t_us = 1e6 * (self._frames[:, 0] + tie_s) + self._host_to_board_us
        return t_us, self._frames[:, 1:]

    def rehearsed(self, ratios: Mapping[str, float], tie_s: float) -> Windows:
        """Return what the twin does in each window with these parameters."""
        trace = self._trace
        t_us, poses = self._poses_board(tie_s)
        wanted = sorted(
            [(int(t), 0, i) for i, t in enumerate(trace.t_us) if t >= self.edges_us[0]]
            + [(int(t), 1, i) for i, t in enumerate(t_us) if t >= self.edges_us[0] - _LEAD_US]
        )
        counts, pwm = np.zeros_like(trace.counts), np.zeros_like(trace.pwm)
        seen = np.full_like(poses, np.nan)
        kernel = self._kernel(ratios)
        for at_us, kind, row in wanted:
            target = at_us - self._shift_us
            while kernel.advance(target) < target:
                kernel.take_sent()
            if kind == 0:
                counts[row] = kernel.true_counts
                pwm[row] = [PWM_TOP * duty for duty in kernel.duty]
            else:
                seen[row] = kernel.pose_at(min(float(target), float(kernel.time_us)))
            if at_us > self.edges_us[-1] + 1_000_000:
                break
        at = np.searchsorted(trace.t_us, self.edges_us)
        return self._cut(trace.t_us, counts, pwm, at, t_us, seen)

    def _kernel(self, ratios: Mapping[str, float]) -> Any:
        from sim_twin.setup import make_kernel  # noqa: PLC0415 - a replay itself needs no twin

        scenario = self._scenario.model_copy(update={"mismatch": dict(ratios)})
        kernel = make_kernel(true_robot(scenario), scenario.link.baud, Random(1))
        kernel.reset(*self.start_pose())
        writer, at_us = FrameWriter(), _PACE_US
        for name, value in self._parameters.items():
            kernel.receive(at_us, writer.encode(set_parameter_message(name, value)))
            at_us += _PACE_US
        kernel.receive(
            _START_US - _PACE_US,
            writer.encode(arming_message(*board_hashes(dict(self._parameters)))),
        )
        for t_us, frame in self._sent:
            if (target := t_us - self._shift_us) > _START_US - _PACE_US:
                kernel.receive(target, frame)
        return kernel

    def start_pose(self) -> tuple[float, float, float]:
        """Return where the camera saw the robot before it was armed."""
        t_us, poses = self._poses_board(0.0)
        before = poses[t_us < self.edges_us[0]]
        before = before if before.size else poses[:1]
        x_m, y_m = np.median(before[:, :2], axis=0)
        return float(x_m), float(y_m), median_angle_rad(before[:, 2])

    def _cut(
        self,
        t_us: NDArray[np.int64],
        counts: Any,
        pwm: Array,
        at: Any,
        seen_us: Array,
        poses: Array,
    ) -> Windows:
        unit = 2.0 * math.pi / self._scenario.robot.encoder_counts_per_turn
        spans = [slice(a, max(b, a + 1)) for a, b in itertools.pairwise(at)]
        dt_s = 1e-6 * np.diff(t_us[at])[:, None]
        forward, turn = _motion(seen_us, poses, self.edges_us)
        return Windows(
            {
                "wheel speed": unit * np.diff(counts[at], axis=0) / dt_s,
                "pwm": np.array([pwm[span].mean(axis=0) for span in spans]),
                "forward": forward,
                "turn": turn,
            }
        )


def fit_twin(rehearsal: Rehearsal) -> Fit:
    """Return the twin fitted to a record; raises BadInput when the record moves too little."""
    edges_s = 1e-6 * (rehearsal.edges_us[:-1] - rehearsal.edges_us[0])
    usable = np.isfinite(rehearsal.recorded(0.0).values["forward"])
    moving = np.abs(rehearsal.recorded(0.0).values["wheel speed"]).max(axis=1) > _MOVING_RAD_S
    even = (edges_s // _BLOCK_S) % 2 == 0
    fitted, held_out = usable & moving & even, usable & moving & ~even
    if min(fitted.sum(), held_out.sum()) * 2 < _LEAST_WINDOWS:
        raise BadInput(
            f"{rehearsal.path}: the robot moves in {int((usable & moving).sum())} windows of "
            f"{_WINDOW_S:g} s, {_LEAST_WINDOWS} are needed for a fit"
        )
    names = list(GROUPS)

    def difference(point: Array, chosen: NDArray[np.bool_]) -> dict[str, Array]:
        ratios = {key: float(point[i]) for i, name in enumerate(names) for key in GROUPS[name]}
        twin = rehearsal.rehearsed(ratios, float(point[-1])).values
        record = rehearsal.recorded(float(point[-1])).values
        return {name: (twin[name] - record[name])[chosen] for name in _SCALES}

    def residual(point: Array) -> Array:
        parts = difference(point, fitted)
        whole = [np.nan_to_num(parts[n] / scale).ravel() for n, scale in _SCALES.items()]
        return np.concatenate(whole)

    start = np.array([1.0] * len(names) + [0.0])
    low = [_BOUNDS[0]] * len(names) + [-_CLOCK_TIE_BOUND_S]
    high = [_BOUNDS[1]] * len(names) + [_CLOCK_TIE_BOUND_S]
    found = least_squares(
        residual, start, bounds=(low, high), diff_step=[_STEP] * len(names) + [0.1],
        x_scale=[0.1] * len(names) + [0.01], loss="soft_l1", max_nfev=_MOST_EVALUATIONS,
    )  # fmt: skip
    seen, unseen = _rms(difference(found.x, fitted)), _rms(difference(found.x, held_out))
    reach = _reach(
        _sensitivity(residual, found.x), found.fun, {n: max(seen[n], unseen[n]) for n in _SCALES}
    )
    return Fit(
        ratios={
            name: (float(found.x[i]), float(found.x[i] - reach[i]), float(found.x[i] + reach[i]))
            for i, name in enumerate(names)
        },
        camera_tie_s=float(found.x[-1]),
        windows_fitted=int(fitted.sum()),
        windows_held_out=int(held_out.sum()),
        residual_fitted=seen,
        residual_held_out=unseen,
        residual_unfitted=_rms(difference(np.append(start[:-1], found.x[-1]), held_out)),
        converged=found.status > 0,
    )


def median_angle_rad(angles_rad: Array) -> float:
    """Return the median of angles that lie within half a turn of each other, in (-pi, pi]."""
    middle = math.atan2(np.sin(angles_rad).sum(), np.cos(angles_rad).sum())
    away = np.remainder(angles_rad - middle + math.pi, 2.0 * math.pi) - math.pi
    return wrap_pi(middle + float(np.median(away)))


def _sensitivity(residual: Callable[[Array], Array], at: Array) -> Array:
    """Return the residual's derivatives, central over _SPAN; the search's own are rough."""
    spans = np.array([_SPAN] * (at.size - 1) + [_SPAN_TIE_S])
    sides = [(at + step, at - step) for step in np.diag(spans)]
    return np.stack([residual(up) - residual(down) for up, down in sides], axis=1) / (2.0 * spans)


def _reach(jacobian: Array, residual: Array, rms: Mapping[str, float]) -> Array:
    """Return half the 95 % interval of each parameter.

    Two parts, added as variances: scatter, by the fit's linearisation; and what does not average
    out, because the twin is not the robot to the last digit: a disagreement of each kind as large as
    `rms` (in its unit, on the windows fitted or held out, the larger) whose signs are those that
    move the parameter furthest. Windows are few and alike within: Student's t over their number.
    """
    # Soft L1's weights, as least_squares applies them.
    jacobian = jacobian * (1.0 + residual[:, None] ** 2) ** -0.75
    weighted = residual * (1.0 + residual**2) ** 0.25
    degrees = max(residual.size - jacobian.shape[1], 1)
    inverse = np.linalg.pinv(jacobian)
    variance = float(weighted @ weighted) / degrees * (inverse**2).sum(axis=1)
    windows = residual.size // sum(_COLUMNS.values())
    first = 0
    for name, scale in _SCALES.items():
        rows = slice(first, first + windows * _COLUMNS[name])
        variance += (np.abs(inverse[:, rows]).sum(axis=1) * rms[name] / scale) ** 2
        first = rows.stop
    return np.asarray(student.ppf(0.975, windows - 1) * np.sqrt(variance))


def _rms(parts: Mapping[str, Array]) -> dict[str, float]:
    return {name: float(np.sqrt(np.nanmean(values**2))) for name, values in parts.items()}


def _motion(t_us: Array, poses: Array, edges_us: NDArray[np.int64]) -> tuple[Array, Array]:
    """Return the way forward in m and the turn in rad within each window, in the body's frame."""
    known = np.isfinite(poses[:, 0])
    t_us, poses = t_us[known], poses[known]
    if t_us.size < 2:
        nothing = np.full(edges_us.size - 1, np.nan)
        return nothing, nothing
    theta = np.unwrap(poses[:, 2])
    outside = {"left": np.nan, "right": np.nan}
    x, y, angle = (
        np.interp(edges_us, t_us, column, **outside) for column in (poses[:, 0], poses[:, 1], theta)
    )
    middle = 0.5 * (angle[:-1] + angle[1:])
    forward = np.diff(x) * np.cos(middle) + np.diff(y) * np.sin(middle)
    return forward, np.diff(angle)


def _seen(source: Source) -> Array:
    """Return the frames in which the robot was seen: exposure in s, X, Y, theta."""
    frames = source.frames
    if not frames:
        raise BadInput(f"{source.path}: no camera frames to fit to")
    seen = frames["seen"] == 1.0
    names = ("t_exposure_s", "x_m", "y_m", "theta_rad")
    return np.column_stack([frames[name][seen] for name in names])


def _tie_us(source: Source, trace: Trace) -> float:
    """Return board time - record time in us, from the reports that came soonest."""
    states = [
        logged.unix_us - source.manifest.start_unix_us
        for logged in source.link
        if int.from_bytes(logged.frame[7:10], "little") == dialect.MAVLINK_MSG_ID_WHEEL_STATE
    ]
    gaps = trace.t_us - np.array(states[: trace.t_us.size], dtype=np.int64)
    return float(gaps.max())


def _drives(frame: bytes) -> bool:
    """Say whether a frame moves the robot or stops it: set-points, disarming and stop."""
    msg_id = int.from_bytes(frame[7:10], "little")
    if msg_id != dialect.MAVLINK_MSG_ID_COMMAND_LONG:
        return msg_id == dialect.MAVLINK_MSG_ID_WHEEL_SETPOINT
    command = decoded(frame)
    return not is_arming(command) and command.command != dialect.MAV_CMD_REQUEST_MESSAGE
