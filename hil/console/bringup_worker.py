"""The process that a bring-up of the console lives in: `python -m hil.console.bringup_worker`.

One order on standard input, then the answers to what it asks, a line each; on standard output a JSON line for
each check, each question, and the end. SIGINT, or a closed standard input, stops the wheels and ends it.
"""

from __future__ import annotations

import json
import os
import queue
import signal
import sys
import threading
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hil.config.load import load_robot
from hil.core.errors import BadInput, HilError
from hil.rigs.serial import SerialRig, parse_target
from hil.tools.bringup.procedure import BringUp, plan_for
from hil.tools.bringup.robot_file import check_out, write_robot_file
from hil.tools.bringup.wiring import Seen

if TYPE_CHECKING:
    from hil.tools.bringup.result import Check, Side

_SEEN = {
    "left forward": Seen("left"),
    "left backward": Seen("left", forward=False),
    "right forward": Seen("right"),
    "right backward": Seen("right", forward=False),
    "none": Seen(None),
}


class Page:
    """Somebody at a page who looks at the wheels: asked by a line, answered by a line."""

    def __init__(self) -> None:
        self._out = os.fdopen(os.dup(1), "w", encoding="utf-8")
        os.dup2(2, 1)
        self._answers: queue.Queue[Any] = queue.Queue()

    def listen(self) -> None:
        """Take answers from now on; the end of them is the end of the bring-up."""
        threading.Thread(target=self._listen, name="answers", daemon=True).start()

    def _listen(self) -> None:
        for line in sys.stdin:
            self._answers.put(json.loads(line))
        os.kill(os.getpid(), signal.SIGINT)

    def say(self, **message: Any) -> None:
        """Say one thing."""
        self._out.write(json.dumps(message) + "\n")
        self._out.flush()

    def _ask(self, **question: Any) -> Any:
        while not self._answers.empty():  # pressed twice
            self._answers.get()
        self.say(ask=question)
        while True:  # in short waits, so that a signal is obeyed on every system
            try:
                return self._answers.get(timeout=0.2)
            except queue.Empty:
                continue

    def tell(self, check: Check) -> None:
        """Say how a check came out."""
        self.say(check={name: getattr(check, name) for name in type(check).__slots__})

    def watch(self, text: str) -> None:
        """Say what is about to be driven, and wait until they look."""
        self._ask(what="look", text=text)
        self.say(driving=text)

    def seen(self, driven: Side) -> Seen | None:
        """Ask which wheels turned and which way."""
        return _SEEN.get(str(self._ask(what="seen", side=driven)))

    def turns(self, side: Side, believed: float) -> float | None:
        """Ask for the number of turns counted."""
        told = self._ask(what="turns", side=side, believed=believed)
        return float(told) if isinstance(told, int | float) and told > 0.0 else None


def main() -> int:
    """Do one bring-up; status 0 all passed, 1 a check failed, 2 a wrong order, 3 the rig."""
    page = Page()
    try:
        order = json.loads(sys.stdin.readline())
        page.listen()
        return _run(page, order)
    except HilError as error:
        page.say(refused=str(error))
        return error.exit_status
    except KeyboardInterrupt:
        page.say(refused="stopped; the wheels are off")
        return 130


def _run(page: Page, order: dict[str, Any]) -> int:
    target, robot, out = str(order["target"]), str(order["robot"]), Path(str(order["out"]))
    floor = bool(order["floor"])
    believed = load_robot(robot)
    if not floor:
        check_out(out, robot)
    device, baud = parse_target(target)
    if device.startswith("/") and not Path(device).exists():
        raise BadInput(f"port {device}: no such port; the doctor lists the ports")
    rig = SerialRig(device, baud, None)
    try:
        report = BringUp(
            rig, page, plan_for(believed, float(order["turns"]), floor=floor), page.tell
        ).run()
    finally:
        rig.close()
    when = f"{datetime.now().astimezone():%Y-%m-%d %H:%M} on {target}"
    counts = believed.encoder_counts_per_turn
    written = not floor and write_robot_file(out, robot, counts, report.measured, when)
    page.say(
        done=report.to_json(), file=str(out) if written else "",
        text=out.read_text(encoding="utf-8") if written else "",
    )  # fmt: skip
    return 0 if report.passed else 1


if __name__ == "__main__":
    sys.exit(main())
