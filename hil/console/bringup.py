"""Bring-up guided from the page: its process, what it has found so far, and what it asks."""

from __future__ import annotations

import asyncio
import json
import os
import signal
from typing import TYPE_CHECKING, Any

from pydantic import BaseModel, ConfigDict, Field

from hil.config.load import builtin_names
from hil.console.child import begin, ordered, tell
from hil.core.errors import BadInput
from hil.rigs.opening import is_simulated

if TYPE_CHECKING:
    from hil.console.folders import Folders
    from hil.console.people import Message, Page, People

ROBOT_FILE = "robot.toml"


class BringUpOrder(BaseModel):
    """What the page's form says."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    target: str = Field(max_length=400)
    robot: str = Field("thesis-4wd", max_length=400)
    turns: float = Field(10.0, ge=0, le=100)
    floor: bool = False
    ready: bool = False


class BringUps:
    """One bring-up at a time; `busy` while its process is there."""

    def __init__(self, folders: Folders, people: People) -> None:
        self._folders = folders
        self._people = people
        self._process: asyncio.subprocess.Process | None = None
        self._tasks: set[asyncio.Task[None]] = set()
        self._state: Message = {}

    @property
    def busy(self) -> bool:
        """True while a bring-up is on."""
        return self._process is not None

    def state(self) -> Message:
        """Return how it stands."""
        return {"on": self.busy, **self._state}

    def greet(self, page: Page) -> None:
        """Tell a page that has just come how things stand."""
        page.put("bringup", self.state())

    def _tell(self) -> None:
        self._people.tell("bringup", self.state())

    async def start(self, tree: object) -> None:
        """Begin; raises BadInput where one is on, and where nobody says that the robot stands as it must."""
        order = ordered(BringUpOrder, tree, "bring-up")
        if self.busy:
            raise BadInput("a bring-up is on: finish it, or STOP it")
        if is_simulated(order.target) or not order.target.startswith("serial:"):
            raise BadInput("bring-up: needs a port, serial:DEV; a served twin has one too")
        if not order.ready:
            where = (
                "half a metre around the robot is free"
                if order.floor
                else "ALL wheels are off the ground"
            )
            raise BadInput(f"bring-up: say first that {where}")
        robot = order.robot
        if robot not in builtin_names("robots"):
            robot = str(self._folders.work_file(robot, ".toml"))
        self._state = {"checks": [], "ask": None, "floor": order.floor, "driving": ""}
        self._process = await begin("hil.console.bringup_worker", self._folders.work)
        out = str(self._folders.set_up / ROBOT_FILE)
        tell(self._process, order.model_dump() | {"robot": robot, "out": out})
        task = asyncio.get_running_loop().create_task(self._follow(self._process))
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)
        self._tell()

    def answer(self, value: object) -> None:
        """Pass on the answer to what is asked; raises BadInput where nothing is."""
        if not self.busy or self._state.get("ask") is None:
            raise BadInput("bring-up: nothing is asked now")
        if not isinstance(value, str | int | float) or (isinstance(value, str) and len(value) > 40):
            raise BadInput("bring-up: no answer to what was asked")
        self._state["ask"] = None
        tell(self._process, value)
        self._tell()

    def stop(self) -> None:
        """Stop the wheels, and end it."""
        if self._process is not None and self._process.returncode is None:
            os.kill(self._process.pid, signal.SIGINT)

    async def close(self) -> None:
        """Stop what is on and wait for its end."""
        self.stop()
        for task in list(self._tasks):
            await asyncio.wait([task], timeout=15.0)

    async def _follow(self, process: asyncio.subprocess.Process) -> None:
        assert process.stdout is not None
        async for line in process.stdout:
            self._take(json.loads(line))
            self._tell()
        status = await process.wait()
        self._process = None
        self._state |= {"ask": None, "driving": ""}
        if "done" not in self._state and "refused" not in self._state:
            self._state["refused"] = f"its process ended with status {status}"
        self._tell()

    def _take(self, message: Message) -> None:
        if "check" in message:
            self._state["checks"].append(message["check"])
            return
        known: dict[str, Any] = {
            name: message[name]
            for name in ("ask", "driving", "refused", "done", "text")
            if name in message
        }
        if "ask" in message:
            known["driving"] = ""
        if message.get("file"):
            known["file"] = self._folders.name_of(self._folders.set_up / ROBOT_FILE)
        self._state |= known
