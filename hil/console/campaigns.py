"""Campaigns on the page: started, watched, stopped, and gone on with; each is a `hil sweep` of its own.

What is watched is what the campaign has put on disk, so that one begun at a terminal, or by a console that
was killed, is seen just as well.
"""

from __future__ import annotations

import asyncio
import json
import os
import signal
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hil.console.folders import Folders, confined
from hil.console.people import Page, People
from hil.core.errors import BadInput
from hil.core.text import visible
from hil.study.campaign.plan import column_of
from hil.study.campaign.results import CAMPAIGN, PAGE, PARTS, RESULTS

_LOOK_S = 1.0
_KEPT_CHARACTERS = 4000
_SOURCE = "console.json"  # beside a campaign's own files: which file it was started from


@dataclass(slots=True)
class Going:
    """A campaign that this console has started."""

    process: asyncio.subprocess.Process
    started_s: float
    before: int
    said: str = ""


class Campaigns:
    """The campaigns of the records folder; one of them at most is started from here at a time."""

    def __init__(self, folders: Folders, people: People) -> None:
        self._folders = folders
        self._people = people
        self._going: dict[str, Going] = {}
        self._ended: dict[str, str] = {}

    @property
    def busy(self) -> bool:
        """True while one is on."""
        return bool(self._going)

    async def start(self, campaign: str, folder: Path) -> None:
        """Start one, or go on with it; raises BadInput."""
        if self.busy:
            raise BadInput("a campaign is on: stop it first, or wait for its end")
        process = await asyncio.create_subprocess_exec(
            sys.executable, "-m", "hil", "sweep", campaign, "--out", str(folder), "--json",
            cwd=self._folders.work, stdin=asyncio.subprocess.DEVNULL,
            stdout=asyncio.subprocess.DEVNULL, stderr=asyncio.subprocess.PIPE,
            start_new_session=True,
        )  # fmt: skip
        name = folder.name
        going = Going(process, time.monotonic(), rows_done(folder))
        self._ended.pop(name, None)
        self._going[name] = going
        self._keep_source(name, campaign)
        asyncio.get_running_loop().create_task(self._follow(name, going))

    def _sources(self) -> dict[str, str]:
        try:
            tree = json.loads((self._folders.own / _SOURCE).read_bytes())
            return {str(key): str(value) for key, value in tree.items()}
        except (OSError, ValueError, AttributeError):
            return {}

    def _keep_source(self, name: str, campaign: str) -> None:
        kept = self._sources() | {name: campaign}
        (self._folders.own / _SOURCE).write_text(json.dumps(kept), encoding="utf-8")

    def source_of(self, name: str) -> str:
        """Return the file that a campaign was started from; raises BadInput when it was not from here."""
        source = self._sources().get(name)
        if source is None:
            raise BadInput(
                f"campaign {visible(name)}: was not started here; go on with it by `hil sweep FILE "
                f"--out {self._folders.root / name}`"
            )
        return source

    def stop(self, name: str) -> None:
        """Stop one as Ctrl-C does; what came until then is kept."""
        going = self._going.get(name)
        if going is None:
            raise BadInput(f"campaign {visible(name)}: is not on, or was not started here")
        if going.process.returncode is None:
            os.kill(going.process.pid, signal.SIGTERM)

    async def close(self) -> None:
        """Stop all of them and wait."""
        for name, going in list(self._going.items()):
            self.stop(name)
            try:
                await asyncio.wait_for(going.process.wait(), 20.0)
            except TimeoutError:
                going.process.kill()

    async def _follow(self, name: str, going: Going) -> None:
        reading = asyncio.create_task(self._listen(going))
        while going.process.returncode is None:
            self._people.tell("campaigns", {"items": self.items()})
            try:
                await asyncio.wait_for(going.process.wait(), _LOOK_S)
            except TimeoutError:
                continue
        await reading
        status = going.process.returncode
        lines = going.said.strip().splitlines()
        self._ended[name] = (
            "" if status in {0, 1, 3} else lines[-1] if lines else f"status {status}"
        )
        del self._going[name]
        self._people.tell("campaigns", {"items": self.items()})

    async def _listen(self, going: Going) -> None:
        assert going.process.stderr is not None
        while data := await going.process.stderr.read(4096):
            going.said = (going.said + data.decode(errors="replace"))[-_KEPT_CHARACTERS:]

    def greet(self, page: Page) -> None:
        """Tell a page that has just come."""
        if self._going:
            page.put("campaigns", {"items": self.items()})

    def items(self) -> list[dict[str, Any]]:
        """Return every campaign of the records folder, the newest first."""
        found = [path.parent for path in self._folders.root.glob(f"*/{CAMPAIGN}")]
        found.sort(key=lambda path: path.stat().st_mtime, reverse=True)
        return [self._item(folder) for folder in found[:200]]

    def _item(self, folder: Path) -> dict[str, Any]:
        going = self._going.get(folder.name)
        done = rows_done(folder)
        item: dict[str, Any] = {
            "name": folder.name,
            "on": going is not None,
            "done": done,
            "total": total_rows(folder),
            "finished": (folder / RESULTS).is_file() and (folder / PAGE).is_file(),
            "said": self._ended.get(folder.name, ""),
            "here": folder.name in self._sources(),
        }
        if going is not None:
            took_s = time.monotonic() - going.started_s
            rate = (done - going.before) / took_s if took_s > 0 else 0.0
            left = max(item["total"] - done, 0)
            item |= {"rate_hz": rate, "left_s": left / rate if rate > 0 else None}
        return item


