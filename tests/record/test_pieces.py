"""Figures and the viewer's file of a table too long to be held: the same as of the whole."""

from __future__ import annotations

import math
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

from hil.analysis import metrics, pieces
from hil.analysis.metrics import LinkStats
from hil.analysis.sliding import LawFacts
from hil.record import journal, rrd
from hil.record.journal import ColumnsOnDisk, arrow_table
from hil.record.memory import Rows
from tests.record.synthetic import make_run

FACTS = LawFacts(alpha_m_s3=2.0, d0_m=0.05, accel_max_m_s2=0.7)


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """One whole run of the law that has every figure."""
    return make_run(tmp_path_factory.mktemp("run") / "one", "asg-ism", images=False, rerun=False)


def on_disk(run, folder, rows):
    """Return the run's samples in row groups of so many rows."""
    path = folder / "samples.parquet"
    table = arrow_table(run.samples, run.manifest.sample_columns)
    journal.pq.write_table(table, path, row_group_size=rows)
    return ColumnsOnDisk(path)


@pytest.mark.parametrize("rows", [7, 32, 50])
def test_figures_in_pieces_are_those_of_the_whole(run, tmp_path, monkeypatch, rows):
    """Every figure, from memory and from disk bit for bit alike, and as good as from one piece."""
    whole = metrics.compute(run.samples, LinkStats(3, 2, 1), FACTS).values
    monkeypatch.setattr(pieces, "PIECE_ROWS", rows)
    table = on_disk(run, tmp_path, rows)
    assert pieces.row_count(table) == run.samples["t_s"].size > 2 * rows
    disk = metrics.compute(table, LinkStats(3, 2, 1), FACTS).values
    memory = metrics.compute(run.samples, LinkStats(3, 2, 1), FACTS).values
    assert disk.keys() == whole.keys()
    for name, value in whole.items():
        assert np.array(disk[name]).tobytes() == np.array(memory[name]).tobytes(), name
        assert disk[name] == pytest.approx(value, rel=1e-12, nan_ok=True), name
    assert sum(math.isfinite(value) for value in whole.values()) > 20


@pytest.mark.parametrize("count", [1, 2, 5, 6, 301])
@pytest.mark.parametrize("special", [None, math.inf, -0.0, math.nan])
def test_medians_of_a_piece_are_those_of_numpy(count, special):
    """Bit for bit, in one array or in two; unknown where one value is."""
    values = np.round(np.random.default_rng(count).normal(size=count), 1)
    values[count // 2] = values[count // 2] if special is None else special
    expected = np.float64(np.median(values)).tobytes()
    for parts in ([values], [values[:1], values[1:]]):
        found = np.float64(pieces.median(lambda parts=parts: iter(parts)))
        assert found.tobytes() == expected or np.isnan([found, np.median(values)]).all()
    assert math.isnan(pieces.median(lambda: iter([np.empty(0)])))


@pytest.mark.parametrize("seed", range(6))
def test_percentiles_of_pieces_are_those_of_numpy(monkeypatch, seed):
    """Bit for bit: of either sign, of equal values, of zeros with signs, with some unknown."""
    rng = np.random.default_rng(seed)
    values = rng.normal(size=1000) * 10.0 ** rng.integers(-12, 12, 1000)
    if seed % 2:
        values = np.round(values)  # many equal ones, and -0.0
    values[rng.integers(0, 1000, 40)] = math.nan
    parts = np.array_split(values, 9)
    monkeypatch.setattr(pieces, "PIECE_ROWS", 50)
    asked = [0, 1, 37.5, 50, 90, 99, 100]
    found = pieces.percentiles(lambda: iter(parts), asked)
    assert found == np.percentile(values[np.isfinite(values)], asked).tolist()
    assert math.isnan(pieces.percentiles(lambda: iter([np.full(3, math.nan)]), [50])[0])


def test_pieces_overlap_by_what_is_asked(monkeypatch):
    """Each after the first begins with the rows before it, so that differences miss none."""
    monkeypatch.setattr(pieces, "PIECE_ROWS", 4)
    columns = {"t_s": np.arange(10.0)}
    found = [part["t_s"].tolist() for part in pieces.pieces(columns, ["t_s"], before=1)]
    assert found == [[0, 1, 2, 3], [3, 4, 5, 6, 7], [7, 8, 9]]
    assert sum(np.diff(part).sum() for part in found) == 9.0


def test_the_viewer_s_file_is_written_in_pieces(run, tmp_path, monkeypatch):
    """Rerun verifies it, and it has as many rows as that written at once."""

    def counted(path):
        command = [sys.executable, "-m", "rerun", "rrd"]
        subprocess.run([*command, "verify", path], check=True, capture_output=True)
        told = subprocess.run([*command, "stats", path], check=True, capture_output=True, text=True)
        return next(line for line in told.stdout.splitlines() if line.startswith("num_rows ="))

    rrd.write_rrd(tmp_path / "whole.rrd", [run])
    monkeypatch.setattr(pieces, "PIECE_ROWS", 100)
    long = replace(run, samples=on_disk(run, tmp_path, 100))
    written = []
    put = rrd._Sender._send
    monkeypatch.setattr(
        rrd._Sender, "_send", lambda *call: (written.append(len(call[2])), put(*call))[1]
    )
    rrd.write_rrd(tmp_path / "pieces.rrd", [long])
    assert max(written) <= 100 < sum(written)
    assert counted(tmp_path / "pieces.rrd") == counted(tmp_path / "whole.rrd")


def test_rows_in_memory_are_a_typed_table():
    """Eight bytes a value, rows by place, columns by name; a row of another width is refused."""
    rows = Rows(3)
    assert rows.columns("abc")["b"].size == 0
    for k in range(5):
        rows.append((k, True, math.nan))
    assert len(rows) == 5
    assert list(rows[-1])[:2] == [4.0, 1.0]
    assert rows.columns("abc")["a"].tolist() == [0.0, 1.0, 2.0, 3.0, 4.0]
    with pytest.raises(ValueError, match="2 values, the table has 3 columns"):
        rows.append((1.0, 2.0))
    with pytest.raises(IndexError):
        rows[5]
