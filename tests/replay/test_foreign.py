"""Logs of other programs become records that compare accepts, with the numbers they had."""

from __future__ import annotations

import csv
import math
import struct
from pathlib import Path

import numpy as np
import pytest
from pymavlink.dialects.v20 import common

from hil.core.errors import BadInput
from hil.record.log_import import import_log
from hil.record.reader import read_run
from hil.record.tlog import read_tlog
from hil.report.compare import compare_runs
from tests.replay.records import record

CSV_MAP = """
scenario = "scenario-1"
set = ["duration_s=2"]
outer = "pid"
t = { column = "time_ms", scale = 0.001 }
[columns]
est_x_m = { column = "X_mm", scale = 0.001 }
est_y_m = { column = "Y_mm", scale = 0.001 }
est_theta_rad = { column = "heading_deg", scale = 0.017453292519943295 }
eta1_cmd_m_s = { column = "v" }
theta_dot_cmd_rad_s = { column = "w" }
"""


def write_csv(path: Path) -> None:
    """Two seconds along a straight line at 0.25 m/s from (-0.5, 0.1) m, heading 0."""
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(["time_ms", "X_mm", "Y_mm", "heading_deg", "v", "w", "remark"])
        for k in range(41):
            writer.writerow([5000 + 50 * k, -500 + 12.5 * k, 100, 0, 0.25, 0, "ok"])


def test_csv_has_its_numbers_and_what_follows_from_them(tmp_path: Path) -> None:
    """Units by the mapping; speed from the pose; wheel commands by the belief: 0.25/0.0482."""
    write_csv(tmp_path / "log.csv")
    (tmp_path / "map.toml").write_text(CSV_MAP, encoding="utf-8")
    import_log(tmp_path / "log.csv", tmp_path / "map.toml", tmp_path / "run", "test")
    run = read_run(tmp_path / "run")
    samples = run.samples
    assert samples["t_s"][[0, -1]].tolist() == [0.0, 2.0]
    assert samples["est_x_m"][0] == -0.5
    assert samples["est_eta1_m_s"] == pytest.approx(np.full(41, 0.25))
    assert samples["omega_cmd_left_rad_s"][5] == pytest.approx(0.25 / 0.0482)
    goal = run.manifest.scenario["reference"]
    assert goal["kind"] == "point"
    # delta1 = z1 - z1*, z1 lies d0 = 30 mm ahead.
    assert samples["delta1_x_m"][0] == pytest.approx(-0.47 - samples["ref_z1_x_m"][0])
    assert math.isnan(samples["pwm_left_counts"][0])
    assert not run.problems


def test_import_is_compared_with_a_run_of_the_twin(tmp_path: Path) -> None:
    """One task: the table stands, and says that the targets differ."""
    write_csv(tmp_path / "log.csv")
    (tmp_path / "map.toml").write_text(CSV_MAP, encoding="utf-8")
    foreign = import_log(
        tmp_path / "log.csv", tmp_path / "map.toml", tmp_path / "run", "test"
    ).record
    own = record(tmp_path / "own", ("duration_s=2",))
    found = compare_runs([own, foreign])
    assert any("target" in line for line in found.warnings)


def test_telemetry_log_of_a_ground_station(tmp_path: Path) -> None:
    """North 1 m, east 2 m, yaw 0 (north) is world (2, 1) m with heading 90 degrees."""
    link = common.MAVLink(None, srcSystem=7)
    frames = []
    for k in range(20):
        stamp = 1_700_000_000_000_000 + 100_000 * k
        for message in (
            common.MAVLink_attitude_message(100 * k, 0, 0, 0.0, 0, 0, 0),
            common.MAVLink_local_position_ned_message(100 * k, 1.0 + 0.02 * k, 2, 0, 0.2, 0, 0),
        ):
            frames.append(struct.pack(">Q", stamp) + message.pack(link))
    (tmp_path / "flight.tlog").write_bytes(b"".join(frames) + b"\0\0torn")
    run = import_log(tmp_path / "flight.tlog", None, tmp_path / "run", "test").record
    assert run.samples["est_x_m"][0] == 2.0
    assert run.samples["est_y_m"][0] == 1.0
    assert run.samples["est_theta_rad"][0] == pytest.approx(math.pi / 2)
    assert run.samples["est_eta1_m_s"][5] == pytest.approx(0.2, abs=1e-3)
    assert run.samples["t_s"][-1] == pytest.approx(1.9)


def test_own_link_log_gives_set_points(tmp_path: Path) -> None:
    """A record's own link.tlog with a pose message beside it: wheel commands are found."""
    own = record(tmp_path / "own", ("duration_s=1",))
    poses = common.MAVLink(None, srcSystem=9)
    data = (own.path / "link.tlog").read_bytes()
    last = 0
    for frame in read_tlog(own.path / "link.tlog"):
        last = frame.unix_us
    for k in range(5):
        for message in (
            common.MAVLink_attitude_message(k, 0, 0, 0.1, 0, 0, 0),
            common.MAVLink_local_position_ned_message(k, 0, 0, 0, 0, 0, 0),
        ):
            data += struct.pack(">Q", last + 1000 * k) + message.pack(poses)
    (tmp_path / "both.tlog").write_bytes(data)
    run = import_log(tmp_path / "both.tlog", None, tmp_path / "run", "test").record
    assert np.isfinite(run.samples["omega_cmd_left_rad_s"]).all()
    assert np.isfinite(run.samples["pwm_left_counts"]).all()


@pytest.mark.parametrize(
    ("mapping", "said"),
    [
        (CSV_MAP.replace("X_mm", "X_cm"), "no column 'X_cm' for est_x_m"),
        (CSV_MAP.replace("est_x_m", "est_xx_m"), "est_xx_m: no such column"),
        (CSV_MAP.replace('outer = "pid"', "outher = 3"), "unknown key 'outher'"),
        (CSV_MAP.replace("est_y_m = {", "delta1_y_m = {"), "gives no est_y_m"),
    ],
)
def test_mistakes_in_a_mapping_are_named(tmp_path: Path, mapping: str, said: str) -> None:
    """One line, and no folder is left."""
    write_csv(tmp_path / "log.csv")
    (tmp_path / "map.toml").write_text(mapping, encoding="utf-8")
    with pytest.raises(BadInput) as refusal:
        import_log(tmp_path / "log.csv", tmp_path / "map.toml", tmp_path / "run", "test")
    assert said in str(refusal.value)
    assert not (tmp_path / "run").exists()
