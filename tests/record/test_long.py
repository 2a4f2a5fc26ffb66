"""Records longer than a row group: written and read in pieces, with the same values and the same bytes."""

from __future__ import annotations

import numpy as np
import pyarrow.parquet as pq
import pytest

from hil.core.errors import BadInput
from hil.record import journal
from hil.record.journal import (
    ColumnsOnDisk,
    Journal,
    journal_to_parquet,
    read_journal,
    read_parquet,
    write_parquet,
)
from hil.record.schema import FRAME_COLUMNS, FRAME_NAMES
from hil.record.writing import Keeping


def written(folder, rows):
    """Write a journal of frames with values missing here and there, and return its path."""
    path = folder / "frames.journal"
    keeping = Keeping(folder)
    writer = Journal(keeping.open(path.name), FRAME_NAMES)
    rng = np.random.default_rng(rows)
    for number in range(rows):
        row = rng.normal(size=len(FRAME_NAMES))
        row[3], row[4] = number, number % 2
        row[rng.integers(5, len(FRAME_NAMES))] = np.nan
        writer.write(row.tolist())
    keeping.close()
    return path


def test_a_table_of_one_group_has_the_bytes_it_always_had(tmp_path):
    """Up to a row group (36 minutes of 30 Hz) the file is that of one write of the whole table."""
    path = written(tmp_path, 500)
    found = journal_to_parquet(path, tmp_path / "pieces.parquet", FRAME_COLUMNS)
    write_parquet(tmp_path / "whole.parquet", read_journal(path), FRAME_COLUMNS)
    assert (tmp_path / "pieces.parquet").read_bytes() == (tmp_path / "whole.parquet").read_bytes()
    assert isinstance(found, dict)


@pytest.mark.parametrize("rows", [199, 200, 201, 1000])
def test_a_longer_table_is_written_in_groups_with_the_same_values(tmp_path, monkeypatch, rows):
    """Whatever the group's size, every value is that of the journal, and no more than one group is held."""
    monkeypatch.setattr(journal, "GROUP_ROWS", 200)
    path = written(tmp_path, rows)
    parquet = tmp_path / "frames.parquet"
    found = journal_to_parquet(path, parquet, FRAME_COLUMNS)
    groups = pq.ParquetFile(parquet).metadata
    sizes = [groups.row_group(i).num_rows for i in range(groups.num_row_groups)]
    assert sum(sizes) == rows
    assert max(sizes) <= 200
    assert isinstance(found, ColumnsOnDisk) == (rows > 200)
    read = read_parquet(parquet)
    assert isinstance(read, ColumnsOnDisk) == (rows > 200)
    for name, values in read_journal(path).items():
        for table in (found, read):
            assert table[name].tobytes() == values.tobytes() or np.isnan(values).any()
            np.testing.assert_array_equal(table[name], values)


def test_an_empty_journal_makes_an_empty_table(tmp_path):
    """A run that never began has a table without rows; a journal cut off in its head has one too."""
    path = written(tmp_path, 0)
    assert all(
        v.size == 0 for v in journal_to_parquet(path, tmp_path / "a", FRAME_COLUMNS).values()
    )
    path.write_bytes(b'{"format": "hil-jour')
    assert journal_to_parquet(path, tmp_path / "b", FRAME_COLUMNS) == {}
    assert pq.ParquetFile(tmp_path / "b").metadata.num_rows == 0
    assert (tmp_path / "a").read_bytes() == (tmp_path / "b").read_bytes()


def test_a_column_that_cannot_be_read_any_more_is_said(tmp_path, monkeypatch):
    """The file of a table on disk is damaged after it was opened: BadInput with its name."""
    monkeypatch.setattr(journal, "GROUP_ROWS", 10)
    parquet = tmp_path / "frames.parquet"
    journal_to_parquet(written(tmp_path, 50), parquet, FRAME_COLUMNS)
    table = read_parquet(parquet)
    with pytest.raises(KeyError):
        table["no_such_column"]
    parquet.write_bytes(parquet.read_bytes()[:100])
    with pytest.raises(BadInput, match=r"frames\.parquet: damaged"):
        table["x_m"]
