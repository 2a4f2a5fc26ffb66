"""What the sliding term of a law does, over the ticks in which the law ran.

While the control stop holds the robot (hil/control/laws/hold.py) no law runs, and nothing of it counts.

The disturbance is what acts on the third derivative of the flat output beyond what the law reckons
with: C xi + D xi_dot of (2.36). With what xi makes of the body's accelerations, a1 = d eta1/dt - zeta
and a_w = d theta_dot/dt - w_dot, it has the parts d a1/dt along the heading and 2 theta_dot a1 +
eta1 a_w across (tests/laws/test_chain.py proves that these are the corrected matrices). On a simulated
robot the motion is the true one; on a rig it is the estimated one, and the disturbance is then the
residual of the chain. Slopes are taken over +-1/15 s: what is faster no law at 30 Hz answers, and
over one tick the estimate's noise would be most of it.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from hil.analysis.pieces import PIECE_ROWS, median, percentiles, pieces, row_count

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]
    Columns = Mapping[str, Array]

HALF_SPAN_S = 1.0 / 15.0
# A sliding mode acts with alpha of this times the disturbance's 90 % bound (alpha > 2 D), and with
# ||s|| <= eps in this share of the ticks.
GAIN_RATIO = 2.0
IN_LAYER_SHARE = 0.99

# A command of the control stop: the law did not run in this tick.
RESTING = ("v1_m_s3", "u2_m_s2", "zeta_m_s2", "eta1_cmd_m_s", "theta_dot_cmd_rad_s")

_GAMMAS = ("gamma0_m_s3", "gamma1_s3", "gamma2_s2")
_FROM_GOAL, _SPEED = ("delta1_x_m", "delta1_y_m"), ("z2_x_m_s", "z2_y_m_s")


@dataclass(frozen=True, slots=True)
class LawFacts:
    """What the figures need to know of a law beside its columns; NaN where it has no such thing.

    `alpha_m_s3` is the gain of its sliding term, to which 2 F+ of (2.9) is added: `gammas` are the value of
    F+ (m/s^3), and what it has per distance from the goal (1/s^3) and per speed (1/s^2). `d0_m` is the
    offset of the flat output as believed, `accel_max_m_s2` the limit on zeta.
    """

    alpha_m_s3: float = math.nan
    d0_m: float = math.nan
    accel_max_m_s2: float = math.nan
    gammas: tuple[float, float, float] = (0.0, 0.0, 0.0)

    @classmethod
    def of(cls, gains: Mapping[str, Any], scenario: Mapping[str, Any]) -> LawFacts:
        """Return the facts of a law's gains and a resolved scenario, as a manifest holds them."""
        outer = gains.get("outer", {})
        alpha = outer.get("alpha_m_s3")
        limits = scenario.get("control", {}).get("limits", {})
        return cls(
            math.nan if alpha is None else float(alpha),
            float(scenario.get("robot", {}).get("d0_m", math.nan)),
            float(limits.get("zeta_max_m_s2", math.nan)),
            tuple(float(outer.get(name) or 0.0) for name in _GAMMAS),  # type: ignore[arg-type]
        )

    @property
    def gain_names(self) -> tuple[str, ...]:
        """Return the columns that the gain of the sliding term varies with."""
        _, by_distance, by_speed = self.gammas
        return (*(_FROM_GOAL if by_distance else ()), *(_SPEED if by_speed else ()))

    def gain_m_s3(self, columns: Columns) -> Array | float:
        """Return the gain of the sliding term, at each tick where it varies."""
        constant, by_distance, by_speed = self.gammas
        gain: Array | float = self.alpha_m_s3 + 2.0 * constant
        for share, names in ((by_distance, _FROM_GOAL), (by_speed, _SPEED)):
            if share:
                gain = gain + 2.0 * share * np.hypot(*(columns[name] for name in names))
        return gain


# A column that figures are given beside those of a record: what `law_ran` found.
_RAN = "law ran"


def with_ran(columns: Columns) -> Columns:
    """Return a short table with what `law_ran` gives kept beside it, which several figures ask for."""
    if not isinstance(columns, dict) or row_count(columns) > PIECE_ROWS:
        return columns
    ran = law_ran(columns)
    ran.flags.writeable = False
    return {**columns, _RAN: ran}


def of_ran(columns: Columns) -> tuple[str, ...]:
    """Return the names of the columns that `law_ran` reads."""
    return (*RESTING, _RAN) if _RAN in columns else RESTING


