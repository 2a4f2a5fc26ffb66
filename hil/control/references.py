"""References for the flat output z1*, with three analytic derivatives (world axes, SI)."""

from __future__ import annotations

import math
from bisect import bisect_right
from itertools import pairwise
from typing import TYPE_CHECKING, Protocol

import numpy as np

from hil.config.control import (
    CircleReference,
    PointReference,
    ReferenceConfig,
    StopsReference,
    WaypointReference,
)
from hil.core.errors import BadInput
from hil.core.registries import REFERENCES
from hil.core.types import ReferenceState

if TYPE_CHECKING:
    from scipy.interpolate import BSpline

    from hil.config.scenario import Scenario

_ZERO = (0.0, 0.0)
_SAMPLES = 200  # instants at which a reference's speed is looked at


class Reference(Protocol):
    """A desired motion of the flat output."""

    def at(self, t_s: float) -> ReferenceState:
        """Return the desired state `t_s` after the start of the run (negative: as at 0)."""


@REFERENCES.register(
    "point", settings=PointReference, summary="a point on the floor, reached and held"
)
class Point:
    """A fixed point."""

    def __init__(self, config: PointReference) -> None:
        self._state = ReferenceState((config.x_m, config.y_m), _ZERO, _ZERO, _ZERO)

    def at(self, t_s: float) -> ReferenceState:  # noqa: ARG002 - a point does not move
        """Return the point at rest."""
        return self._state


@REFERENCES.register("circle", settings=CircleReference, summary="the circle (8.23)")
class Circle:
    """The circle (8.23), clockwise from (0, radius) about the centre.

    X* = R sin(wt), Y* = R cos(wt), theta* = atan2(Y*, X*) - pi/2, which unwrapped is -wt; then
    z1* = [X* + d0 cos theta*, Y* + d0 sin theta*].
    """

    def __init__(self, config: CircleReference) -> None:
        self._config = config

    def at(self, t_s: float) -> ReferenceState:
        """Return the desired state; each derivative is the one before turned and scaled by w."""
        config = self._config
        w = config.rate_rad_s
        angle = w * max(t_s, 0.0)
        s, c = math.sin(angle), math.cos(angle)
        x = config.radius_m * s + config.d0_m * c
        y = config.radius_m * c - config.d0_m * s
        w2 = w * w
        return ReferenceState(
            (config.center_x_m + x, config.center_y_m + y),
            (w * y, -w * x),
            (-w2 * x, -w2 * y),
            (-w2 * w * y, w2 * w * x),
        )


# Places at which the bounds of a path are looked at, and how the highest of them are looked at again.
_LOOKS = 2000
_PEAKS = 40
_CLOSER = 25


