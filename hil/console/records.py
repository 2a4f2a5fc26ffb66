"""What the Records page asks for: the list, reports, comparisons, replays, exports, the bin."""

from __future__ import annotations

import asyncio
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

from starlette.background import BackgroundTask
from starlette.requests import Request
from starlette.responses import FileResponse, Response

from hil.console.access import REPORT_POLICY
from hil.console.answers import answer_json, body_of, names_of, number
from hil.console.folders import in_bin, out_of_bin, require_closed
from hil.console.listing import Wanted
from hil.console.reports import report_file
from hil.console.tasks import required
from hil.core.errors import BadInput

if TYPE_CHECKING:
    from hil.console.shared import Answer, Console

_PAGE = 100
_MOST = 500
_COMPARED = 24
_SUFFIX = {"csv": ".csv", "mcap": ".mcap", "ulog": ".ulg"}


async def _list(request: Request, console: Console) -> Response:
    asked = request.query_params
    names = ("text", "scenario", "law", "verdict", "since", "until")
    wanted = Wanted(*(asked.get(name, "")[:200] for name in names))
    offset = number(asked.get("offset", ""), 0, 0, 10**8)
    limit = number(asked.get("limit", ""), _PAGE, 1, _MOST)
    return answer_json(await asyncio.to_thread(console.listing.page, wanted, offset, limit))


async def _report(request: Request, console: Console) -> Response:
    """Return the report of one record, or of several side by side."""
    names = request.query_params.getlist("name")
    if not 1 <= len(names) <= _COMPARED:
        raise BadInput(f"report: {len(names)} records; choose 1 to {_COMPARED}")
    file = report_file(console.folders, [console.folders.record(name) for name in names])
    if not file.is_file():
        root = str(console.folders.root)
        required(await console.tasks.module("hil.console.reports", root, *names))
    return FileResponse(
        file, media_type="text/html; charset=utf-8",
        headers={"Content-Security-Policy": REPORT_POLICY},
    )  # fmt: skip


async def _export(request: Request, console: Console) -> Response:
    """Return a record as a file of another format."""
    asked = request.query_params
    record, form = console.folders.record(asked.get("name", "")), asked.get("to", "")
    if form not in _SUFFIX:
        raise BadInput(f"export: to {form!r}: choose {', '.join(_SUFFIX)}")
    folder = tempfile.TemporaryDirectory(prefix="hil-export-")
    file = Path(folder.name) / f"{record.name}{_SUFFIX[form]}"
    try:
        required(await console.tasks.hil("export", str(record), "--to", form, "--out", str(file)))
    except BaseException:
        folder.cleanup()
        raise
    return FileResponse(file, filename=file.name, background=BackgroundTask(folder.cleanup))


async def _replay(request: Request, console: Console) -> Response:
    record = console.folders.record(str((await body_of(request)).get("name", "")))
    said = await console.tasks.hil("replay", str(record))
    return answer_json({"status": said.status, "text": said.out or said.line()})


async def _delete(request: Request, console: Console) -> Response:
    records = [console.folders.record(name) for name in names_of(await body_of(request))]
    on = console.live.state()["begin"].get("record")
    if console.live.busy and on in {console.folders.name_of(record) for record in records}:
        raise BadInput("this run is on: stop it first")
    for record in records:
        require_closed(record, console.folders.name_of(record))
    binned = [in_bin(console.folders.root, record).name for record in records]
    return answer_json({"binned": binned})


async def _restore(request: Request, console: Console) -> Response:
    names = names_of(await body_of(request))
    places = [out_of_bin(console.folders.root, name) for name in names]
    return answer_json({"restored": [console.folders.name_of(place) for place in places]})


LOOKED_AT: dict[str, Answer] = {
    "/api/records": _list,
    "/api/report": _report,
    "/api/export": _export,
}
CHANGED: dict[str, Answer] = {
    "/api/replay": _replay,
    "/api/delete": _delete,
    "/api/restore": _restore,
}
