"""DataFlash, ULog and MCAP become records, through holes, damage and time that falls back."""

from __future__ import annotations

import warnings
from pathlib import Path
from random import Random

import numpy as np
import pytest
from pymavlink.DFReader import DFReader_binary

from hil.core.errors import BadInput
from hil.record.log_import import Imported, import_log, read_log
from hil.record.log_mapping import read_mapping
from hil.record.log_signals import ascending
from tests.cli.command import hil
from tests.replay.topic_logs import KINDS, dataflash, mcap, rows_of, write_log

EVERY = pytest.mark.parametrize("suffix", KINDS)


def imported(log: Path, name: str = "run") -> Imported:
    """Import a log with the mapping beside it."""
    return import_log(log, log.with_suffix(".toml"), log.parent / name, "test")


@EVERY
def test_a_log_has_its_numbers(tmp_path: Path, suffix: str) -> None:
    """An arc of 0.3 m/s and 0.5 rad/s: pose in the world's frame, speeds that follow from it."""
    rows = np.array(rows_of())
    done = hil("import", write_log(tmp_path, suffix, rows.tolist()), "--map", tmp_path / "log.toml",
               "--out", tmp_path / "run", "--json")  # fmt: skip
    assert done.status == 0, done.err
    samples = imported(tmp_path / f"log{suffix}", "again").record.samples
    assert samples["t_s"] == pytest.approx(rows[:, 0], abs=1e-6)
    assert samples["est_x_m"] == pytest.approx(rows[:, 1], abs=1e-6)
    assert samples["est_y_m"] == pytest.approx(rows[:, 2], abs=1e-6)
    assert samples["est_theta_rad"] == pytest.approx(rows[:, 3], abs=1e-4)  # .bin: 0.01 degrees
    assert samples["est_theta_dot_rad_s"][5:-5] == pytest.approx(0.5, abs=5e-3)
    if suffix == ".bin":
        assert samples["eta1_cmd_m_s"] == pytest.approx(0.3)
        assert np.isfinite(samples["theta_dot_cmd_rad_s"]).sum() == 0


def test_dataflash_is_read_as_pymavlink_reads_it(tmp_path: Path) -> None:
    """The same values as its own reader of a whole log, field by field."""
    log = write_log(tmp_path, ".bin", rows_of(20))
    reader = DFReader_binary(str(log), zero_time_base=True)
    theirs = []
    while (message := reader.recv_match(type="XKF1")) is not None:
        if message.C == 0:
            theirs.append((message.TimeUS, message.PE, message.PN, message.Yaw))
    reader.close()
    samples = imported(log).record.samples
    table = np.array(theirs)
    assert samples["est_x_m"] == pytest.approx(table[:, 1])
    assert samples["est_y_m"] == pytest.approx(table[:, 2])
    assert np.sin(samples["est_theta_rad"]) == pytest.approx(np.cos(np.radians(table[:, 3])))


@EVERY
def test_garbage_in_the_middle_is_left_out_and_counted(tmp_path: Path, suffix: str) -> None:
    """300 bytes of noise in place of 900: both ends are there, and a note tells the hole."""
    log = write_log(tmp_path, suffix, rows_of())
    data = log.read_bytes()
    middle = len(data) // 2
    log.write_bytes(data[:middle] + Random(3).randbytes(300) + data[middle + 900 :])
    made = imported(log)
    t_s = made.record.samples["t_s"]
    assert t_s[0] == 0.0
    assert t_s[-1] == pytest.approx(4.95)
    assert 50 < t_s.size < 100
    assert any(note.endswith("left out") and "bytes" in note for note in made.notes), made.notes
    said = [event.text for event in made.record.events if event.kind == "note"]
    assert set(made.notes) <= set(said)


