"""How good the link is: round trips by TIMESYNC, loss both ways, tie of the clocks."""

from __future__ import annotations

import math

from hil.core.wording import past
from hil.tools.bringup.drive import OpenLoop
from hil.tools.bringup.result import Check, Measured
from hil.wire.link import BoardLink

# With the wheel states that fills 65 % of the line.
_PERIOD_S = 0.05
_LOOKS = 5  # in a period, so that hardly ever two answers come between two
_REQUESTS = 100
_DRAIN_S = 1.3  # the board tells once a second what it lost
# The board stops after 250 ms without a set-point: at 150 ms there and back three may yet be late.
TRIP_P99_MAX_S = 0.150
# The host predicts over half of it; what it predicts with is known to 10 %.
TRIP_MEDIAN_MAX_S = 0.100
LOSS_MAX_RATIO = 0.02
# 2.5 mm at 0.5 m/s, of the 20 mm that a run may end off.
TIE_MAX_S = 0.005


def check_link(loop: OpenLoop, link: BoardLink, measured: Measured) -> list[Check]:
    """Return the checks of latency, loss and clock tie, from six seconds of exchanges."""
    loop.fresh()
    lost, frames, sent = link.counters.lost, link.counters.frames, link.frames_sent
    board_lost = _board_lost(link)
    trips = sorted(_round_trips(loop, link))
    loop.pump(_DRAIN_S)
    up, all_up = link.counters.lost - lost, link.counters.frames - frames
    down, all_down = _board_lost(link) - board_lost, link.frames_sent - sent
    checks = [_loss(up / max(1, up + all_up), down / max(1, all_down)), _tie(link.clock.sigma_s)]
    if not trips:
        text = f"no answer within 0.5 s to {_REQUESTS} requests for the time"
        return [_failed("link latency", text, "link_latency"), *checks]
    measured.round_trip_median_s = trips[len(trips) // 2]
    measured.round_trip_p99_s = trips[min(len(trips) - 1, int(0.99 * len(trips)))]
    latency = _latency(measured.round_trip_median_s, measured.round_trip_p99_s, len(trips))
    return [latency, *checks]


def _board_lost(link: BoardLink) -> int:
    """Return how many of the host's frames the board has missed, as it last said."""
    return int(link.sys_status.errors_count2) if link.sys_status else 0


def _round_trips(loop: OpenLoop, link: BoardLink) -> list[float]:
    trips: list[float] = []
    seen = link.clock.exchanges
    for step in range(_REQUESTS * _LOOKS):
        if step % _LOOKS == 0:
            link.ask_time(loop.now_s())
        loop.pump(_PERIOD_S / _LOOKS)
        if link.clock.exchanges != seen:
            seen = link.clock.exchanges
            trips.append(link.clock.rtt_s)
    return trips


def _failed(name: str, text: str, fault: str) -> Check:
    remedy = "shorter range, a cable in place of the radio, another baud rate; docs/debugging.md"
    return Check(name, "fail", text, remedy, fault)


def _latency(median_s: float, p99_s: float, count: int) -> Check:
    text = (
        f"round trip {past(median_s * 1e3, TRIP_MEDIAN_MAX_S * 1e3, '.0f')} ms median, "
        f"{past(p99_s * 1e3, TRIP_P99_MAX_S * 1e3, '.0f')} ms at 99 % of {count} "
        f"(limits {TRIP_MEDIAN_MAX_S * 1e3:.0f}, {TRIP_P99_MAX_S * 1e3:.0f})"
    )
    if median_s > TRIP_MEDIAN_MAX_S or p99_s > TRIP_P99_MAX_S:
        return _failed("link latency", text, "link_latency")
    return Check("link latency", "ok", text)


def _loss(up_ratio: float, down_ratio: float) -> Check:
    text = (
        f"{past(up_ratio, LOSS_MAX_RATIO, '.1%')} of the board's frames, "
        f"{past(down_ratio, LOSS_MAX_RATIO, '.1%')} of the host's "
        f"(limit {LOSS_MAX_RATIO:.0%})"
    )
    if max(up_ratio, down_ratio) > LOSS_MAX_RATIO:
        return _failed("link loss", text, "link_loss")
    return Check("link loss", "ok", text)


def _tie(sigma_s: float) -> Check:
    if math.isinf(sigma_s):
        return _failed("clock tie", "none: no exchange of times went through", "link_latency")
    text = f"{past(sigma_s * 1e3, TIE_MAX_S * 1e3, '.2f')} ms, 1 sigma (limit {TIE_MAX_S * 1e3:g})"
    if sigma_s > TIE_MAX_S:
        return _failed("clock tie", text, "link_jitter")
    return Check("clock tie", "ok", text)
