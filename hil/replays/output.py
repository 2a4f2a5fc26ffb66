"""What `hil replay --out` leaves: the report, and the replayed rows beside their record's name.

It is not a run record: the rows of a shadow hold commands that no robot followed.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hil.core.files import replace_file
from hil.record.journal import write_parquet

if TYPE_CHECKING:
    from hil.replays.exact import ReplayReport


def write_output(folder: Path, report: ReplayReport, document: dict[str, Any]) -> None:
    """Write `document` as replay.json, and replayed.parquet (columns as in samples.parquet)."""
    text = json.dumps(document, indent=1, ensure_ascii=False, allow_nan=False)
    write_parquet(folder / "replayed.parquet", report.samples, report.columns)
    replace_file(folder / "replay.json", text.encode() + b"\n")