def law_ran(columns: Columns) -> NDArray[np.bool_]:
    """Return at which ticks the law ran: all but those in which the control stop commands rest."""
    if _RAN in columns:
        known: Any = columns[_RAN]
        return np.asarray(known, np.bool_)
    resting: NDArray[np.bool_] = columns[RESTING[0]] == 0.0
    for name in RESTING[1:]:
        resting &= columns[name] == 0.0
    return ~resting


def disturbance(columns: Columns, who: str, d0_m: float) -> Array:
    """Return |C xi + D xi_dot| in m/s^3 at the ticks with the law running all around them.

    `who` is the prefix of the columns of motion: "true" or "est". Empty below nine such ticks, and
    where most came at once, as on a host that is kept from running: there is no slope between those.
    """
    found = list(_disturbances(columns, who, d0_m))
    return np.concatenate(found) if found else np.empty(0)


def _disturbances(columns: Columns, who: str, d0_m: float) -> Iterator[Array]:
    """Yield `disturbance` piece by piece."""
    tick_s = median(lambda: (np.diff(p["t_s"]) for p in pieces(columns, ["t_s"], before=1)))
    if tick_s <= 0.0 or not math.isfinite(d0_m):
        return
    half = max(round(HALF_SPAN_S / tick_s), 1)
    if row_count(columns) <= 4 * half:
        return
    names = ["t_s", f"{who}_eta1_m_s", f"{who}_theta_dot_rad_s", *of_ran(columns)]
    for piece in pieces(columns, names, before=4 * half):
        eta1, w = piece[names[1]], piece[names[2]]
        if eta1.size > 4 * half:
            yield _disturbance(eta1, w, piece, d0_m, half, tick_s)


def _disturbance(
    eta1: Array, w: Array, piece: Columns, d0_m: float, half: int, tick_s: float
) -> Array:
    a1 = _slope(eta1, half, tick_s) - _mean_around(piece["zeta_m_s2"], half)
    a_w = _slope(w, half, tick_s) + _mean_around(piece["u2_m_s2"], half) / d0_m
    inner = slice(2 * half, -2 * half)
    along = _slope(a1, half, tick_s)
    across = 2.0 * w[inner] * a1[half:-half] + eta1[inner] * a_w[half:-half]
    whole = _mean_around(law_ran(piece).astype(float), 2 * half) > 1.0 - 1e-9
    size = np.hypot(along, across)
    return size[whole & np.isfinite(size)]


def figures(columns: Columns, who: str, facts: LawFacts) -> dict[str, float]:
    """Return the figures of the sliding term; NaN for a law without a sliding variable."""
    ticks = _Ticks(columns, facts)

    def sizes() -> Iterator[Array]:
        return _disturbances(columns, who, facts.d0_m) if ticks.any_s else iter(())

    middle, bound, most = percentiles(sizes, [50, 90, 100])
    ratio = _least_gain(columns, facts) / bound if bound > 0.0 else math.nan
    layered = ticks.layered
    inside = ticks.inside / ticks.ran if layered else math.nan
    acts = ratio >= GAIN_RATIO and inside >= IN_LAYER_SHARE and layered and ticks.thin
    known = layered and math.isfinite(ratio)
    return {
        "law_ticks": float(ticks.ran),
        "disturbance_median_m_s3": middle,
        "disturbance_90_m_s3": bound,
        "disturbance_max_m_s3": most,
        "alpha_over_d90_ratio": float(ratio),
        "s_over_eps_median_ratio": median(lambda: (s / eps for _, s, eps in _layers(columns)))
        if layered
        else math.nan,
        "sliding_term_share": _share(columns, facts) if math.isfinite(most) else math.nan,
        "s_settling_s": ticks.settling_s if layered else math.nan,
        "sliding_acts": float(acts) if known else math.nan,
    }


def _least_gain(columns: Columns, facts: LawFacts) -> float:
    """Return the least gain of the sliding term while the law ran; NaN for a law without one."""
    if not facts.gain_names:
        return float(facts.gain_m_s3({}))
    gains = (
        np.asarray(facts.gain_m_s3(piece))[law_ran(piece)]
        for piece in pieces(columns, [*facts.gain_names, *of_ran(columns)])
    )
    return min((float(gain.min()) for gain in gains if gain.size), default=math.nan)


def _layers(columns: Columns) -> Iterator[tuple[Array, Array, Array]]:
    """Yield time, ||s|| and eps of the ticks in which the law ran, piece by piece."""
    for piece in pieces(columns, ["t_s", "s_x_m_s2", "s_y_m_s2", "eps_m_s2", *of_ran(columns)]):
        ran = law_ran(piece)
        s = np.hypot(piece["s_x_m_s2"], piece["s_y_m_s2"])
        yield piece["t_s"][ran], s[ran], piece["eps_m_s2"][ran]


