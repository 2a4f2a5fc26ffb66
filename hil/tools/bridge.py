"""Shows the robot to ground stations: standard pose messages over UDP, loopback by default.

HEARTBEAT at 1 Hz, ATTITUDE and LOCAL_POSITION_NED at 10 Hz, from `common` and nothing of the
project's own, so that MAVProxy (`--master=udpin:127.0.0.1:14550`) and QGroundControl understand
them without a plug-in. The bridge only speaks: what a ground station sends back is not read, so
that nothing on the network can move the robot.
"""

from __future__ import annotations

import math
import socket
from dataclasses import dataclass

from pymavlink.dialects.v20 import common

from hil.core.errors import BadInput
from hil.core.types import Estimate, wrap_pi

DEFAULT_ADDRESS = "127.0.0.1:14550"
_HEARTBEAT_PERIOD_S = 1.0
_POSE_PERIOD_S = 0.1


@dataclass(frozen=True, slots=True)
class NedState:
    """Pose and rates as ground stations know them: north, east, yaw clockwise from north."""

    north_m: float
    east_m: float
    v_north_m_s: float
    v_east_m_s: float
    yaw_rad: float
    yaw_rate_rad_s: float


def ned_from_world(estimate: Estimate) -> NedState:
    """Convert the centre of mass from world axes (X east, Y north, theta counter-clockwise).

    The speed of the centre of mass is that of the flat output less what the rotation adds to it:
    v = z2 - theta_dot (z1 - p) turned by +90 degrees.
    """
    pose = estimate.pose
    lead_x_m, lead_y_m = estimate.z1_m[0] - pose.x_m, estimate.z1_m[1] - pose.y_m
    return NedState(
        north_m=pose.y_m,
        east_m=pose.x_m,
        v_north_m_s=estimate.z2_m_s[1] - estimate.theta_dot_rad_s * lead_x_m,
        v_east_m_s=estimate.z2_m_s[0] + estimate.theta_dot_rad_s * lead_y_m,
        yaw_rad=wrap_pi(math.pi / 2.0 - pose.theta_rad),
        yaw_rate_rad_s=-estimate.theta_dot_rad_s,
    )


def parse_address(text: str) -> tuple[str, int]:
    """Return host and port of HOST:PORT; raises BadInput."""
    host, _, port_text = text.rpartition(":")
    if not host or not port_text.isdigit() or not 1 <= int(port_text) <= 65_535:
        raise BadInput(f"bridge address {text!r}: needs HOST:PORT, for example {DEFAULT_ADDRESS}")
    return host, int(port_text)


class UdpBridge:
    """Publishes the estimate to one UDP address; `publish` may be called at any rate."""

    def __init__(self, address: str = DEFAULT_ADDRESS) -> None:
        self._address = parse_address(address)
        try:
            self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
            self._socket.setblocking(False)
            socket.getaddrinfo(*self._address, socket.AF_INET)
        except OSError as error:
            raise BadInput(f"bridge address {address!r}: {error.strerror}") from None
        self._mavlink = common.MAVLink(None, srcSystem=1, srcComponent=1)
        self._start_s: float | None = None
        self._heartbeat_due_s = self._pose_due_s = -math.inf

    def publish(self, t_host_s: float, estimate: Estimate, armed: bool) -> None:
        """Send what is due at `t_host_s`; a network that takes nothing is not an error."""
        if self._start_s is None:
            self._start_s = t_host_s
        if t_host_s >= self._heartbeat_due_s:
            self._heartbeat_due_s = _next(self._heartbeat_due_s, _HEARTBEAT_PERIOD_S, t_host_s)
            self._send(_heartbeat(armed))
        if t_host_s >= self._pose_due_s:
            self._pose_due_s = _next(self._pose_due_s, _POSE_PERIOD_S, t_host_s)
            state = ned_from_world(estimate)
            boot_ms = round((t_host_s - self._start_s) * 1e3) & 0xFFFF_FFFF
            self._send(
                common.MAVLink_attitude_message(
                    boot_ms, 0.0, 0.0, state.yaw_rad, 0.0, 0.0, state.yaw_rate_rad_s
                )
            )
            self._send(
                common.MAVLink_local_position_ned_message(
                    boot_ms,
                    state.north_m,
                    state.east_m,
                    0.0,
                    state.v_north_m_s,
                    state.v_east_m_s,
                    0.0,
                )
            )

    def _send(self, message: common.MAVLink_message) -> None:
        frame = message.pack(self._mavlink)
        self._mavlink.seq = (self._mavlink.seq + 1) & 0xFF
        try:
            self._socket.sendto(frame, self._address)
        except OSError:
            return  # nobody listens, or the network is down: the run matters more

    def close(self) -> None:
        """Say that the robot is disarmed and release the socket; safe to call twice."""
        self._send(_heartbeat(armed=False))
        self._socket.close()


def _next(due_s: float, period_s: float, now_s: float) -> float:
    """Return the next date of a schedule that keeps its rate whenever it is looked at."""
    return due_s + period_s if now_s < due_s + period_s else now_s + period_s


def _heartbeat(armed: bool) -> common.MAVLink_message:
    return common.MAVLink_heartbeat_message(
        common.MAV_TYPE_GROUND_ROVER,
        common.MAV_AUTOPILOT_GENERIC,
        common.MAV_MODE_FLAG_GUIDED_ENABLED | (common.MAV_MODE_FLAG_SAFETY_ARMED if armed else 0),
        0,
        common.MAV_STATE_ACTIVE if armed else common.MAV_STATE_STANDBY,
        3,
    )
