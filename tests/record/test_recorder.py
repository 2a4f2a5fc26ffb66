"""The run record is whole after a run, readable after a crash, and the same for the same seed."""

from __future__ import annotations

import json
import math
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

from hil.core.errors import BadInput
from hil.core.types import OuterCommand
from hil.record import manifest as manifest_room
from hil.record.layout import FRAMES_JOURNAL, SAMPLES_JOURNAL
from hil.record.manifest import WRITER_GONE, read_manifest
from hil.record.reader import read_run
from hil.record.recorder import Recorder
from hil.record.schema import SAMPLE_COLUMNS, SAMPLE_NAMES, TRACE_KEYS
from hil.record.tick_rows import COVARIANCE
from hil.runs._native import REACTIONS, RowFormat, Watch
from hil.wire._wire import Link
from tests.record.synthetic import frame_row, make_run, manifest, rows


def test_values_come_back_as_they_were_given(tmp_path):
    """Every value of every row is read back bit for bit, NaN where a signal does not exist."""
    given = rows("pid", 3)
    run = make_run(tmp_path / "run", "pid", 3)
    back = np.column_stack([run.samples[name] for name in SAMPLE_NAMES])
    again = read_run(tmp_path / "run")
    np.testing.assert_array_equal(back, np.array(given, float))
    for name in SAMPLE_NAMES:
        np.testing.assert_array_equal(again.samples[name], run.samples[name])
    assert again.problems == ()
    assert again.manifest.outcome == "complete"
    assert np.isnan(again.samples["s_x_m_s2"]).all()


def test_columns_carry_unit_and_type(tmp_path):
    """samples.parquet has the declared columns, each with its unit, flags as bool, null for NaN."""
    make_run(tmp_path / "run", "pid")
    table = pq.read_table(tmp_path / "run" / "samples.parquet")
    assert table.column_names == list(SAMPLE_NAMES)
    for column in SAMPLE_COLUMNS:
        field = table.schema.field(column.name)
        assert field.metadata[b"unit"].decode() == column.unit
        assert str(field.type) == {"float64": "double"}.get(column.kind, column.kind)
    assert table.column("in_layer").null_count == table.num_rows
    assert table.column("saturated").to_pylist()[0] is True


def test_unit_stands_in_the_name():
    """A column with a unit ends in that unit, so that no reader has to guess it."""
    suffix = {"m": "_m", "s": "_s", "rad": "_rad", "V": "_v", "counts": "_counts", "m/s": "_m_s",
              "m/s^2": "_m_s2", "m/s^3": "_m_s3", "rad/s": "_rad_s", "px": "_px"}  # fmt: skip
    for column in SAMPLE_COLUMNS:
        assert not column.unit or column.name.endswith(suffix[column.unit]), column.name


def test_same_seed_same_file(tmp_path):
    """samples.parquet of two runs with one seed is the same file; another seed gives another."""
    first, second, other = (tmp_path / name for name in ("a", "b", "c"))
    make_run(first, seed=5)
    time.sleep(0.01)
    make_run(second, seed=5)
    make_run(other, seed=6)
    data = [(path / "samples.parquet").read_bytes() for path in (first, second, other)]
    assert data[0] == data[1]
    assert data[0] != data[2]


@pytest.fixture(scope="module")
def journal(tmp_path_factory):
    """Return a folder as a killed process leaves it, with its rows."""
    folder = tmp_path_factory.mktemp("cut") / "run"
    recorder = Recorder(folder, manifest())
    given = rows("asg-ism", 1)
    for index, row in enumerate(given):
        recorder.append(row)
        recorder.frame(frame_row(row[0], index, row))
    recorder.flush()
    return folder, np.array(given, float)


