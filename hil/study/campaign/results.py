"""What a campaign leaves on disk: parts while it runs, one Parquet file when it is done.

campaign.json        the campaign with its resolved scenario; tells whether a folder is its own
parts/*.parquet      rows as they came; what is in them need not be run again
results.parquet      all rows in the order of the campaign: a row a run, a column a value
"""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from hil.core.errors import BadInput
from hil.core.figures import METRICS
from hil.core.files import replace_file, replacing
from hil.study.campaign.plan import Campaign, Job

Row = dict[str, Any]
CAMPAIGN, PARTS, RESULTS = "campaign.json", "parts", "results.parquet"
_PART_ROWS = 200


def schema_of(campaign: Campaign) -> pa.Schema:
    """Return the columns of the results: where, who, how it ended, and every figure."""
    first = dict(campaign.jobs()[0].point)
    fields = [("index", pa.int64())]
    fields += [
        (name, pa.float64() if _is_number(first[name]) else pa.string()) for name in campaign.axes
    ]
    fields += [("draw", pa.int64()), ("seed", pa.int64())]
    fields += [(name, pa.string()) for name in ("outer", "inner", "outcome", "detail")]
    fields += [("holds", pa.bool_()), ("t_end_s", pa.float64())]
    fields += [(metric.name, pa.float64()) for metric in METRICS]
    return pa.schema(fields, metadata={"campaign_sha256": campaign.digest})


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


class ResultStore:
    """The folder of one campaign; takes rows and keeps them safe."""

    def __init__(self, folder: Path, campaign: Campaign) -> None:
        self.folder = folder
        self._schema = schema_of(campaign)
        self._claim(campaign)
        self._rows: list[Row] = []
        done = self.table()
        self.done: set[int] = set(done.column("index").to_pylist())

    def _claim(self, campaign: Campaign) -> None:
        """Make the folder, or take up this campaign's own; anything else is refused untouched."""
        path = self.folder / CAMPAIGN
        if self.folder.exists() and (not self.folder.is_dir() or any(self.folder.iterdir())):
            try:
                digest = json.loads(path.read_bytes())["sha256"]
            except (OSError, ValueError, KeyError, TypeError):
                raise BadInput(
                    f"--out {self.folder}: exists and is neither empty nor a campaign; "
                    "name a new one"
                ) from None
            if digest != campaign.digest:
                raise BadInput(
                    f"--out {self.folder}: is another campaign, or its file or scenario was "
                    "changed since; name a new one"
                )
        try:
            (self.folder / PARTS).mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise BadInput(f"--out {self.folder}: cannot be made: {error.strerror}") from None
        tree = {
            "sha256": campaign.digest,
            "campaign": campaign.file.model_dump(mode="json"),
            "scenario": campaign.base,
        }
        replace_file(path, json.dumps(tree, indent=1).encode() + b"\n")

    def add(self, row: Row) -> None:
        """Take one row."""
        self._rows.append(row)
        if len(self._rows) >= _PART_ROWS:
            self.flush()

    def flush(self) -> None:
        """Write the rows taken since the last part as a part of their own."""
        if not self._rows:
            return
        name = f"{min(row['index'] for row in self._rows):09d}-{len(self._rows)}.parquet"
        _write(self.folder / PARTS / name, pa.Table.from_pylist(self._rows, self._schema))
        self._rows.clear()

    def table(self) -> pa.Table:
        """Return every row on disk in the order of the campaign, each once."""
        files = [self.folder / RESULTS, *sorted((self.folder / PARTS).glob("*.parquet"))]
        tables = [pq.read_table(file).cast(self._schema) for file in files if file.is_file()]
        whole = pa.concat_tables(tables) if tables else self._schema.empty_table()
        seen: set[int] = set()
        keep = []
        for place, index in enumerate(whole.column("index").to_pylist()):
            if index not in seen:
                seen.add(index)
                keep.append((index, place))
        return whole.take(pa.array([place for _, place in sorted(keep)], pa.int64()))

    def finish(self) -> pa.Table:
        """Put all rows into one file and return them; the parts go."""
        self.flush()
        table = self.table().combine_chunks()
        _write(self.folder / RESULTS, table)
        for part in (self.folder / PARTS).glob("*.parquet"):
            part.unlink()
        (self.folder / PARTS).rmdir()
        return table


def _write(path: Path, table: pa.Table) -> None:
    with replacing(path) as part:
        pq.write_table(table, part, compression="zstd")


def row_of(
    job: Job,
    outcome: str,
    detail: str,
    holds: bool,
    t_end_s: float,
    figures: Sequence[tuple[str, float]],
) -> Row:
    """Return one row; figures that do not exist are null."""
    values = {name: value if math.isfinite(value) else None for name, value in figures}
    return {
        "index": job.index,
        **{name: float(v) if _is_number(v) else str(v) for name, v in job.point},
        "draw": job.draw,
        "seed": job.seed,
        "outer": job.outer,
        "inner": job.inner,
        "outcome": outcome,
        "detail": detail,
        "holds": holds,
        "t_end_s": t_end_s,
        **values,
    }
