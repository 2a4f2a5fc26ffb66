"""Somebody between host and robot: a twin whose bytes and frames are cut, spoilt, made up or repeated.

What the host sends and what the board really says is looked at on the way, and what must never be is
noted in `broken`.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from dataclasses import replace

from hil.core.rig import Frame
from hil.core.types import PoseMeasurement
from hil.wire import dialect
from hil.wire.framing import HOST_SYSTEM, FrameReader
from sim_twin.twin import Twin

BOARD_WAITS_US, TICK_US = 250_000, 4_000
PEAK_M_S, REST_M_S, REST_RAD_S = 1.0, 0.02, 0.1
Spoil = Callable[[bytes], bytes]


class Between:
    """A rig; `w_max_rad_s` is what the host may ask of a wheel at most."""

    def __init__(self, twin: Twin, w_max_rad_s: float) -> None:
        self._twin = twin
        self._w_max_rad_s = w_max_rad_s
        self.stream = self
        self.now_s, self.begin, self.truth, self.close = (
            twin.now_s, twin.begin, twin.truth, twin.close,
        )  # fmt: skip
        self.later: deque[tuple[float, Callable[[], None]]] = deque()  # in order of time
        self.broken: list[str] = []
        self.up_cut_s = self.down_cut_s = self.blind_s = -math.inf  # until then
        self.spoil: Spoil = bytes
        self.spoil_pose: Callable[[Frame], Frame] = lambda frame: frame
        self.kept: deque[bytes] = deque(maxlen=50)  # of what came up
        self._made_up: list[bytes] = []
        self._heard = FrameReader()
        self._told = FrameReader(HOST_SYSTEM)
        self._given = FrameReader()
        self.arming_acknowledged = False
        self.sought_s = self.report_s = self.pose_s = twin.now_s()
        self.moving_s = -math.inf  # when the robot last moved

    def make_up(self, data: bytes) -> None:
        """Let the host read bytes that the board never sent."""
        self._made_up.append(data)

    def wait(self, until_s: float) -> None:
        """Let time pass, do what is due, and look at the robot."""
        while self.later and self.later[0][0] <= self.now_s():
            self.later.popleft()[1]()
        self._twin.wait(until_s)
        truth = self.truth()
        speed_m_s = abs(truth.eta1_m_s)
        if speed_m_s > REST_M_S or abs(truth.theta_dot_rad_s) > REST_RAD_S:
            self.moving_s = self.now_s()
            if not self.arming_acknowledged:
                self.broken.append("motion without arming")
        if speed_m_s > PEAK_M_S:
            self.broken.append(f"{speed_m_s:.2f} m/s")

    def read(self) -> bytes:
        """Return what comes up, as it is spoilt."""
        data = self._twin.stream.read()
        self._look_at_board(data)
        if data:
            self.kept.append(data)
        came = self.spoil(data) if data and self.now_s() >= self.up_cut_s else b""
        came += b"".join(self._made_up)
        self._made_up.clear()
        for msg_id, _, _ in self._given.feed(came) if came else ():
            if msg_id == dialect.MAVLINK_MSG_ID_WHEEL_STATE:
                self.report_s = self.now_s()
        return came

    def _look_at_board(self, data: bytes) -> None:
        for msg_id, message, _ in self._heard.feed(data):
            if msg_id == dialect.MAVLINK_MSG_ID_COMMAND_ACK and (
                message.command == dialect.MAV_CMD_COMPONENT_ARM_DISARM and message.result == 0
            ):
                self.arming_acknowledged = True
            if msg_id != dialect.MAVLINK_MSG_ID_WHEEL_STATE:
                continue
            moved = message.pwm_left_counts or message.pwm_right_counts
            if moved and message.state != dialect.HIL_STATE_ARMED:
                self.broken.append(f"PWM in state {message.state}")
            silent_us = (message.t_mcu_us - message.t_setpoint_us) & 0xFFFF_FFFF
            if moved and silent_us > BOARD_WAITS_US + 2 * TICK_US:
                self.broken.append(f"PWM {silent_us * 1e-6:.3f} s after the last set-point")

    def write(self, data: bytes) -> None:
        """Look at what the host sends, and pass it on."""
        for msg_id, message, _ in self._told.feed(data):
            if msg_id != dialect.MAVLINK_MSG_ID_WHEEL_SETPOINT:
                continue
            asked = (message.omega_left_rad_s, message.omega_right_rad_s)
            if not all(abs(w) <= self._w_max_rad_s + 1e-3 for w in asked):  # NaN too
                self.broken.append(f"asks for {asked} rad/s")
            if any(asked) and not self.arming_acknowledged:
                self.broken.append("a set-point before arming")
        if self.now_s() >= self.down_cut_s:
            self._twin.stream.write(data)

    def poll_frame(self) -> Frame | None:
        """Return the next frame, as it is spoilt; none while the camera is blind."""
        frame = self._twin.poll_frame()
        while frame is not None and self.now_s() < self.blind_s:
            frame = self._twin.poll_frame()
        if frame is None:
            return None
        frame = self.spoil_pose(frame)
        if frame.pose is not None and frame.pose.pose is not None:
            self.pose_s = self.now_s()
        return frame


def pose_off(frame: Frame, x_m: float, turn_rad: float) -> Frame:
    """Return a frame whose pose is off by so much."""
    seen = frame.pose
    if seen is None or seen.pose is None:
        return frame
    pose = replace(seen.pose, x_m=seen.pose.x_m + x_m, theta_rad=seen.pose.theta_rad + turn_rad)
    return replace(frame, pose=replace(seen, pose=pose))


def nothing_seen(frame: Frame) -> Frame:
    """Return a frame in which no robot was found."""
    return replace(frame, pose=PoseMeasurement(None, 0.0, "made up"))
