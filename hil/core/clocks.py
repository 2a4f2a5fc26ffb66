"""The one place where board time and camera time become host time.

Three clocks: `t_host_s` (monotonic, this machine), `t_mcu_us` (board, uint32, wraps after 71.6
minutes) and `t_cam_s` (stamps of the camera). Nothing here reads a clock: times are arguments,
so a replay of the same exchanges gives the same ties bit for bit.
"""

from __future__ import annotations

import math
from bisect import bisect_left, insort
from collections import deque
from dataclasses import dataclass

_WRAP_US = 1 << 32
_HALF_WRAP_US = 1 << 31

# Prior on how the excess of a round trip splits between the two ways: both are alike, give or take;
# anything, where answers may have waited on the board's port.
_ASYMMETRY_CLEAR, _ASYMMETRY_ANY = 0.08, 0.577
# Share of the excess by which frames held up by those before them may still put the middle off.
_HELD_RATIO = 0.05
# An answer stamped in the first half of a report's period may have waited behind that report on the
# board's port; once there are so many that did not, the tie is made of these.
_CLEAR_WANTED = 8
# The soonest report of each half second follows the board's rate; so many of them are kept.
_SOONEST_S = 0.5
_SOONEST_KEPT = 64
_SOONEST_WANTED = 12
# Prior on the rate of the board's clock: a ceramic resonator is good to 0.5 % (5,000 ppm).
_DRIFT_PRIOR_RATIO = 5e-3
# Resolution below which nothing is claimed: the board may stamp in 4 us, the host in polls.
_FLOOR_S = 50e-6


@dataclass(frozen=True, slots=True)
class _Exchange:
    """One TIMESYNC round: unwrapped board time at half way, host time there, round trip."""

    t_mcu_us: int
    t_mid_s: float
    rtt_s: float
    clear: bool  # the answer cannot have waited behind a report


