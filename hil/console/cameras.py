"""The camera that the Set-up page looks at: its process, what it shows, and what it is told."""

from __future__ import annotations

import asyncio
import json
import re
from typing import TYPE_CHECKING, Any, Literal

from pydantic import BaseModel, ConfigDict, Field

from hil.config.controls import ControlsConfig
from hil.console.child import begin, ordered, tell
from hil.console.hand_over import HEAD, PICTURE
from hil.console.orders import camera_of
from hil.console.set_up_files import BOARD, CAMERA_FILE, PICTURES, SETS
from hil.core.errors import BadInput
from hil.core.text import visible

if TYPE_CHECKING:
    from hil.console.folders import Folders
    from hil.console.people import Message, Page, People

_NAME = re.compile(r"live-\d{3}\.png|[\w][\w .()+-]{0,118}", re.ASCII)


class Controls(ControlsConfig):
    """What a live camera is set to; None leaves it at what its automatics choose."""

    width_px: int | None = Field(None, ge=64, le=4096)
    height_px: int | None = Field(None, ge=64, le=4096)
    rate_hz: float | None = Field(None, gt=0, le=240)


class Look(BaseModel):
    """Which camera, and what to look for in it."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    source: str = Field(max_length=400)
    find: Literal["board", "tags", "robot", "nothing"] = "nothing"
    board: str = Field("", max_length=60)
    dictionary: str = Field("DICT_4X4_50", max_length=40)
    auto: bool = True
    controls: Controls = Controls()


class Cameras:
    """One camera at a time; pictures are told to every page, the newest only."""

    def __init__(self, folders: Folders, people: People) -> None:
        self._folders = folders
        self._people = people
        self._process: asyncio.subprocess.Process | None = None
        self._tasks: set[asyncio.Task[None]] = set()
        self._state: Message = {}

    def state(self) -> Message:
        """Return how it stands."""
        return {"on": self._process is not None, **self._state}

    def greet(self, page: Page) -> None:
        """Tell a page that has just come how things stand."""
        page.put("camera", self.state())

    def _tell(self) -> None:
        self._people.tell("camera", self.state())

    async def open(self, tree: object) -> None:
        """Look at a camera, in place of what was looked at before; raises BadInput."""
        look = ordered(Look, tree, "camera")
        if not look.source or look.source in {"pose", "rendered"}:
            raise BadInput("camera: name a camera: its number, a video file, or twin:SOCKET")
        source = camera_of(look.source, self._folders)
        if look.find == "board" and not BOARD.fullmatch(look.board):
            raise BadInput(f"camera: board {visible(look.board)}: not understood")
        camera_file = self._folders.set_up / CAMERA_FILE
        if look.find == "robot" and not camera_file.is_file():
            raise BadInput("camera: no camera file yet, so no robot is found; calibrate first")
        folder = self._folders.set_up / PICTURES
        for name in SETS:
            (folder / name).mkdir(parents=True, exist_ok=True)
        await self.close()
        process = await begin("hil.console.camera_worker", self._folders.work)
        self._process = process
        self._state = {"source": look.source, "find": look.find, "auto": look.auto}
        places = {"source": source, "folder": str(folder), "camera_file": str(camera_file)}
        tell(process, look.model_dump() | places)
        task = asyncio.get_running_loop().create_task(self._follow(process))
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)
        self._tell()

    def order(self, tree: dict[str, Any]) -> None:
        """Take or drop a view, take a picture for a step, or let views be taken by themselves."""
        if self._process is None:
            raise BadInput("camera: none is looked at")
        do = tree.get("what")
        if do == "take":
            tell(self._process, {"do": "take"})
        elif do == "drop" and _NAME.fullmatch(str(tree.get("name", ""))):
            tell(self._process, {"do": "drop", "name": str(tree["name"])})
        elif do == "auto":
            self._state["auto"] = bool(tree.get("wanted"))
            tell(self._process, {"do": "auto", "wanted": self._state["auto"]})
        elif do == "picture" and tree.get("set") in SETS[1:]:
            tell(self._process, {"do": "picture", "set": tree["set"]})
        else:
            raise BadInput("camera: not understood")

    async def close(self) -> None:
        """Look no more, and let the camera go."""
        process = self._process
        if process is None:
            return
        if process.stdin is not None:
            process.stdin.close()
        try:
            await asyncio.wait_for(process.wait(), 5.0)
        except TimeoutError:
            process.kill()
        self._over(process)

    async def _follow(self, process: asyncio.subprocess.Process) -> None:
        assert process.stdout is not None
        try:
            while True:
                kind, size = HEAD.unpack(await process.stdout.readexactly(HEAD.size))
                body = await process.stdout.readexactly(size)
                if process is not self._process:
                    continue
                if kind == PICTURE:
                    self._people.tell("camera-picture", body)
                else:
                    self._take(json.loads(body))
        except asyncio.IncompleteReadError:
            pass
        status = await process.wait()
        if process is self._process and status and "refused" not in self._state:
            self._state["refused"] = f"its process ended with status {status}"
        self._over(process)

    def _over(self, process: asyncio.subprocess.Process) -> None:
        if process is self._process:
            self._process = None
            self._tell()

    def _take(self, message: Message) -> None:
        if "picture" in message:
            self._people.tell("picture-taken", {"set": message["picture"]})
            return
        self._state |= message.get("camera", {}) | {
            key: message[key] for key in ("refused",) if key in message
        }
        self._tell()
