"""Values of board and law changed in the run that is on, undone, and written to the robot's file."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Sequence
from datetime import datetime
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hil.config.load import builtin_names
from hil.console.orders import inside
from hil.core.errors import BadInput
from hil.core.files import read_toml, replace_file
from hil.core.registries import OUTER_LAWS
from hil.core.text import visible
from hil.runs.orders import BOARD, LAW

if TYPE_CHECKING:
    from hil.console.folders import Folders
    from hil.console.orders import Order

TUNED = "robot-tuned.toml"
_CHANGES = 500


class Tuning:
    """What was changed in the present run; `say` speaks to its process, `running` says whether it is on."""

    def __init__(self, running: Callable[[], bool], say: Callable[..., None]) -> None:
        self._running = running
        self._say = say
        self.begin([])

    def begin(self, tunables: Sequence[dict[str, Any]]) -> None:
        """Forget, and take the values with which a run begins."""
        self._start: dict[str, float] = {item["key"]: item["value"] for item in tunables}
        self.values: dict[str, float] = {}
        self._changes: deque[tuple[str, float, float]] = deque(maxlen=_CHANGES)
        self._undone: set[str] = set()

    def message(self) -> dict[str, Any]:
        """Return what a page is told: values that were changed, as they are now, and the changes in order."""
        return {"values": self.values, "changes": list(self._changes)}

    def take(self, values: dict[str, float]) -> None:
        """Take the values in force now, and note what was changed against before."""
        for key, value in values.items():
            before = self.values.get(key, self._start.get(key, value))
            if key in self._undone:
                self._undone.discard(key)
            elif value != before:
                self._changes.append((key, before, value))
        self.values = values

    def moved(self) -> dict[str, float]:
        """Return the values that are others now than at the start."""
        return {k: v for k, v in self.values.items() if v != self._start.get(k)}

    def change(self, key: str, value: float) -> None:
        """Change a value of board or law; raises BadInput where no run is on."""
        self._require_running()
        if not math.isfinite(value):
            raise BadInput(f"tuning: {visible(key)} = {value}: give a number")
        self._say(set=key, value=value)

    def step(self, x_m: float, y_m: float) -> None:
        """Move the goal, to see the response (world); raises BadInput."""
        self._require_running()
        if not (math.isfinite(x_m) and math.isfinite(y_m)):
            raise BadInput("tuning: a step is two numbers, in metres")
        self._say(step=[x_m, y_m])

    def undo(self) -> None:
        """Take the last change back; raises BadInput where there is none."""
        self._require_running()
        if not self._changes:
            raise BadInput("tuning: nothing was changed")
        key, before, _ = self._changes.pop()
        self._undone.add(key)
        self._say(set=key, value=before)

    def _require_running(self) -> None:
        if not self._running():
            raise BadInput("tuning: values are changed while a run is on and its robot armed")


def write_tuned(
    folders: Folders, order: Order, law: str, gain_set: str, values: dict[str, float]
) -> Path:
    """Write the values to the robot's file of the set-up folder, on the robot that the run had.

    The file has nothing but them, each under the name that a scenario has for it; a file of an earlier tuning
    that the run itself used is gone on with. Raises BadInput.
    """
    place = folders.set_up / TUNED
    board = {k.removeprefix(BOARD): v for k, v in values.items() if k.startswith(BOARD)}
    gains = {k.removeprefix(LAW): v for k, v in values.items() if k.startswith(LAW)}
    base = _robot_of(order, folders)
    tree: dict[str, Any] = {}
    if base == str(place) and place.is_file():
        tree = read_toml(place, "robot file")
        base = str(tree.get("base", ""))
    board = tree.get("board", {}) | board
    tables = {
        (name, key): table
        for name, laws in tree.get("control", {}).get("gains", {}).items()
        for key, table in laws.items()
    }
    own = (gain_set, OUTER_LAWS.get(law).key if gains else "")
    if gains:
        tables[own] = tables.get(own, {}) | gains
    when = f"{datetime.now().astimezone():%Y-%m-%d %H:%M}"
    lines = [f"# Tuned on the rig, {when}; the rest is as in the file below.", f'base = "{base}"']
    if board:
        lines += ["", "[board]", *(f"{name} = {value!r}" for name, value in board.items())]
    for (name, key), table in tables.items():
        lines += ["", f"[control.gains.{name}.{key}]"]
        lines += [f"{gain} = {value!r}" for gain, value in table.items()]
    replace_file(place, ("\n".join(lines) + "\n").encode())
    return place


def _robot_of(order: Order, folders: Folders) -> str:
    """Return the robot that a run had: a file whole, or a built-in name."""
    given = inside(order, folders)
    named = [
        text.partition("=")[2].strip().strip("\"'")
        for text in given.overrides
        if text.partition("=")[0].strip() == "robot.file"
    ]
    found = named[-1] if named else _robot_in(given.scenario, "scenarios")
    return str(Path(found).resolve()) if Path(found).is_file() else found


def _robot_in(name: str, kind: str) -> str:
    """Return the robot that a scenario's file, or one that it lies on, names; raises BadInput."""
    built_in = name in builtin_names(kind)
    path = Path(str(files("hil") / "data" / kind / f"{name}.toml")) if built_in else Path(name)
    tree = read_toml(path, "scenario")
    robot, base = tree.get("robot"), tree.get("base")
    found = robot.get("file") if isinstance(robot, dict) else None
    below = found or base
    if below is None:
        raise BadInput(
            f"{visible(name)}: names no robot file to write beside; name one in its [robot] table"
        )
    if str(below).endswith(".toml"):
        below = str(path.parent / str(below))
    if found:
        return str(below)
    return _robot_in(str(below), "scenarios" if below in builtin_names("scenarios") else "labs")
