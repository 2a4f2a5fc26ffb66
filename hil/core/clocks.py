"""The one place where board time and camera time become host time.

Three clocks: `t_host_s` (monotonic, this machine), `t_mcu_us` (board, uint32, wraps after 71.6
minutes) and `t_cam_s` (stamps of the camera). Nothing here reads a clock: times are arguments,
so a replay of the same exchanges gives the same ties bit for bit. The arithmetic is native/clocks.cpp.
"""

from __future__ import annotations

from hil.core import _native


class BoardClock(_native.BoardClock):
    """Ties `t_mcu_us` to `t_host_s` by a regression over the last TIMESYNC exchanges.

    Model of one exchange with round trip e above the shortest one:

        middle = offset + (1 + drift) t_board + asymmetry e / 2,    -1 <= asymmetry <= 1

    so the jitter's split between the two ways is fitted, held near even by a prior. The outlier gate
    takes exchanges up to four times the median excess; those above `rtt_limit_s` are refused (`exchange`
    returns False). Answers that may have waited behind a report (`report`) are left out once there are
    enough others: that wait is all on the way up. The soonest reports of each half second tell the rate.
    `sigma_s` is the standard error of the tie at the newest board time seen under equal *shortest* latency
    both ways, inf before a tie; `bound_s`, half the shortest round trip, holds whatever that asymmetry is.
    `drift_ratio` is the rate of host time over board time, less one (+1e-4: the board is 100 ppm slow).
    `to_host_s` takes a stamp no further than 35 minutes from the newest one.
    """


class CameraClock(_native.CameraClock):
    """Ties the camera's stamps to host time from when the frames arrive.

    arrival = exposure + latency + jitter, so host time of a stamp is the stamp plus the median of
    (arrival - stamp) over the last frames, less the calibrated median latency. The median is
    blind to frames held up by a busy host or radio; its window bounds the lag behind a drift.

    A stamp that no delay explains is refused (`arrival` returns False, nothing may be dated by it): later
    than the tie allows (the frame would have been exposed after it arrived), or gone back behind an earlier
    one. A few of them in a row that agree are another clock: the old window is dropped, as `BoardClock`
    does when the board was reset; `step_s` is then how far the stamps have stepped. `sigma_s` is the
    standard error of the tie, from the scatter of arrivals; inf below two frames.
    """
