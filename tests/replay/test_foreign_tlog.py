"""Telemetry logs with several vehicles, damage, set clocks and values that say "unknown"."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pymavlink.dialects.v20 import common

from hil.record.reader import read_run
from tests.replay.logs import Command, arc, hil, link_of, pose_frames, stamped

__all__ = ["hil"]

TASK = 'scenario = "circle"\nset = ["requirements=[]", "duration_s=10"]\n'
CORNER = (5.0, -4.0, 0.0)


@pytest.fixture(autouse=True)
def _mapping(hil: Command) -> None:  # noqa: ARG001 - it goes to the new folder
    Path("map.toml").write_text(TASK, encoding="utf-8")


def drive(count: int = 200, system: int = 1, component: int = 1) -> list[bytes]:
    """Return the pose frames of an arc, 20 a second."""
    link = link_of(system, component)
    return [pose_frames(0.05 * k, arc(0.05 * k), link) for k in range(count)]


def write(parts: list[bytes]) -> None:
    Path("log.tlog").write_bytes(b"".join(parts))


def imported(hil: Command, mapping: str = "") -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    Path("map.toml").write_text(mapping + TASK, encoding="utf-8")
    status, out, err = hil("import", "log.tlog", "--map", "map.toml", "--out", "run", "--json")
    assert status == 0, err
    return json.loads(out), read_run(Path("run")).samples


def refused(hil: Command, mapping: str = "") -> str:
    Path("map.toml").write_text(mapping + TASK, encoding="utf-8")
    status, out, err = hil("import", "log.tlog", "--map", "map.toml", "--out", "run")
    assert (status, out, err.count("\n")) == (2, "", 1)
    assert not Path("run").exists()
    return err


def test_two_vehicles_are_named_and_one_is_taken(hil: Command) -> None:
    """System 1 drives, system 2 stands: refused with both; `system = 1` gives 0.3 m/s."""
    other = [pose_frames(0.05 * k + 0.02, CORNER, link_of(2)) for k in range(200)]
    write([part for pair in zip(drive(), other, strict=True) for part in pair])
    said = refused(hil)
    assert "system 1 component 1 (200), system 2 component 1 (200)" in said
    assert "system = " in said
    assert "comes from" in refused(hil, "system = 3\n")
    _, samples = imported(hil, "system = 1\n")
    assert samples["est_eta1_m_s"] == pytest.approx(np.full(200, 0.3), abs=1e-3)


def test_two_components_are_told_apart(hil: Command) -> None:
    other = [pose_frames(0.05 * k + 0.02, CORNER, link_of(1, 191)) for k in range(200)]
    write([part for pair in zip(drive(), other, strict=True) for part in pair])
    assert "component = 1" in refused(hil)
    _, samples = imported(hil, "component = 1\n")
    assert samples["est_eta1_m_s"] == pytest.approx(np.full(200, 0.3), abs=1e-3)
    assert samples["est_theta_rad"][-1] == pytest.approx(0.5 * 9.95, abs=1e-5)


def test_signals_of_another_vehicle_are_not_taken(hil: Command) -> None:
    """System 2 alone tells its battery and is commanded; system 1 has neither."""
    power = common.MAVLink_sys_status_message(0, 0, 0, 0, 12_000, -1, -1, 0, 0, 0, 0, 0, 0)
    parts = drive()
    for k in range(200):
        parts[k] += pose_frames(0.05 * k, CORNER, link_of(2))
        parts[k] += stamped(0.05 * k, power, link_of(2))
        parts[k] += stamped(0.05 * k, setpoint(target=2), link_of(255))
    write(parts)
    _, samples = imported(hil, "system = 1\n")
    assert np.isnan(samples["battery_v"]).all()
    assert np.isnan(samples["eta1_cmd_m_s"]).all()
    assert np.isnan(samples["omega_cmd_left_rad_s"]).all()


def setpoint(
    frame: int = 8, mask: int = 0, vx: float = 0.25, vy: float = 0.0, rate: float = -0.5,
    target: int = 1,
) -> Any:  # fmt: skip
    return common.MAVLink_set_position_target_local_ned_message(
        0, target, 1, frame, mask, 0, 0, 0, vx, vy, 0, 0, 0, 0, 0, rate
    )


@pytest.mark.parametrize(
    ("frame", "mask", "eta1", "turn"),
    [
        (common.MAV_FRAME_BODY_NED, 0, 0.25, 0.5),
        (common.MAV_FRAME_BODY_OFFSET_NED, 0, 0.25, 0.5),
        (common.MAV_FRAME_BODY_FRD, 0, 0.25, 0.5),
        (common.MAV_FRAME_LOCAL_NED, 0, math.nan, 0.5),
        (common.MAV_FRAME_BODY_NED, 0b111000, math.nan, 0.5),
        (common.MAV_FRAME_BODY_NED, 1 << 11, 0.25, math.nan),
        (common.MAV_FRAME_LOCAL_NED, 0b111111111000, math.nan, math.nan),
    ],
)
def test_set_points_by_frame_and_mask(
    hil: Command, frame: int, mask: int, eta1: float, turn: float
) -> None:
    """Forward speed of the robot's own frames alone; a field to be ignored is empty."""
    command = stamped(0.0, setpoint(frame, mask), link_of(255))
    write([command, *drive(20)])
    document, samples = imported(hil)
    assert samples["eta1_cmd_m_s"][5] == pytest.approx(eta1, nan_ok=True)
    assert samples["theta_dot_cmd_rad_s"][5] == pytest.approx(turn, nan_ok=True)
    told = any("not the robot's own" in note for note in document["notes"])
    assert told == (frame == common.MAV_FRAME_LOCAL_NED and not mask)


