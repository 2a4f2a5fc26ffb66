"""The UDP bridge, met by a client that knows nothing of the project."""

import math

import pytest
from click.testing import CliRunner
from pymavlink import mavutil

from hil.cli.run import command
from hil.core.errors import BadInput
from hil.core.types import Estimate, Pose
from hil.tools.bridge import UdpBridge, ned_from_world, parse_address


def estimate(theta_rad: float, theta_dot_rad_s: float = 0.0, d0_m: float = 0.03) -> Estimate:
    """Return a robot at (1, 2) m driving at 0.4 m/s along its heading, flat point d0 ahead."""
    c, s = math.cos(theta_rad), math.sin(theta_rad)
    return Estimate(
        t_host_s=0.0,
        pose=Pose(1.0, 2.0, theta_rad),
        eta1_m_s=0.4,
        theta_dot_rad_s=theta_dot_rad_s,
        z1_m=(1.0 + d0_m * c, 2.0 + d0_m * s),
        z2_m_s=(0.4 * c, 0.4 * s),
    )


def test_heading_east_is_yaw_plus_90_degrees():
    """World +X is east: theta = 0 is a compass yaw of +90 degrees, all speed is eastward."""
    state = ned_from_world(estimate(0.0))
    assert (state.north_m, state.east_m) == (2.0, 1.0)
    assert state.yaw_rad == pytest.approx(math.pi / 2)
    assert (state.v_north_m_s, state.v_east_m_s) == pytest.approx((0.0, 0.4))


def test_counter_clockwise_turn_lowers_the_compass_yaw():
    """Turning left from north goes to the west: yaw falls, its rate is negative."""
    north, a_bit_left = ned_from_world(estimate(math.pi / 2)), ned_from_world(estimate(1.7, 0.5))
    assert north.yaw_rad == pytest.approx(0.0)
    assert a_bit_left.yaw_rad < 0.0
    assert a_bit_left.yaw_rate_rad_s == -0.5


def test_speed_is_that_of_the_centre_of_mass():
    """At theta = 0, theta_dot = 2 rad/s the centre slides by -d0 theta_dot = -0.06 m/s along Y."""
    state = ned_from_world(estimate(0.0, theta_dot_rad_s=2.0))
    assert state.v_north_m_s == pytest.approx(-0.06)
    assert state.v_east_m_s == pytest.approx(0.4)


def test_a_standard_client_sees_vehicle_and_pose():
    """Pymavlink's own UDP client finds an armed rover and reads its position and attitude."""
    client = mavutil.mavlink_connection("udpin:127.0.0.1:0", dialect="common")
    port = client.port.getsockname()[1]
    bridge = UdpBridge(f"127.0.0.1:{port}")
    try:
        for step in range(30):  # 1 s at the outer rate
            bridge.publish(100.0 + step / 30.0, estimate(0.0), armed=True)
        heartbeat = client.recv_match(type="HEARTBEAT", blocking=True, timeout=2.0)
        assert heartbeat.type == mavutil.mavlink.MAV_TYPE_GROUND_ROVER
        assert client.motors_armed()
        position = client.recv_match(type="LOCAL_POSITION_NED", blocking=True, timeout=2.0)
        assert (position.x, position.y, position.z) == (2.0, 1.0, 0.0)
        while client.recv_match(type="LOCAL_POSITION_NED", blocking=False):
            pass
        assert client.messages["ATTITUDE"].yaw == pytest.approx(math.pi / 2, abs=1e-6)
        assert client.messages["LOCAL_POSITION_NED"].time_boot_ms == pytest.approx(900, abs=70)
        assert client.mav.total_receive_errors == 0
    finally:
        bridge.close()
        client.close()


@pytest.mark.parametrize("text", ["14550", "127.0.0.1:", "127.0.0.1:0", "127.0.0.1:70000"])
def test_a_bad_address_is_refused(text):
    """An address without host or with a port outside 1 to 65535 is one clear line."""
    with pytest.raises(BadInput, match="HOST:PORT"):
        parse_address(text)


def test_a_run_is_seen_by_a_ground_station(tmp_path):
    """A run with the bridge: armed while it is controlled, moving, and disarmed at the end."""
    client = mavutil.mavlink_connection("udpin:127.0.0.1:0", dialect="common")
    port = client.port.getsockname()[1]
    arguments = [
        "scenario-1", "--camera", "pose", "--set", "duration_s=2", "--out", str(tmp_path / "run"),
        "--bridge", f"127.0.0.1:{port}",
    ]  # fmt: skip
    try:
        run = CliRunner().invoke(command, arguments)
        assert "complete" in run.stdout
        seen = list(iter(lambda: client.recv_match(blocking=True, timeout=0.2), None))
    finally:
        client.close()
    beats = [m for m in seen if m.get_type() == "HEARTBEAT"]
    armed = [bool(m.base_mode & mavutil.mavlink.MAV_MODE_FLAG_SAFETY_ARMED) for m in beats]
    # 1 Hz in 2 s of the robot's time, and the last word.
    assert armed in ([True, True, True, False], [True, True, False])
    places = [(m.x, m.y) for m in seen if m.get_type() == "LOCAL_POSITION_NED"]
    # 10 Hz; scenario 1 starts at X = -0.6 m (east), Y = -0.35 m (north).
    assert len(places) == pytest.approx(20, abs=2)
    assert places[0] == pytest.approx((-0.35, -0.60), abs=0.02)
    assert math.dist(places[0], places[-1]) > 0.05


def test_a_bad_bridge_address_leaves_no_record(tmp_path):
    """The address is looked at before the rig and the folder."""
    run = CliRunner().invoke(
        command, ["scenario-1", "--bridge", "nowhere", "--out", str(tmp_path / "run")]
    )
    assert isinstance(run.exception, BadInput)
    assert not (tmp_path / "run").exists()
