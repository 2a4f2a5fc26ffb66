"""What the routes of the console share."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from starlette.requests import Request
from starlette.responses import Response

if TYPE_CHECKING:
    from hil.console.access import Gate
    from hil.console.bringup import BringUps
    from hil.console.cameras import Cameras
    from hil.console.campaigns import Campaigns
    from hil.console.folders import Folders
    from hil.console.listing import Listing
    from hil.console.live import Live
    from hil.console.people import People
    from hil.console.tasks import Tasks


@dataclass(slots=True)
class Console:
    """Everything that the routes share."""

    folders: Folders
    gate: Gate
    people: People
    live: Live
    listing: Listing
    tasks: Tasks
    campaigns: Campaigns
    bringups: BringUps
    cameras: Cameras
    begins_with: tuple[str, str]  # target and camera


Answer = Callable[[Request, Console], Awaitable[Response]]
