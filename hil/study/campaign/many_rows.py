"""A campaign's results, answers and page from rows that nobody ran: how time and memory grow with them.

As a program (`python -m hil.study.campaign.many_rows ROWS`) it does that once in a process of its own, so
that the largest memory it had is known, and prints one line of JSON.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from hil.analysis.speed import peak_memory_mb
from hil.core.figures import METRICS
from hil.study.campaign.findings import documents, outcomes_of
from hil.study.campaign.maps import write_page
from hil.study.campaign.plan import Campaign, column_of, load_campaign
from hil.study.campaign.results import PARTS, ResultStore, early_ends, program, programs, schema_of

ROWS = (10, 1_000, 100_000, 1_000_000)
# As many rows a part as a campaign of short runs writes at a time.
_PART_ROWS = 2000


def campaign_of(rows: int) -> Campaign:
    """Return the built-in campaign `limits` with more or fewer seeds, so that it has about so many runs."""
    whole = load_campaign("limits")
    points, arms = len(whole.grid_points()), len(whole.file.outer) * len(whole.file.inner)
    changes: dict[str, Any] = {"seeds": max(1, round(rows / (points * arms)))}
    if rows < points * arms:
        axis, values = next(iter(whole.file.grid.items()))
        assert isinstance(values, list)
        changes = {"grid": {axis: values[:1]}, "seeds": max(1, rows // arms)}
    return Campaign(whole.file.model_copy(update=changes), whole.base)


def write_parts(folder: Path, campaign: Campaign) -> int:
    """Write rows as workers would have, with figures drawn by number; return how many."""
    jobs, schema = campaign.jobs(), schema_of(campaign)
    rng = np.random.default_rng(1)
    for first in range(0, len(jobs), _PART_ROWS):
        some = jobs[first : first + _PART_ROWS]
        count = len(some)
        points = [dict(job.point) for job in some]
        columns = {
            **{column_of(axis): [float(point[axis]) for point in points] for axis in campaign.axes},
            **{name: [getattr(job, name) for job in some]
               for name in ("index", "draw", "seed", "outer", "inner")},
            "outcome": ["complete"] * count,
            "detail": [""] * count,
            "holds": rng.random(count) < 0.9,
            "t_end_s": np.full(count, 10.0),
            **{metric.name: rng.random(count) for metric in METRICS},
            "program": [program()] * count,
        }  # fmt: skip
        table = pa.table({name: columns[name] for name in schema.names}, schema=schema)
        name = f"{first:09d}-{count}.parquet"
        pq.write_table(table, folder / PARTS / name, compression="zstd", write_page_checksum=True)
    return len(jobs)


def measured(rows: int) -> dict[str, float]:
    """Return seconds for putting rows together and for answers and page, and the memory that took."""
    campaign = campaign_of(rows)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        store = ResultStore(folder, campaign)
        count = write_parts(folder, campaign)
        start_s = time.process_time()
        results = store.finish()
        merged_s = time.process_time()
        early_ends(results), programs(results)
        outcomes = outcomes_of(campaign, results)
        list(documents(outcomes))
        write_page(folder / "page.html", outcomes, "hil bench report")
        end_s = time.process_time()
    return {
        "rows": count,
        "merge_s": merged_s - start_s,
        "report_s": end_s - merged_s,
        "peak_mb": peak_memory_mb(),
    }


def measured_apart(rows: int) -> dict[str, float]:
    """Return what `measured` does, from a process of its own."""
    command = [sys.executable, "-m", "hil.study.campaign.many_rows", str(rows)]
    done = subprocess.run(command, check=True, capture_output=True, text=True)
    found: dict[str, float] = json.loads(done.stdout)
    return found


if __name__ == "__main__":
    print(json.dumps(measured(int(sys.argv[1]))))
