"""What a campaign leaves on disk: parts while it runs, one Parquet file when it is done.

campaign.json        the campaign with its resolved scenario; tells whether a folder is its own
parts/*.parquet      rows as they came; what is in them need not be run again
results.parquet      all rows in the order of the campaign: a row a run, a column a value
set-aside/           files that could not be read; their rows are run again
"""

from __future__ import annotations

import functools
import json
import math
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from hil import __version__
from hil.core.errors import BadInput, RigFault
from hil.core.figures import BY_NAME
from hil.core.files import PART, replace_file
from hil.record.manifest import git_revision
from hil.study.campaign.merge import (
    Places,
    Results,
    Table,
    group_count,
    is_text,
    read_group,
    write_tables,
)
from hil.study.campaign.plan import Campaign, Job, column_of
from hil.study.work_folder import LOCK, SET_ASIDE, is_new, set_aside

Row = dict[str, Any]
CAMPAIGN, PARTS, RESULTS, PAGE = "campaign.json", "parts", "results.parquet", "report.html"
# Outcome of a run that raised or killed its workers: no answer, and tried again when going on.
ERROR = "error"
_OURS = {CAMPAIGN, PARTS, RESULTS, PAGE, SET_ASIDE, LOCK}
# A part is written after so many rows, or as many seconds as work.py has it.
_PART_ROWS = 2000
_WHOSE = ("index", "outcome")
_DIGEST = b"campaign_sha256"
_COUNTED_ROWS = 1 << 16


@functools.cache
def program() -> str:
    """Return version and source revision of what makes rows in this process."""
    return f"skid-steer-hil {__version__} {git_revision()}".strip()


def schema_of(campaign: Campaign) -> pa.Schema:
    """Return the columns of the results: where, who, how it ended, and every figure."""
    first = dict(campaign.jobs()[0].point)
    fields = [("index", pa.int64())]
    fields += [
        (column_of(name), pa.float64() if _is_number(first[name]) else pa.string())
        for name in campaign.axes
    ]
    fields += [("draw", pa.int64()), ("seed", pa.int64())]
    fields += [(name, pa.string()) for name in ("outer", "inner", "outcome", "detail")]
    fields += [("holds", pa.bool_()), ("t_end_s", pa.float64())]
    own = [name for name in campaign.figures if name not in BY_NAME]
    fields += [(name, pa.float64()) for name in (*BY_NAME, *own)]
    fields += [("program", pa.string())]
    return pa.schema(fields, metadata={"campaign_sha256": campaign.digest})


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