def test_every_cut_leaves_a_readable_prefix(journal, tmp_path):
    """However many bytes reached the disk, exactly the whole rows among them are read."""
    folder, given = journal
    data = (folder / SAMPLES_JOURNAL).read_bytes()
    header = data.index(b"\n") + 1
    width = 8 * len(SAMPLE_NAMES)
    offsets = [header, *range(header + 1, len(data), 997), header + width, header + width - 1]
    copy = tmp_path / "run"
    shutil.copytree(folder, copy)
    for offset in offsets:
        (copy / SAMPLES_JOURNAL).write_bytes(data[:offset])
        run = read_run(copy)
        back = np.column_stack([run.samples[name] for name in SAMPLE_NAMES])
        np.testing.assert_array_equal(back, given[: (offset - header) // width])
        assert "cut off" in run.problems[0]


@pytest.mark.parametrize("offset", [0, 1, 40])
def test_cut_inside_the_header_is_one_clear_line(journal, tmp_path, offset):
    """A journal cut off before its first row is refused with its name, not with a traceback."""
    copy = tmp_path / "run"
    shutil.copytree(journal[0], copy)
    (copy / SAMPLES_JOURNAL).write_bytes((copy / SAMPLES_JOURNAL).read_bytes()[:offset])
    with pytest.raises(BadInput, match=r"samples.journal: cut off before the first row"):
        read_run(copy)


def test_frames_cut_anywhere_never_hide_the_samples(journal, tmp_path):
    """The table of frames may be lost in a crash; the samples are read all the same."""
    copy = tmp_path / "run"
    shutil.copytree(journal[0], copy)
    data = (copy / FRAMES_JOURNAL).read_bytes()
    for offset in (0, 10, 600, len(data) - 3):
        (copy / FRAMES_JOURNAL).write_bytes(data[:offset])
        assert read_run(copy).samples["t_s"].size == len(journal[1])


KILLED = """
import itertools, pathlib, sys
from hil.record.recorder import Recorder
from hil.record.tick_rows import COVARIANCE
from tests.record.synthetic import manifest, rows
recorder = Recorder(pathlib.Path(sys.argv[1]), manifest())
base = rows("asg-ism", 1)
for i in itertools.count():
    row = base[i % len(base)]
    recorder.append((i / 30, *row[1:]))
    recorder.link_frame(i / 30, bytes([0xFD, 0, 0, 0, 0, 255, 190, 0, 0, 0, 1, 2]))
    if i == 3000:
        print("go", flush=True)
"""


def test_killed_process_leaves_its_rows(tmp_path):
    """SIGKILL in mid-write loses at most the last second of run time, and the reader says so."""
    command = [sys.executable, "-c", KILLED, str(tmp_path / "run")]
    root = Path(__file__).resolve().parents[2]
    with subprocess.Popen(command, stdout=subprocess.PIPE, cwd=root) as process:
        process.stdout.readline()
        process.send_signal(signal.SIGKILL)
    run = read_run(tmp_path / "run")
    t_s = run.samples["t_s"]
    assert t_s.size >= 3000 - 30
    np.testing.assert_array_equal(t_s, np.arange(t_s.size) / 30)
    assert (run.manifest.outcome, run.manifest.outcome_detail) == ("fault", WRITER_GONE)
    assert read_manifest(tmp_path / "run") == run.manifest
    assert "cut off" in run.problems[0]


LEFT = """
import os, pathlib, sys
from hil.record.recorder import Recorder
from tests.record.synthetic import manifest
Recorder(pathlib.Path(sys.argv[1]), manifest())
os._exit(0)
"""
READER = """
import pathlib, sys
from hil.record.manifest import read_manifest
print(read_manifest(pathlib.Path(sys.argv[1])).outcome_detail)
"""


def test_two_who_find_at_once_that_the_writer_has_gone_read_the_same(tmp_path, monkeypatch):
    """The first says its end while the second looks: at each step of its looking."""
    root = Path(__file__).resolve().parents[2]
    folders = [tmp_path / name for name in ("exists", "is_left", "alone")]
    for folder in folders:
        subprocess.run([sys.executable, "-c", LEFT, str(folder)], cwd=root, check=True)
    said: list[str] = []

    def behind(name, folder):
        """Let another process read the record just before this step of the reader."""
        step = getattr(manifest_room, name)

        def late(*args):
            monkeypatch.undo()
            done = subprocess.run(
                [sys.executable, "-c", READER, str(folder)],
                cwd=root, capture_output=True, text=True, check=True,
            )  # fmt: skip
            said.append(done.stdout.strip())
            return step(*args)

        monkeypatch.setattr(manifest_room, name, late)

    for folder, name in zip(folders, ("_ended", "is_left", "alone_in"), strict=True):
        behind(name, folder)
        assert read_manifest(folder).outcome_detail == WRITER_GONE
        assert not list(folder.glob("*.part"))
    assert said == [WRITER_GONE] * 3


FORKED = """
import os, pathlib, sys, time
from hil.record.recorder import Recorder
from tests.record.synthetic import manifest
recorder = Recorder(pathlib.Path(sys.argv[1]), manifest())
child = os.fork()
if child:
    print(child, flush=True)
time.sleep(60)
"""


@pytest.mark.skipif(not hasattr(os, "fork"), reason="forks")
def test_a_record_is_not_given_up_while_a_process_of_its_writer_lives(tmp_path):
    """What the killed process had forked may still write: running until that is gone as well."""
    command = [sys.executable, "-c", FORKED, str(tmp_path / "run")]
    root = Path(__file__).resolve().parents[2]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, cwd=root) as process:
        child = int(process.stdout.readline())
        process.send_signal(signal.SIGKILL)
        process.wait()
        assert read_manifest(tmp_path / "run").outcome == "running"
        os.kill(child, signal.SIGKILL)
        process.stdout.read()  # its end of the pipe is closed: it is gone
    assert read_manifest(tmp_path / "run").outcome_detail == WRITER_GONE


def test_a_record_that_is_being_written_is_running_whoever_looks(tmp_path):
    """Looked at by this process and another, it says so; closed, it says how it ended, and holds no lock."""
    recorder = Recorder(tmp_path / "run", manifest())
    look = (
        "import sys; from pathlib import Path; from hil.record.manifest import read_manifest; "
        "print(read_manifest(Path(sys.argv[1])).outcome)"
    )
    command = [sys.executable, "-c", look, str(tmp_path / "run")]
    said = subprocess.run(command, capture_output=True, text=True, check=True).stdout.strip()
    assert said == read_manifest(tmp_path / "run").outcome == "running"
    recorder.close("complete")
    said = subprocess.run(command, capture_output=True, text=True, check=True).stdout.strip()
    assert said == "complete"
    assert not (tmp_path / "run" / ".reserve").exists()


def test_altered_file_is_recognised(tmp_path):
    """One changed value in a finished record is told by name; the rest stays usable."""
    make_run(tmp_path / "run")
    other = make_run(tmp_path / "other", seed=9)
    assert other.problems == ()
    os.replace(tmp_path / "other" / "samples.parquet", tmp_path / "run" / "samples.parquet")
    problems = read_run(tmp_path / "run").problems
    assert len(problems) == 1
    assert problems[0].startswith("samples.parquet")
    (tmp_path / "run" / "link.tlog").unlink()
    assert "link.tlog is missing" in read_run(tmp_path / "run").problems


def test_unfit_folders_are_one_clear_line(tmp_path):
    """Not a folder, not a record, damaged, newer: each refusal names the file and the fault."""
    with pytest.raises(BadInput, match=r"nowhere: no such folder"):
        read_run(tmp_path / "nowhere")
    with pytest.raises(BadInput, match=r"not a run record \(manifest.json is missing\)"):
        read_run(tmp_path)
    folder = tmp_path / "run"
    make_run(folder)
    whole = json.loads((folder / "manifest.json").read_text())
    for text, message in (
        ("{", "damaged, not readable as JSON"),
        ("[1]", "schema_version is missing"),
        (json.dumps(whole | {"schema_version": 99}), "schema_version = 99, this program reads up"),
        (json.dumps(whole | {"seed": "many"}), "damaged: seed: "),
    ):
        (folder / "manifest.json").write_text(text)
        with pytest.raises(BadInput, match=message):
            read_run(folder)


def test_torn_parquet_is_one_clear_line(tmp_path):
    """A Parquet file without its end is refused with its name."""
    make_run(tmp_path / "run")
    path = tmp_path / "run" / "samples.parquet"
    path.write_bytes(path.read_bytes()[:-100])
    with pytest.raises(BadInput, match=r"samples.parquet: damaged, not readable as Parquet"):
        read_run(tmp_path / "run")


def test_output_folder_in_use_is_left_untouched(tmp_path):
    """A folder with anything in it is refused, and nothing is written to it."""
    (tmp_path / "notes.txt").write_text("mine")
    with pytest.raises(BadInput, match="not empty"):
        Recorder(tmp_path, manifest())
    assert [path.name for path in tmp_path.iterdir()] == ["notes.txt"]
    with pytest.raises(BadInput, match="cannot be made"):
        Recorder(tmp_path / "notes.txt" / "run", manifest())


def test_trace_of_a_law_fills_its_columns():
    """Terms land in their columns by name; a law without sliding variables leaves NaN."""
    watch = Watch(
        fence_m=(-1, 1, -1, 1), link_lost_s=1, pose_lost_s=1, stops=[True] * len(REACTIONS),
        note=lambda *_: None, uplink_s=0.0, rad_per_count=0.01,
    )  # fmt: skip
    trace = {"s_x": 1.0, "zeta_m_s2": 2.0, "in_layer": True, "own": 3.0}
    command = OuterCommand(0.25, 0.5, trace)
    row = watch.row(
        RowFormat(TRACE_KEYS, ("own", "other")), Link(), 1000.0, 0.125, None, None, (7.0, 8.0), command,
        (4.0, 5.0), True,
    )  # fmt: skip
    named = dict(zip([*SAMPLE_NAMES, "own", "other"], row, strict=True))
    assert (named["t_s"], named["s_x_m_s2"], named["zeta_m_s2"], named["in_layer"]) == (
        0.125,
        1,
        2,
        1,
    )
    assert (named["ref_z1_x_m"], named["ref_z1_y_m"]) == (7.0, 8.0)
    assert (named["eta1_cmd_m_s"], named["theta_dot_cmd_rad_s"]) == (0.25, 0.5)
    assert (named["omega_cmd_left_rad_s"], named["omega_cmd_right_rad_s"]) == (4.0, 5.0)
    assert (named["own"], named["deadline_miss"], named["pose_seen"], named["link_lost"]) == (
        3,
        1,
        0,
        0,
    )
    unknown = ("s_y_m_s2", "other", "est_x_m", "true_delta1_y_m", "pwm_left_counts", "battery_v")
    assert all(math.isnan(named[name]) for name in unknown)


def test_manifest_of_a_record_without_a_close(journal):
    """From its first instant a record says which run it is."""
    found = read_manifest(journal[0])
    assert (found.outer, found.seed, found.scenario_name) == ("asg-ism", 1, "scenario-1")


def test_a_record_made_before_covariances_were_kept_still_has_its_frames(tmp_path):
    """Without their columns the frames are read all the same, each covariance NaN."""
    whole = make_run(tmp_path / "run")
    file = tmp_path / "run" / "frames.parquet"
    table = pq.read_table(file)
    assert set(COVARIANCE) <= set(table.column_names)
    pq.write_table(table.drop_columns(list(COVARIANCE)), file)
    old = read_run(tmp_path / "run").frames
    assert np.array_equal(old["x_m"], whole.frames["x_m"])
    assert all(np.isnan(old[name]).all() for name in COVARIANCE)
    assert len(old["cov_xx_m2"]) == len(old["x_m"]) > 0
