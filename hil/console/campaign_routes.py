"""What the Campaigns page asks for."""

from __future__ import annotations

import asyncio
from pathlib import Path
from typing import TYPE_CHECKING

from starlette.requests import Request
from starlette.responses import FileResponse, Response

from hil.config.load import builtin_names
from hil.console.access import REPORT_POLICY
from hil.console.answers import answer_json, body_of
from hil.console.campaigns import folder_of, rows_of
from hil.runs.execute import new_folder
from hil.study.campaign.results import PAGE

if TYPE_CHECKING:
    from hil.console.shared import Answer, Console


async def _list(_request: Request, console: Console) -> Response:
    return answer_json({"items": await asyncio.to_thread(console.campaigns.items)})


async def _map(request: Request, console: Console) -> Response:
    folder = folder_of(request.query_params.get("name", ""), console.folders)
    return answer_json(await asyncio.to_thread(rows_of, folder))


async def _page(request: Request, console: Console) -> Response:
    folder = folder_of(request.query_params.get("name", ""), console.folders)
    return FileResponse(
        folder / PAGE, media_type="text/html; charset=utf-8",
        headers={"Content-Security-Policy": REPORT_POLICY},
    )  # fmt: skip


async def _start(request: Request, console: Console) -> Response:
    name = str((await body_of(request)).get("campaign", ""))
    if name not in builtin_names("campaigns"):
        name = str(console.folders.work_file(name, ".toml"))
    folder = new_folder(f"sweep-{Path(name).stem}", console.folders.root)
    await console.campaigns.start(name, folder)
    return answer_json({"name": folder.name})


async def _stop(request: Request, console: Console) -> Response:
    console.campaigns.stop(str((await body_of(request)).get("name", "")))
    return answer_json({})


async def _go_on(request: Request, console: Console) -> Response:
    folder = folder_of((await body_of(request)).get("name", ""), console.folders)
    await console.campaigns.start(console.campaigns.source_of(folder.name), folder)
    return answer_json({"name": folder.name})


LOOKED_AT: dict[str, Answer] = {
    "/api/campaigns": _list,
    "/api/campaign-map": _map,
    "/api/campaign-report": _page,
}
CHANGED: dict[str, Answer] = {
    "/api/campaign-start": _start,
    "/api/campaign-stop": _stop,
    "/api/campaign-go-on": _go_on,
}