class ResultStore:
    """The folder of one campaign; takes rows and keeps them safe.

    `notes` says in one line each what was found damaged and is made anew.
    """

    def __init__(self, folder: Path, campaign: Campaign) -> None:
        self.folder = folder
        self.notes: list[str] = []
        self._schema = schema_of(campaign)
        self._claim(campaign)
        self._rows: list[Row] = []
        self._runs = len(campaign.jobs())
        self.done = self._places(names=self._schema.names).done

    def _claim(self, campaign: Campaign) -> None:
        """Make the folder, or take up this campaign's own; anything else is refused untouched."""
        path = self.folder / CAMPAIGN
        if not is_new(self.folder, CAMPAIGN):
            digest = self._digest_on_disk()
            if digest is None:
                raise BadInput(
                    f"--out {self.folder}: exists and is neither empty nor a campaign; "
                    "name a new one"
                )
            if digest != campaign.digest:
                raise BadInput(
                    f"--out {self.folder}: is another campaign, or its file or scenario was "
                    "changed since; name a new one"
                )
        try:
            (self.folder / PARTS).mkdir(parents=True, exist_ok=True)
            for leftover in self.folder.rglob(f"*{PART}"):  # cut off while it was written
                leftover.unlink()
            tree = {
                "sha256": campaign.digest,
                "programs": list(dict.fromkeys([*_programs_on_disk(path), program()])),
                "campaign": campaign.file.model_dump(mode="json"),
                "scenario": campaign.base,
            }
            replace_file(path, json.dumps(tree, indent=1).encode() + b"\n")
        except OSError as error:
            raise BadInput(f"--out {self.folder}: cannot be made: {error.strerror}") from None

    def _digest_on_disk(self) -> str | None:
        """Return the SHA-256 of the campaign in the folder, None when it holds none.

        A campaign.json that a crash left damaged is made anew when the rows beside it are ours.
        """
        path = self.folder / CAMPAIGN
        try:
            return str(json.loads(path.read_bytes())["sha256"])
        except (OSError, ValueError, KeyError, TypeError):
            names = {item.name for item in self.folder.iterdir()} if self.folder.is_dir() else {""}
            if not {name.removesuffix(PART) for name in names} <= _OURS:
                return None
        found = self._schema.metadata[_DIGEST].decode() if path.exists() else None
        for file in self._files():
            with suppress(OSError, pa.ArrowException, KeyError, ValueError):
                found = str((pq.read_schema(file).metadata or {})[_DIGEST], "ascii")
        if found is not None:
            self.notes.append(f"{path}: damaged or lost, made anew")
        return found

    def _files(self) -> list[Path]:
        files = [self.folder / RESULTS, *sorted((self.folder / PARTS).glob("*.parquet"))]
        return [file for file in files if file.is_file()]

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
        table = pa.Table.from_pylist(self._rows, self._schema)
        _write(self.folder / PARTS / name, iter([table]), self._schema)
        self._rows.clear()

    def _places(self, names: Sequence[str] = _WHOSE) -> Places:
        """Return where each row on disk is; those columns are read, and so checked.

        A file that cannot be read is set aside and noted: its rows are missing then.
        """
        places = Places(self._runs)
        for file in self._files():
            try:
                found = [self._whose(file, group, names) for group in range(group_count(file))]
                for group, (index, again) in enumerate(found):
                    places.add(file, group, index, again)
            except (OSError, pa.ArrowException, KeyError, ValueError) as error:
                aside = set_aside(file, self.folder)
                self.notes.append(
                    f"{file}: damaged ({str(error).partition(chr(10))[0]}); moved to {aside}, its "
                    "rows are run again"
                )
        return places

    def _whose(
        self, file: Path, group: int, names: Sequence[str]
    ) -> tuple[pa.ChunkedArray, pa.ChunkedArray]:
        """Return the rows' indices, and which are to be run again."""
        table = read_group(file, group, self._schema, names)
        return table.column("index"), is_text(table.column("outcome"), ERROR)

    def finish(self) -> Results:
        """Put all rows into one file and return them; the parts go."""
        self.flush()
        path = self.folder / RESULTS
        _write(path, self._places().tables(self._schema), self._schema)
        for part in (self.folder / PARTS).iterdir():
            part.unlink()
        (self.folder / PARTS).rmdir()
        return Results(path)


def programs(table: Table) -> dict[str, int]:
    """Return the programs that made the rows of a table, and how many each."""
    return dict(_counted(table, ["program"]))


def early_ends(table: Table) -> dict[str, dict[str, Any]]:
    """Return how the runs without figures ended: by outcome their count and commonest cause."""
    ends: dict[str, Counter[str]] = {}
    for (outcome, detail), count in _counted(table, ["outcome", "detail"]).items():
        if outcome != "complete":
            ends.setdefault(outcome, Counter())[detail] += count
    return {
        outcome: {"runs": causes.total(), "commonest_cause": causes.most_common(1)[0][0]}
        for outcome, causes in ends.items()
    }


def _counted(table: Table, names: Sequence[str]) -> Counter[Any]:
    """Return how often each value, or each combination of several, is there, in order of the first."""
    found: Counter[Any] = Counter()
    columns = [table.column(name) for name in names]
    for first in range(0, table.num_rows, _COUNTED_ROWS):
        parts = [column.slice(first, _COUNTED_ROWS).to_pylist() for column in columns]
        found.update(parts[0] if len(parts) == 1 else zip(*parts, strict=True))
    return found


def _programs_on_disk(path: Path) -> list[str]:
    try:
        return [str(name) for name in json.loads(path.read_bytes()).get("programs", [])]
    except (OSError, ValueError, TypeError, AttributeError):
        return []


def _write(path: Path, tables: Iterator[pa.Table], schema: pa.Schema) -> None:
    try:
        write_tables(path, tables, schema)
    except pa.ArrowException as error:
        raise RigFault(
            f"{path}: a part of the rows cannot be read any more ({str(error).partition(chr(10))[0]}); "
            "the same command runs those again"
        ) from None
    except OSError as error:
        raise RigFault(
            f"{path}: cannot be written: {error.strerror or error}; the rows before are kept, the "
            "same command goes on"
        ) from None


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
        **{column_of(name): float(v) if _is_number(v) else str(v) for name, v in job.point},
        "draw": job.draw,
        "seed": job.seed,
        "outer": job.outer,
        "inner": job.inner,
        "outcome": outcome,
        "detail": detail,
        "holds": holds,
        "t_end_s": t_end_s,
        **values,
        "program": program(),
    }