@REFERENCES.register(
    "waypoints",
    settings=WaypointReference,
    summary="a smooth path through points, from rest to rest",
)
class Waypoints:
    """A quintic spline through the waypoints, run from rest to rest; two points: their line.

    The path p(u) is four times differentiable in the chord length u, or, where that would leave the
    straight lines between the points by more than the longest of them (points very unevenly
    spread), in the sum of the chords' square roots (centripetal). The time law u(t) is the
    septic smooth step, whose speed, acceleration and jerk vanish at both ends. The duration is the
    shortest that keeps speed and turn rate within their bounds: 35/16 of length/speed on a line.
    """

    def __init__(self, config: WaypointReference) -> None:
        points = np.asarray(config.points_m, dtype=float)
        chords = np.hypot(*np.diff(points, axis=0).T)
        if float(chords.min()) < 1e-3:
            raise BadInput(
                f"reference.points_m: neighbouring waypoints {float(chords.min()):.4f} m apart, "
                "at least 0.001 m is needed; drop the repeated point"
            )
        knots, spline = _path(points, chords)
        self._length = float(knots[-1])
        self._pieces = _pieces(spline, knots)
        self._knots = [float(k) for k in knots]
        self.duration_s = self._shortest_duration(spline, config)

    def _shortest_duration(self, spline: BSpline, config: WaypointReference) -> float:
        """Return the duration at which the tighter of the two bounds is met.

        Where it is met is looked for twice: over the whole way, then closer around the peaks, which
        are narrow where the path all but turns back on itself.
        """
        tau = np.linspace(0.0, 1.0, _LOOKS + 1)
        needed_s = self._needed_s(spline, config, tau)
        peaks = np.argsort(needed_s[1:-1])[-_PEAKS:] + 1
        closer = np.linspace(tau[peaks - 1], tau[peaks + 1], 2 * _CLOSER + 1)
        return float(max(needed_s.max(), self._needed_s(spline, config, closer.ravel()).max()))

    def _needed_s(self, spline: BSpline, config: WaypointReference, tau: np.ndarray) -> np.ndarray:
        """Return the duration in s that the bounds ask for at each share of the duration."""
        u = self._length * tau**4 * (35 - 84 * tau + 70 * tau**2 - 20 * tau**3)
        rate = self._length * 140 * tau**3 * (1 - tau) ** 3
        d1, d2 = spline(u, 1), spline(u, 2)
        speed = np.hypot(d1[:, 0], d1[:, 1])
        turn = np.abs(d1[:, 0] * d2[:, 1] - d1[:, 1] * d2[:, 0]) / np.maximum(speed, 1e-9) ** 2
        by_speed, by_turn = rate / config.speed_max_m_s, rate / config.turn_rate_max_rad_s
        return np.asarray(np.maximum(speed * by_speed, turn * by_turn), np.float64)

    def share_of_way(self, t_s: float) -> float:
        """Return how much of the way (chord length) is done at `t_s`, 0 to 1."""
        tau = min(max(t_s / self.duration_s, 0.0), 1.0)
        return tau**4 * (35 - 84 * tau + 70 * tau**2 - 20 * tau**3)

    def at(self, t_s: float) -> ReferenceState:
        """Return the desired state; before the start and after the end it is at rest."""
        duration = self.duration_s
        tau = min(max(t_s / duration, 0.0), 1.0)
        rest = 1.0 - tau
        length = self._length
        u = length * tau**4 * (35 - 84 * tau + 70 * tau**2 - 20 * tau**3)
        u1 = length / duration * 140 * tau**3 * rest**3
        u2 = length / duration**2 * 420 * tau**2 * rest**2 * (1 - 2 * tau)
        u3 = length / duration**3 * 840 * tau * rest * (1 - 5 * tau + 5 * tau**2)
        piece = self._pieces[_interval(self._knots, u)]
        x = _chain_rule(piece[1], u - piece[0], u1, u2, u3)
        y = _chain_rule(piece[2], u - piece[0], u1, u2, u3)
        return ReferenceState((x[0], y[0]), (x[1], y[1]), (x[2], y[2]), (x[3], y[3]))


@REFERENCES.register(
    "stops", settings=StopsReference, summary="straight legs from rest to rest, a pause between two"
)
class Stops:
    """Legs of `Waypoints` between neighbouring points, one after the other."""

    def __init__(self, config: StopsReference) -> None:
        self._legs = [
            Waypoints(WaypointReference(points_m=leg, speed_max_m_s=config.speed_max_m_s))
            for leg in pairwise(config.points_m)
        ]
        self._begins_s = [0.0]
        for leg in self._legs:
            self._begins_s.append(self._begins_s[-1] + leg.duration_s + config.pause_s)
        self.duration_s = self._begins_s[-1] - config.pause_s

    def at(self, t_s: float) -> ReferenceState:
        """Return the desired state; at rest before the start, in each pause, and after the end."""
        number = max(bisect_right(self._begins_s, max(t_s, 0.0)) - 1, 0)
        number = min(number, len(self._legs) - 1)
        return self._legs[number].at(t_s - self._begins_s[number])


_Poly = tuple[float, ...]
_Piece = tuple[float, _Poly, _Poly]


def _path(points: np.ndarray, chords: np.ndarray) -> tuple[np.ndarray, BSpline]:
    """Return the parameter at each waypoint and the path over it."""
    knots, spline = points, None
    for power in (1.0, 0.5):
        knots = np.concatenate(([0.0], np.cumsum(chords**power)))
        spline = _quintic(knots, points)
        if _excursion_m(spline, knots, points) <= float(chords.max()):
            break
    return knots, spline


def _excursion_m(spline: BSpline, knots: np.ndarray, points: np.ndarray) -> float:
    """Return how far the path gets from the straight line between the waypoints on either side."""
    share = np.linspace(0.0, 1.0, 33)[:, None]
    path = spline(knots[:-1] + share * np.diff(knots))
    along = np.diff(points, axis=0)
    away = path - points[:-1]
    t = np.clip((away * along).sum(-1) / (along**2).sum(-1), 0.0, 1.0)
    return float(np.hypot(*np.moveaxis(away - t[..., None] * along, -1, 0)).max())