class _Ticks:
    """What is counted over the ticks in which the law ran."""

    def __init__(self, columns: Columns, facts: LawFacts) -> None:
        self.ran = self.inside = 0
        self.any_s, self.thin, self._finite = False, True, True
        start_s = since_s = math.nan  # of the first tick; from which on ||s|| <= eps
        outside = True
        for t_s, s, eps in _layers(columns):
            self.ran += s.size
            self.any_s = self.any_s or bool(np.isfinite(s).any())
            self._finite = self._finite and bool(np.isfinite(s + eps).all())
            self.thin = self.thin and bool((eps < facts.accel_max_m_s2).all())
            within = s <= eps
            self.inside += int(np.count_nonzero(within))
            if not s.size:
                continue
            start_s = float(t_s[0]) if math.isnan(start_s) else start_s
            beyond = np.flatnonzero(~within)
            first = int(beyond[-1]) + 1 if beyond.size else 0
            if beyond.size or outside:
                since_s = float(t_s[first]) if first < t_s.size else math.nan
            outside = first == t_s.size
        self.settling_s = since_s - start_s  # NaN where it never stays within
        self.layered = self.ran > 0 and self._finite


def _share(columns: Columns, facts: LawFacts) -> float:
    """Return the median share of the sliding term in the jerk commanded.

    ||term|| / (||term|| + ||rest||), the rest being what the command has beside it. The term is
    (alpha + 2 F+) s/(||s|| + eps), or what the law's own columns say.
    """
    own = ["slide_x_m_s3", "slide_y_m_s3"] if "slide_x_m_s3" in columns else []
    names = [*_OF_SHARE, *facts.gain_names, *own, *of_ran(columns)]

    short = row_count(columns) <= PIECE_ROWS  # a long run's are worked out anew each time
    kept = [_shares(piece, facts) for piece in pieces(columns, names)] if short else None

    def parts() -> Iterator[tuple[Array, Array]]:
        return iter(kept or (_shares(piece, facts) for piece in pieces(columns, names)))

    if not any(np.isfinite(both).any() for _, both in parts()):
        return math.nan
    return median(lambda: (share[~np.isnan(share)] for share, _ in parts()))


_OF_SHARE = (
    "s_x_m_s2",
    "s_y_m_s2",
    "eps_m_s2",
    "est_theta_rad",
    "est_eta1_m_s",
    "est_theta_dot_rad_s",
)


def _shares(piece: Columns, facts: LawFacts) -> tuple[Array, Array]:
    """Return the shares at the ticks in which the law ran, and the sizes that they are parts of."""
    ran = law_ran(piece)
    term_x, term_y = (values[ran] for values in _terms(piece, facts))
    v1, u2, zeta = (piece[name][ran] for name in ("v1_m_s3", "u2_m_s2", "zeta_m_s2"))
    theta, eta1, w = (
        piece[f"est_{name}"][ran] for name in ("theta_rad", "eta1_m_s", "theta_dot_rad_s")
    )
    along, across = v1 - eta1 * w * w, 2.0 * zeta * w - eta1 * u2 / facts.d0_m  # A + B v
    cos, sin = np.cos(theta), np.sin(theta)
    term = np.hypot(term_x, term_y)
    rest = np.hypot(cos * along - sin * across - term_x, sin * along + cos * across - term_y)
    both = term + rest
    return np.divide(term, both, out=np.zeros_like(term), where=both > 0.0), both


def _terms(columns: Columns, facts: LawFacts) -> tuple[Array, Array]:
    """Return the sliding term in the jerk wanted, world X and Y."""
    if "slide_x_m_s3" in columns:
        return columns["slide_x_m_s3"], columns["slide_y_m_s3"]
    s_x, s_y = columns["s_x_m_s2"], columns["s_y_m_s2"]
    pull = -facts.gain_m_s3(columns) / (np.hypot(s_x, s_y) + columns["eps_m_s2"])
    return pull * s_x, pull * s_y


def _slope(values: Array, half: int, tick_s: float) -> Array:
    """Return the slope over +-half ticks."""
    return np.asarray((values[2 * half :] - values[: -2 * half]) / (2 * half * tick_s))


def _mean_around(values: Array, half: int) -> Array:
    """Return the mean over +-half ticks."""
    width = 2 * half + 1
    return np.convolve(values, np.full(width, 1.0 / width), "valid")