def test_a_mask_ends_what_was_commanded_before(hil: Command) -> None:
    """Speed is given for 0.5 s, then a set-point of position only: no speed from there on."""
    link = link_of(255)
    parts = drive(20)
    parts[0] = stamped(0.0, setpoint(), link) + parts[0]
    parts[10] = stamped(0.5, setpoint(mask=0b111000), link) + parts[10]
    write(parts)
    _, samples = imported(hil)
    assert (samples["eta1_cmd_m_s"][:10] == 0.25).all()
    assert np.isnan(samples["eta1_cmd_m_s"][10:]).all()


def test_values_that_say_unknown(hil: Command) -> None:
    """65,535 mV is "not sent", -1 % is too; a value in range is kept."""
    link = link_of(1)
    parts = drive(20)
    for k, millivolts in ((0, 65_535), (10, 11_100)):
        power = common.MAVLink_sys_status_message(0, 0, 0, 0, millivolts, -1, -1, 0, 0, 0, 0, 0, 0)
        parts[k] = stamped(0.05 * k, power, link) + parts[k]
    write(parts)
    _, samples = imported(
        hil, 'columns.pose_quality = { message = "SYS_STATUS", field = "battery_remaining" }\n'
    )
    assert np.isnan(samples["battery_v"][:10]).all()
    assert samples["battery_v"][10:] == pytest.approx(np.full(10, 11.1))
    assert np.isnan(samples["pose_quality"]).all()


@pytest.mark.parametrize(
    ("message", "field", "said"),
    [
        ("BATTERY_STATUS", "voltages", "is an array of 10; name one element"),
        ("BATTERY_STATUS", "voltages[12]", "no such element"),
        ("BATTERY_STATUS", "volts", "has no field 'volts'; it has"),
        ("STATUSTEXT", "text", "is text ('hello')"),
    ],
)
def test_fields_that_are_no_number(hil: Command, message: str, field: str, said: str) -> None:
    cells = common.MAVLink_battery_status_message(0, 0, 0, 0, [3700] + [65_535] * 9, -1, -1, -1, -1)
    text = common.MAVLink_statustext_message(6, b"hello")
    write([*drive(5), stamped(0.3, cells, link_of(1)), stamped(0.3, text, link_of(1))])
    source = f'columns.battery_v = {{ message = "{message}", field = "{field}" }}\n'
    assert said in refused(hil, source)


def test_an_element_of_an_array(hil: Command) -> None:
    cells = common.MAVLink_battery_status_message(0, 0, 0, 0, [3700] + [65_535] * 9, -1, -1, -1, -1)
    write([stamped(0.0, cells, link_of(1)), *drive(5)])
    source = 'columns.battery_v = {{ message = "BATTERY_STATUS", field = "voltages[{}]" }}\n'
    _, samples = imported(hil, source.format(0))
    assert samples["battery_v"][0] == 3700.0


def test_the_clock_of_the_log_was_set_back(hil: Command) -> None:
    """3 s back after 100 poses: message 101 is named; cut keeps 100, none is out of order."""
    link = link_of(1)
    write([
        pose_frames(0.05 * k, arc(0.05 * k), link, 0.05 * k - 3.0 * (k >= 100)) for k in range(200)
    ])  # fmt: skip
    said = refused(hil)
    assert "LOCAL_POSITION_NED no. 101" in said
    assert "falls back by 2.95 s" in said
    document, samples = imported(hil, 'disorder = "cut"\n')
    assert samples["t_s"].size == 100
    assert (np.diff(samples["t_s"]) > 0).all()
    assert samples["est_eta1_m_s"] == pytest.approx(np.full(100, 0.3), abs=1e-3)
    assert any("cut there" in note for note in document["notes"])


@pytest.mark.parametrize("size", [1, 7, 768, 5000])
def test_what_comes_after_a_hole_is_read(hil: Command, size: int) -> None:
    """Garbage over the frames in the middle: every pose outside it is there, the hole is said."""
    data = bytearray(b"".join(drive()))
    noise = np.random.default_rng(7).integers(0, 256, size, dtype=np.uint8).tobytes()
    noise = bytes(0xFD if k % 9 == 8 else b for k, b in enumerate(noise))
    frame = len(data) // 200
    begin = 37 * frame + 5
    data[begin : begin + size] = noise
    Path("log.tlog").write_bytes(data)
    document, samples = imported(hil)
    most_lost = math.ceil((size + 5) / frame) + 1
    assert 200 - most_lost <= samples["t_s"].size < 200 + (size < 8)
    assert samples["t_s"][-1] == pytest.approx(9.95)
    assert any("left out" in note for note in document["notes"])


def test_bytes_put_in_between_cost_nothing(hil: Command) -> None:
    """768 bytes between two frames: all 200 poses, one hole of 768 bytes."""
    parts = drive()
    parts[37] = np.random.default_rng(3).integers(0, 256, 768, dtype=np.uint8).tobytes() + parts[37]
    write(parts)
    document, samples = imported(hil)
    assert samples["t_s"].size == 200
    assert any("1 holes of 768 bytes" in note for note in document["notes"])


def test_a_log_without_frames_is_named(hil: Command) -> None:
    Path("log.tlog").write_bytes(bytes(range(256)) * 40)
    assert "no telemetry frame in it" in refused(hil)


def test_repeated_stamps_make_no_nan(hil: Command) -> None:
    """Each stamp twice: one row each, the others counted."""
    link = link_of(1)
    write([pose_frames(0.05 * k, arc(0.05 * k), link, 0.05 * (k - k % 2)) for k in range(200)])
    document, samples = imported(hil)
    assert samples["t_s"].size == 100
    assert np.isfinite(samples["est_eta1_m_s"]).all()
    assert any("100 of 200 poses have the time" in note for note in document["notes"])