def _quintic(knots: np.ndarray, points: np.ndarray) -> BSpline:
    """Return the interpolating quintic spline with free ends (third and fourth derivative zero).

    Free ends leave a parabola undecided by two points: there it is the straight line.
    """
    from scipy.interpolate import make_interp_spline  # noqa: PLC0415 - slow import, rarely needed

    if len(knots) == 2:
        return make_interp_spline(knots, points, k=1)
    free = ([(3, np.zeros(2)), (4, np.zeros(2))], [(3, np.zeros(2)), (4, np.zeros(2))])
    return make_interp_spline(knots, points, k=5, bc_type=free)


def _pieces(spline: BSpline, knots: np.ndarray) -> list[_Piece]:
    """Return, per interval between waypoints, its start and the Taylor polynomials of x and y."""
    taylor = [
        np.stack([spline(u, k) / math.factorial(k) for k in range(6)])
        for u in (knots[:-1] + knots[1:]) / 2
    ]
    return [
        (float((a + b) / 2), tuple(map(float, c[:, 0])), tuple(map(float, c[:, 1])))
        for (a, b), c in zip(pairwise(knots), taylor, strict=True)
    ]


def _interval(knots: list[float], u: float) -> int:
    """Return the index of the interval that holds u."""
    for index in range(len(knots) - 2):
        if u < knots[index + 1]:
            return index
    return len(knots) - 2


def _chain_rule(
    c: _Poly, h: float, u1: float, u2: float, u3: float
) -> tuple[float, float, float, float]:
    """Return p(u(t)) and its first three time derivatives, p quintic in h = u - centre."""
    p0 = c[0] + h * (c[1] + h * (c[2] + h * (c[3] + h * (c[4] + h * c[5]))))
    p1 = c[1] + h * (2 * c[2] + h * (3 * c[3] + h * (4 * c[4] + h * 5 * c[5])))
    p2 = 2 * c[2] + h * (6 * c[3] + h * (12 * c[4] + h * 20 * c[5]))
    p3 = 6 * c[3] + h * (24 * c[4] + h * 60 * c[5])
    return p0, p1 * u1, p2 * u1 * u1 + p1 * u2, p3 * u1**3 + 3 * p2 * u1 * u2 + p1 * u3


def make_reference(config: ReferenceConfig) -> Reference:
    """Return the reference a scenario asks for; raises BadInput where there is none such."""
    made: Reference = REFERENCES.get(config.kind).factory(config)
    return made


def unfinished(config: ReferenceConfig, duration_s: float) -> str | None:
    """Return a sentence when a run of `duration_s` ends before its reference does, else None."""
    if isinstance(config, StopsReference):
        needed_s = Stops(config).duration_s
        if needed_s <= duration_s:
            return None
        return (
            f"reference.points_m: the legs take {needed_s:.4g} s within speed_max_m_s = "
            f"{config.speed_max_m_s:g} m/s and with pause_s = {config.pause_s:g} s, the run ends after "
            f"{duration_s:g} s, and its figures judge no more than that; give duration_s more"
        )
    if not isinstance(config, WaypointReference):
        return None
    reference = Waypoints(config)
    if reference.duration_s <= duration_s:
        return None
    done = min(100.0 * reference.share_of_way(duration_s), 99.9)
    return (
        f"reference.points_m: the way takes {reference.duration_s:.4g} s within speed_max_m_s = "
        f"{config.speed_max_m_s:g} m/s and turn_rate_max_rad_s = {config.turn_rate_max_rad_s:g} rad/s, "
        f"the run ends after {duration_s:g} s with {done:.3g} % of it done, and its figures "
        "judge no more than that; give duration_s more, or the path a wider turn"
    )


def notes(scenario: Scenario) -> list[str]:
    """Return what a reader must know before trusting a run's figures: one line each.

    What the reference asks may lie beyond the run's duration or the loop's limits; the run is then
    possible, and its figures say something else than they seem to.
    """
    reference = make_reference(scenario.reference)
    limits, run_s = scenario.control.limits, scenario.duration_s
    found = []
    if told := unfinished(scenario.reference, run_s):
        found.append(told)
    rates = [reference.at(run_s * k / _SAMPLES).z1_dot_m_s for k in range(_SAMPLES + 1)]
    fastest = max(math.hypot(*rate) for rate in rates)
    most = math.hypot(limits.eta1_max_m_s, scenario.robot.d0_m * limits.theta_dot_max_rad_s)
    if fastest > most:
        found.append(
            f"the reference moves at up to {fastest:.3g} m/s, more than the {most:.3g} m/s that "
            "control.limits allow: it cannot be followed"
        )
    return found
