"""Exported records, read back by the libraries their readers use."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader
from pyulog import ULog

from hil.record.reader import RunRecord, read_run
from hil.record.schema import SAMPLE_NAMES
from tests.cli.command import hil, run_pose


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> RunRecord:
    """Return a run of half a second."""
    folder = tmp_path_factory.mktemp("export") / "run"
    assert run_pose("--set", "duration_s=0.5", "--out", folder).status == 1
    return read_run(folder)


def exported(run: RunRecord, form: str, tmp_path: Path) -> Path:
    """Export through the command and return the file."""
    file = tmp_path / f"run.{form}"
    done = hil("export", run.path, "--to", form, "--out", file)
    assert (done.status, done.out, done.err) == (0, f"{file}\n", "")
    return file


def test_csv_has_every_number(run: RunRecord, tmp_path: Path) -> None:
    """Bit for bit, empty where there is no value."""
    with exported(run, "csv", tmp_path).open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert tuple(rows[0]) == SAMPLE_NAMES
    for name in SAMPLE_NAMES:
        read = np.array([float(row[name] or "nan") for row in rows])
        np.testing.assert_array_equal(read, run.samples[name], err_msg=name)


def test_mcap_has_signals_poses_and_events_at_their_times(run: RunRecord, tmp_path: Path) -> None:
    """By the package's own reader, with checksums: numbers bit for bit, wall times, schemas."""
    found: dict[str, list[tuple[int, dict[str, object]]]] = {}
    schemas = {}
    with exported(run, "mcap", tmp_path).open("rb") as file:
        for schema, channel, message in make_reader(file, validate_crcs=True).iter_messages():
            assert schema is not None
            schemas[channel.topic] = schema.name
            found.setdefault(channel.topic, []).append((message.log_time, json.loads(message.data)))
    assert schemas["/estimate/pose"] == schemas["/truth/pose"] == "foxglove.PoseInFrame"
    assert schemas["/events"] == "foxglove.Log"
    start_ns = run.manifest.start_unix_us * 1000
    times_ns = [at_ns for at_ns, _ in found["/estimate"]]
    assert times_ns == [start_ns + round(t * 1e9) for t in run.samples["t_s"].tolist()]
    for name in ("est_x_m", "est_theta_rad"):
        assert [row[name] for _, row in found["/estimate"]] == run.samples[name].tolist()
    pwm = run.samples["pwm_left_counts"]
    assert [row["pwm_left_counts"] for _, row in found["/wheels"]] == pwm[np.isfinite(pwm)].tolist()
    assert [row["message"] for _, row in found["/events"]] == [e.text for e in run.events]
    pose = found["/truth/pose"][3][1]["pose"]
    assert pose["position"]["x"] == run.samples["true_x_m"][3]  # type: ignore[index]


def test_ulog_has_the_signals_and_the_pose_of_px4(run: RunRecord, tmp_path: Path) -> None:
    """By pyulog: microseconds since the first tick, north is world Y, heading is clockwise."""
    log = ULog(str(exported(run, "ulog", tmp_path)))
    assert not log.file_corruption
    estimate = log.get_dataset("hil_estimate").data
    assert estimate["timestamp"] == pytest.approx(np.round(run.samples["t_s"] * 1e6), abs=1)
    np.testing.assert_array_equal(estimate["est_x_m"], run.samples["est_x_m"])
    pose = log.get_dataset("vehicle_local_position").data
    np.testing.assert_array_equal(pose["x"], run.samples["est_y_m"])
    np.testing.assert_allclose(pose["heading"], np.pi / 2 - run.samples["est_theta_rad"])


MCAP_MAP = """
[columns]
est_x_m = { message = "/estimate", field = "est_x_m" }
est_y_m = { message = "/estimate", field = "est_y_m" }
est_theta_rad = { message = "/estimate", field = "est_theta_rad" }
eta1_cmd_m_s = { message = "/command", field = "eta1_cmd_m_s" }
theta_dot_cmd_rad_s = { message = "/command", field = "theta_dot_cmd_rad_s" }
"""


@pytest.mark.parametrize(("form", "mapping"), [("ulog", ""), ("mcap", MCAP_MAP)])
def test_there_and_back(run: RunRecord, tmp_path: Path, form: str, mapping: str) -> None:
    """What is exported is imported again: the path and the commands of the run."""
    (tmp_path / "map.toml").write_text(mapping, encoding="utf-8")
    file = exported(run, form, tmp_path)
    done = hil("import", file, "--map", tmp_path / "map.toml", "--out", tmp_path / "again")
    assert done.status == 1, done.err  # as the run: the robot has not arrived
    back = read_run(tmp_path / "again").samples
    names = ("est_x_m", "est_y_m", "est_theta_rad")
    names += ("eta1_cmd_m_s", "theta_dot_cmd_rad_s") if mapping else ()
    for name in names:
        np.testing.assert_allclose(back[name], run.samples[name], atol=1e-9, err_msg=name)


def test_what_cannot_be_exported_is_refused(run: RunRecord, tmp_path: Path) -> None:
    """No record, no folder, no such format: one line, and nothing is written."""
    out = tmp_path / "none" / "x.csv"
    assert "no such folder" in hil("export", tmp_path / "a", "--to", "csv", "--out", out).refusal
    assert "cannot be written" in hil("export", run.path, "--to", "csv", "--out", out).refusal
    assert "'rosbag' is not one of" in hil(
        "export", run.path, "--to", "rosbag", "--out", tmp_path / "x").refusal  # fmt: skip
    assert list(tmp_path.iterdir()) == []