class BoardClock:
    """Ties `t_mcu_us` to `t_host_s` by a regression over the last TIMESYNC exchanges.

    Model of one exchange with round trip e above the shortest one:

        middle = offset + (1 + drift) t_board + asymmetry e / 2,    -1 <= asymmetry <= 1

    so the jitter's split between the two ways is fitted, held near even by a prior. The outlier gate
    takes exchanges up to four times the median excess; those above `rtt_limit_s` are refused.
    Answers that may have waited behind a report (`report`) are left out once there are enough
    others: that wait is all on the way up. The soonest reports of each half second tell the rate.
    `sigma_s` is the standard error of the tie under equal *shortest* latency both ways;
    `bound_s`, half the shortest round trip, holds whatever that asymmetry is.
    """

    def __init__(self, window: int = 64, rtt_limit_s: float = 0.5) -> None:
        self._window: deque[_Exchange] = deque(maxlen=window)
        self._rtt_limit_s = rtt_limit_s
        self._last_us = 0
        self.exchanges = 0
        self.refused = 0
        self.restarts = 0
        self._forget()

    def _forget(self) -> None:
        self._window.clear()
        self._ref_us = 0
        self._ref_s = 0.0
        self._report_us = self._period_us = -1  # of the newest report; -1: none yet
        self._soonest: deque[tuple[int, float]] = deque(maxlen=_SOONEST_KEPT)
        self._soonest_until_us = 0
        self._rate = 1e-6
        self._mean_us = 0
        self._var_s2 = math.inf
        self._var_drift = _DRIFT_PRIOR_RATIO**2
        self.rtt_s = math.nan
        self.bound_s = math.inf

    @property
    def ready(self) -> bool:
        """True once an exchange has been taken."""
        return bool(self._window)

    @property
    def drift_ratio(self) -> float:
        """Rate of host time over board time, less one (+1e-4: the board is 100 ppm slow)."""
        return self._rate * 1e6 - 1.0

    @property
    def sigma_s(self) -> float:
        """Standard error in s of `to_host_s` for the newest board time seen; inf before a tie."""
        return self._sigma_at(self._last_us)

    def exchange(self, t_send_s: float, t_receive_s: float, t_mcu_us: int) -> bool:
        """Take one exchange: host times of request and reply, board time stamped in between.

        Returns False when it was refused (round trip outside 0 to the limit).
        """
        rtt_s = t_receive_s - t_send_s
        if not 0.0 <= rtt_s <= self._rtt_limit_s:
            self.refused += 1
            return False
        unwrapped_us = self._unwrap(t_mcu_us)
        mid_s = 0.5 * (t_send_s + t_receive_s)
        if self.ready and self._impossible(unwrapped_us, mid_s, rtt_s):
            self._forget()  # the board's clock jumped: it was reset
            self.restarts += 1
        self._last_us = max(self._last_us, unwrapped_us) if self.ready else unwrapped_us
        self._window.append(_Exchange(unwrapped_us, mid_s, rtt_s, self._is_clear(unwrapped_us)))
        self.rtt_s = rtt_s
        self.exchanges += 1
        self._fit()
        return True

    def report(self, t_mcu_us: int, t_arrival_s: float) -> None:
        """Take that a periodic report stamped `t_mcu_us` reached the host at `t_arrival_s`."""
        if not self.ready:
            return
        unwrapped_us = self._unwrap(t_mcu_us)
        if 0 <= self._report_us < unwrapped_us:
            self._period_us = unwrapped_us - self._report_us
        self._report_us = unwrapped_us
        if not self._soonest or unwrapped_us >= self._soonest_until_us:
            self._soonest.append((unwrapped_us, t_arrival_s))
            self._soonest_until_us = unwrapped_us + round(_SOONEST_S * 1e6)
            return
        before_us, before_s = self._soonest[-1]
        if t_arrival_s - before_s < (unwrapped_us - before_us) * self._rate:
            self._soonest[-1] = (unwrapped_us, t_arrival_s)

    def _is_clear(self, unwrapped_us: int) -> bool:
        """Tell whether the board's port was free of the last report when it answered."""
        since_us = unwrapped_us - self._report_us
        return self._period_us > 0 and not 0 <= 2 * since_us < self._period_us

    def to_host_s(self, t_mcu_us: int) -> float:
        """Return the host time of a board stamp no further than 35 minutes from the newest one."""
        unwrapped_us = self._unwrap(t_mcu_us)
        self._last_us = max(self._last_us, unwrapped_us)
        return self._ref_s + (unwrapped_us - self._ref_us) * self._rate

    def _unwrap(self, t_mcu_us: int) -> int:
        ahead_us = (t_mcu_us - self._last_us + _HALF_WRAP_US) % _WRAP_US - _HALF_WRAP_US
        return self._last_us + ahead_us

    def _sigma_at(self, unwrapped_us: int) -> float:
        lead_s = (unwrapped_us - self._mean_us) * 1e-6
        return math.sqrt(self._var_s2 + self._var_drift * lead_s * lead_s)

    def _impossible(self, unwrapped_us: int, mid_s: float, rtt_s: float) -> bool:
        """Tell whether the stamp lies outside its exchange by more than the tie allows."""
        predicted_s = self._ref_s + (unwrapped_us - self._ref_us) * self._rate
        margin_s = 6.0 * self._sigma_at(unwrapped_us)
        return abs(predicted_s - mid_s) > 0.5 * rtt_s + self.bound_s + margin_s

    @staticmethod
    def _gated(usable: list[_Exchange], shortest_s: float) -> list[_Exchange]:
        """Return the exchanges whose excess is at most four times the median excess."""
        rtts_s = sorted(x.rtt_s for x in usable)
        limit_s = shortest_s + 4.0 * (rtts_s[(len(rtts_s) - 1) // 2] - shortest_s)
        return [x for x in usable if x.rtt_s <= limit_s]

    def _fit(self) -> None:
        """Least squares for offset, drift and asymmetry; the last two are held by priors."""
        clear = [x for x in self._window if x.clear]
        are_clear = len(clear) >= _CLEAR_WANTED
        rtts_s = [x.rtt_s for x in self._window]
        shortest_s = min(rtts_s)
        # The shortest of n round trips is itself above the true floor by about spread/(n+1).
        spread_s = max(max(rtts_s) - shortest_s, shortest_s) / (len(rtts_s) + 1)
        ref = self._window[-1]
        points = [
            (
                (x.t_mcu_us - ref.t_mcu_us) * 1e-6,
                0.5 * (x.rtt_s - shortest_s),
                x.t_mid_s - ref.t_mid_s - (x.t_mcu_us - ref.t_mcu_us) * 1e-6,
            )
            for x in self._gated(clear if are_clear else list(self._window), shortest_s)
        ]
        soonest = [((us - ref.t_mcu_us) * 1e-6, t_s) for us, t_s in self._soonest]
        asymmetry = _ASYMMETRY_CLEAR if are_clear else _ASYMMETRY_ANY
        fit = _regress(points, _rate_of(soonest), asymmetry, 0.5 * min(spread_s, shortest_s))
        self._ref_us = ref.t_mcu_us
        self._ref_s = ref.t_mid_s + fit.lag_s
        self._rate = (1.0 + fit.drift) * 1e-6
        self._mean_us = ref.t_mcu_us + round(fit.mean_t_s * 1e6)
        self._var_s2, self._var_drift = fit.var_s2, fit.var_drift
        self.bound_s = 0.5 * shortest_s


@dataclass(frozen=True, slots=True)
class _Fit:
    """Lag at t = 0 and its variance at `mean_t_s`, drift and its variance."""

    lag_s: float
    drift: float
    mean_t_s: float
    var_s2: float
    var_drift: float


def _rate_of(soonest: list[tuple[float, float]]) -> tuple[float, float]:
    """Return drift and its variance from the soonest reports (board s, arrival s).

    Reports that stand out are left out: shorter ones come sooner. Without enough it is the prior.
    """
    prior = _DRIFT_PRIOR_RATIO**2
    points = [(t, y - t) for t, y in soonest[:-1]]  # the newest half second is not over
    for _ in range(3):
        n = len(points)
        if n < _SOONEST_WANTED:
            return 0.0, prior
        mean_t, mean_y = sum(t for t, _ in points) / n, sum(y for _, y in points) / n
        tt = sum((t - mean_t) ** 2 for t, _ in points)
        drift = sum((t - mean_t) * (y - mean_y) for t, y in points) / tt
        off_s = [abs(y - mean_y - drift * (t - mean_t)) for t, y in points]
        limit_s = 4.0 * sorted(off_s)[n // 2] + _FLOOR_S
        kept = [point for point, off in zip(points, off_s, strict=True) if off <= limit_s]
        if len(kept) == n:  # the same once more
            break
        points = kept
    noise = sum(off * off for off in off_s) / (n - 2) + _FLOOR_S**2
    precision = tt / noise + 1.0 / prior
    return drift * tt / noise / precision, 1.0 / precision


def _regress(
    points: list[tuple[float, float, float]],
    rate: tuple[float, float],
    asymmetry_sigma: float,
    unseen_s: float,
) -> _Fit:
    """Fit lag = offset + drift t + asymmetry excess to (t, excess, lag) in s.

    `rate` is drift and variance known before, the asymmetry known to `asymmetry_sigma` about 0;
    `unseen_s` is how far the smallest excess may be off.
    """
    n = len(points)
    drift0, var0 = rate
    mean_t, mean_e, mean_y = (sum(p[i] for p in points) / n for i in range(3))
    off = [(t - mean_t, e - mean_e, y - mean_y - drift0 * (t - mean_t)) for t, e, y in points]
    # An excess e split at random between the two ways puts the middle off by e/2 uniformly.
    assumed = sum(e * e for _, e, _ in points) / (3.0 * n) + unseen_s**2 + _FLOOR_S**2
    pairs = ((0, 0), (1, 1), (0, 1), (0, 2), (1, 2), (2, 2))
    tt0, ee0, te, ty, ey, yy = (sum(o[i] * o[k] for o in off) for i, k in pairs)
    noise = assumed
    for _ in range(6):  # each time with the noise found: a split that is plain is believed
        tt, ee = tt0 + noise / var0, ee0 + noise / asymmetry_sigma**2
        det = tt * ee - te * te
        drift = (ty * ee - ey * te) / det
        asymmetry = (ey * tt - ty * te) / det
        explained = drift * (2.0 * ty - drift * tt0) + asymmetry * (2.0 * ey - asymmetry * ee0)
        residual = max(yy - explained + 2.0 * drift * asymmetry * te, 0.0)
        # Four pseudo-observations of the assumed noise keep a lucky handful of points modest.
        noise = (residual + 4.0 * assumed) / (n + 2.0)
    return _Fit(
        lag_s=mean_y - (drift0 + drift) * mean_t - asymmetry * mean_e,
        drift=drift0 + drift,
        mean_t_s=mean_t,
        var_s2=noise / n + (noise * tt / det + _HELD_RATIO**2) * mean_e**2 + unseen_s**2 / 3.0,
        var_drift=noise * ee / det,
    )


# A stamp later than the tie by more is not the camera's jitter: so many sigma of the scatter, and this
# much where there is hardly any, or (the second) before the scatter is known.
_ODD_SIGMAS = 5.0
_ODD_S, _ODD_AT_FIRST_S = 0.02, 0.2
_SCATTER_FRAMES = 16
# So many odd frames in a row that agree with each other mean that the camera's clock has stepped.
_STEP_FRAMES = 4


class CameraClock:
    """Ties the camera's stamps to host time from when the frames arrive.

    arrival = exposure + latency + jitter, so host time of a stamp is the stamp plus the median of
    (arrival - stamp) over the last frames, less the calibrated median latency. The median is
    blind to frames held up by a busy host or radio; its window bounds the lag behind a drift.

    A stamp that no delay explains is refused: later than the tie allows (the frame would have been
    exposed after it arrived), or gone back behind an earlier one. A few of them in a row that agree
    are another clock: the old window is dropped, as `BoardClock` does when the board was reset.
    """

    def __init__(self, latency_s: float, window: int = 301) -> None:
        self._latency_s = latency_s
        self._window = window
        self._gaps_s: deque[float] = deque()
        self._sorted_s: list[float] = []
        self._newest_cam_s = -math.inf
        self._odd_s: list[float] = []
        self.refused = 0
        self.restarts = 0
        self.step_s = 0.0  # of the stamps, at the last restart

    @property
    def ready(self) -> bool:
        """True once a frame has been seen."""
        return bool(self._gaps_s)

    @property
    def sigma_s(self) -> float:
        """Standard error in s of the tie, from the scatter of arrivals; inf below two frames."""
        count = len(self._sorted_s)
        # The median of n has 1.253 times the standard error of a mean.
        return 1.253 * self._scatter_s() / math.sqrt(count) if count > 1 else math.inf

    def arrival(self, t_cam_s: float, t_host_s: float) -> bool:
        """Take a frame stamped `t_cam_s` (mid exposure) that reached the host at `t_host_s`.

        Returns False when the stamp was refused: nothing may be dated by it.
        """
        gap_s = t_host_s - t_cam_s
        if not math.isfinite(gap_s):
            self.refused += 1
            return False
        if self._is_odd(t_cam_s, gap_s):
            self._odd_s.append(gap_s)
            if not self._has_stepped():
                self.refused += 1
                return False
            self._restart()
        else:
            self._odd_s.clear()
            self._take(gap_s)
        self._newest_cam_s = t_cam_s
        return True

    def to_host_s(self, t_cam_s: float) -> float:
        """Return the host time of the exposure stamped `t_cam_s`; needs one arrival first."""
        return t_cam_s + self._median_s() - self._latency_s

    def _median_s(self) -> float:
        count = len(self._sorted_s)
        if count == 0:
            return math.nan
        return 0.5 * (self._sorted_s[(count - 1) // 2] + self._sorted_s[count // 2])

    def _scatter_s(self) -> float:
        """Half the inter-quartile range over 0.674: sigma of a normal scatter."""
        count = len(self._sorted_s)
        quartiles_s = self._sorted_s[(3 * count) // 4] - self._sorted_s[count // 4]
        return quartiles_s / (2.0 * 0.674)

    def _margin_s(self) -> float:
        if len(self._sorted_s) < _SCATTER_FRAMES:
            return _ODD_AT_FIRST_S
        return max(_ODD_S, _ODD_SIGMAS * self._scatter_s())

    def _is_odd(self, t_cam_s: float, gap_s: float) -> bool:
        """Tell whether no delay explains the stamp; once one is odd, also those that go with it."""
        if not self.ready:
            return False
        off_s = gap_s - self._median_s()
        margin_s = self._margin_s()
        if off_s < -margin_s or t_cam_s < self._newest_cam_s:
            return True
        return bool(self._odd_s) and off_s > margin_s

    def _has_stepped(self) -> bool:
        """Tell whether the last odd frames agree, as far as the jitter lets them."""
        last_s = self._odd_s[-_STEP_FRAMES:]
        return len(last_s) == _STEP_FRAMES and max(last_s) - min(last_s) <= self._margin_s()

    def _restart(self) -> None:
        """Begin anew with the frames that agree."""
        before_s, last_s = self._median_s(), self._odd_s[-_STEP_FRAMES:]
        self._gaps_s.clear()
        self._sorted_s.clear()
        self._odd_s.clear()
        for gap_s in last_s:
            self._take(gap_s)
        self.step_s = before_s - self._median_s()
        self.restarts += 1

    def _take(self, gap_s: float) -> None:
        self._gaps_s.append(gap_s)
        insort(self._sorted_s, gap_s)
        if len(self._gaps_s) > self._window:
            del self._sorted_s[bisect_left(self._sorted_s, self._gaps_s.popleft())]