@EVERY
def test_a_log_that_was_cut_off_is_read_to_its_end(tmp_path: Path, suffix: str) -> None:
    """Power gone in mid-write: what is whole is there, what is torn is counted."""
    log = write_log(tmp_path, suffix, rows_of())
    data = log.read_bytes()
    log.write_bytes(data[: len(data) * 2 // 5])
    made = imported(log)
    assert 1.5 < made.record.samples["t_s"][-1] < 2.5
    assert any(note.startswith("the last ") for note in made.notes), made.notes


@EVERY
def test_time_that_falls_back_is_left_out_and_counted(tmp_path: Path, suffix: str) -> None:
    """Ten poses of the past in the middle, five times twice: none of them makes a row."""
    rows = rows_of()
    mixed = [*rows[:50], *rows[20:30], *rows[50:], *[rows[-1]] * 5]
    if suffix == ".ulg":  # the order of writing is not kept by pyulog's writer
        mixed = [*rows, *[rows[-1]] * 5]
    made = imported(write_log(tmp_path, suffix, mixed))
    t_s = made.record.samples["t_s"]
    assert t_s == pytest.approx([row[0] for row in rows], abs=1e-6)
    assert any(note.startswith("5 of ") and "of the one before" in note for note in made.notes)
    if suffix != ".ulg":
        assert any(note.startswith("10 of 115 messages of ") for note in made.notes), made.notes


def test_a_mapping_may_have_time_that_falls_back_refused(tmp_path: Path) -> None:
    """As with the other kinds of log, where it is asked for: one line, and no record."""
    rows = rows_of()
    log = write_log(tmp_path, ".bin", [*rows[:50], *rows[20:30], *rows[50:]])
    log.with_suffix(".toml").write_text(f'disorder = "refuse"\n{KINDS[".bin"]}', encoding="utf-8")
    done = hil("import", log, "--map", log.with_suffix(".toml"), "--out", tmp_path / "run")
    assert "XKF1 no. 51: time falls back by 1.45 s" in done.refusal
    assert not (tmp_path / "run").exists()


@EVERY
def test_a_hole_in_time_is_told(tmp_path: Path, suffix: str) -> None:
    """Two seconds without a pose are said, with where they are."""
    rows = rows_of()
    made = imported(write_log(tmp_path, suffix, [*rows[:40], *rows[80:]]))
    assert any("no pose for 2.05 s from 1.95 s" in note for note in made.notes), made.notes


def damaged(whole: bytes, rng: Random) -> bytes:
    """Return a log with one to five pieces altered, cut out or put in."""
    data = bytearray(whole)
    for _ in range(rng.randint(1, 5)):
        at, size = rng.randrange(len(data)), rng.randint(1, 60)
        match rng.randrange(3):
            case 0:
                data[at] ^= 1 << rng.randrange(8)
            case 1:
                del data[at : at + size]
            case _:
                data[at:at] = rng.randbytes(size)
    return bytes(data)


@EVERY
def test_damaged_logs_are_read_or_refused(tmp_path: Path, suffix: str) -> None:
    """200 damaged logs: no exception but BadInput in one line, no warning, ascending times."""
    rng, log = Random(5), write_log(tmp_path, suffix, rows_of(30))
    whole, settings = log.read_bytes(), read_mapping(log.with_suffix(".toml"))
    read, refused = 0, []
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for _ in range(200):
            log.write_bytes(damaged(whole, rng))
            try:
                t_s = read_log(log, settings).t_s
            except BadInput as refusal:
                refused.append(str(refusal))
                continue
            read += 1
            assert (np.diff(t_s) > 0.0).all()
    assert read > 80
    assert not any("\n" in line for line in refused)


@pytest.mark.parametrize(
    ("suffix", "change", "said"),
    [
        (".mcap", ("position.x", "position.xx"), "no number field 'position.xx' for est_x_m; near: posi"),
        (".mcap", ('"/pose"', '"/poses"'), "has no topic '/poses' for est_x_m; near: /pose"),
        (".mcap", ("[columns]", "[columns]\nest_eta1_m_s = { column = 'v' }"), ""),
        (".bin", ('scenario = "circle"', 'columns.est_x_m = { message = "XKF9", field = "PE" }'), "XKF9"),
    ],
)  # fmt: skip
def test_a_mapping_that_does_not_fit_is_refused(
    tmp_path: Path, suffix: str, change: tuple[str, str], said: str
) -> None:
    """One line with what the log has; a source for another kind of log is no topic's."""
    log = write_log(tmp_path, suffix, rows_of(20))
    mapping = log.with_suffix(".toml")
    mapping.write_text(KINDS[suffix].replace(*change), encoding="utf-8")
    done = hil("import", log, "--map", mapping, "--out", tmp_path / "run")
    if said:
        assert said in done.refusal
    else:
        assert done.status == 0


@pytest.mark.parametrize(("suffix", "said"), [(".bin", "FMT"), (".ulg", "ULog"), (".mcap", "MCAP")])
def test_another_file_is_refused(tmp_path: Path, suffix: str, said: str) -> None:
    """Text under the name of a log."""
    (tmp_path / f"x{suffix}").write_text("t,x,y\n1,2,3\n", encoding="utf-8")
    assert said in hil("import", tmp_path / f"x{suffix}", "--out", tmp_path / "run").refusal


def test_a_log_without_a_pose_lists_its_topics(tmp_path: Path) -> None:
    """An MCAP file without a mapping: what it has is in the line."""
    (tmp_path / "x.mcap").write_bytes(mcap(rows_of(5)))
    line = hil("import", tmp_path / "x.mcap", "--out", tmp_path / "run").refusal
    assert line.endswith("gives est_x_m; topics of the log: /pose")


def test_messages_nobody_can_decode_are_counted(tmp_path: Path) -> None:
    """The topic in an unknown encoding is said with its encoding."""
    made = imported(write_log(tmp_path, ".mcap", rows_of(10)))
    assert "1 messages of topic /blob, encoded as 'secret': left out" in made.notes


def test_an_unchunked_file_is_read_too(tmp_path: Path) -> None:
    """Messages that stand in the file itself."""
    log = write_log(tmp_path, ".mcap", rows_of(10))
    log.write_bytes(mcap(rows_of(10), chunks=False))
    assert imported(log).record.samples["t_s"].size == 10


def test_a_core_of_the_filter_can_be_named(tmp_path: Path) -> None:
    """XKF1[1] is the second core, nine metres off in this log; XKF1 is the first."""
    log = write_log(tmp_path, ".bin", rows_of(20))
    pose = ("x", "PE"), ("y", "PN")
    lines = [f'est_{n}_m = {{ message = "XKF1[1]", field = "{f}" }}' for n, f in pose]
    text = "\n".join([KINDS[".bin"], "[columns]", *lines])
    log.with_suffix(".toml").write_text(text, encoding="utf-8")
    assert imported(log).record.samples["est_x_m"][0] == pytest.approx(9.0)


def test_the_longest_ascending_sequence_is_kept() -> None:
    """By hand: one stamp of the far future does not cost what follows it."""
    assert ascending(np.array([0.0, 1.0, 99.0, 2.0, 2.0, 1.5, 3.0])).tolist() == [0, 1, 3, 4, 6]
    assert ascending(np.array([])).tolist() == []


def test_dataflash_of_several_messages_has_the_formats_it_says() -> None:
    """The negative control of the builder: sizes in FMT are those of the messages."""
    formats, (thr, xkf1, _) = dataflash([])[1:], dataflash(rows_of(1))[3:]
    assert [form[4] for form in formats] == [len(xkf1), len(thr)]