def rows_done(folder: Path) -> int:
    """Return how many rows of a campaign are on disk."""
    import pyarrow.parquet as pq  # noqa: PLC0415 - a tenth of a second, where it is needed

    results = folder / RESULTS
    if results.is_file():
        try:
            return int(pq.read_metadata(results).num_rows)
        except (OSError, ValueError):
            return 0
    counts = [file.stem.rpartition("-")[2] for file in (folder / PARTS).glob("*.parquet")]
    return sum(int(count) for count in counts if count.isdecimal())


def total_rows(folder: Path) -> int:
    """Return how many rows a campaign will have, 0 where it cannot be told."""
    from hil.study.campaign.plan import CampaignFile  # noqa: PLC0415 - beside its one use

    try:
        tree = json.loads((folder / CAMPAIGN).read_bytes())
        file = CampaignFile.model_validate(tree["campaign"])
    except (OSError, ValueError, KeyError, TypeError):
        return 0
    points = 1
    for axis in file.grid.values():
        points *= len(axis) if isinstance(axis, list) else axis.count
    for table in file.together:
        points *= max(len(values) for values in table.values())
    return points * file.draws * file.seeds * len(file.outer) * len(file.inner)


def rows_of(folder: Path) -> dict[str, Any]:
    """Return the axes of a campaign and, for each row so far, its place and whether it held."""
    import pyarrow.parquet as pq  # noqa: PLC0415

    tree = json.loads((folder / CAMPAIGN).read_bytes())["campaign"]
    axes = [*tree.get("grid", {}), *[key for t in tree.get("together", ()) for key in t]]
    axes = (axes or list(tree.get("random", {})))[:2]
    files = (
        [folder / RESULTS]
        if (folder / RESULTS).is_file()
        else sorted((folder / PARTS).glob("*.parquet"))
    )
    rows: list[list[Any]] = []
    for file in files:
        wanted = [*map(column_of, axes), "outer", "holds"]
        table = pq.read_table(file, columns=wanted)
        columns = [table.column(name).to_pylist() for name in wanted]
        rows += [list(row) for row in zip(*columns, strict=True)]
    return {"axes": axes, "rows": rows[:50_000]}


def folder_of(name: object, folders: Folders) -> Path:
    """Return the folder of a campaign by its name; raises BadInput."""
    path = confined(folders.root, str(name))
    if not (path / CAMPAIGN).is_file():
        raise BadInput(f"campaign {visible(str(name))}: there is none of this name")
    return path
