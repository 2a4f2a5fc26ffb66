"""The process that a run of the console lives in: `python -m hil.console.worker RECORDS WORK`.

It waits for one order on its standard input, runs it as `hil run` does, writes what is to be seen to its
standard output (`hil.console.hand_over`), and ends. STOP is a SIGINT, obeyed as Ctrl-C at a terminal is.
A closed standard input (the console has died) and, where asked for, silence of the operator's page
stop the robot in the same way.
"""

from __future__ import annotations

import json
import os
import select
import signal
import sys
import threading
from collections import deque
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO, NoReturn

from hil.config.fit import board_parameters
from hil.console.folders import Folders
from hil.console.hand_over import HandOver, floor_of
from hil.console.orders import Order, order_of, spec_of
from hil.console.reports import write_report
from hil.core.errors import BadInput, HilError
from hil.core.registries import OUTER_LAWS
from hil.record.layout import MANIFEST
from hil.record.reader import read_run
from hil.record.schema import FRAME_NAMES
from hil.runs.execute import exit_status
from hil.runs.interruption import take_signals
from hil.runs.orders import ARM, OrderSource, change_of, step_of, tunables
from hil.runs.provenance import make_manifest, used_things

if TYPE_CHECKING:
    from hil.record.reader import RunRecord

# The operator's page says four times a second that it is there.
DEAD_MAN_S = 1.0
# A thread that sends does not keep the control loop waiting for longer than this.
_SWITCH_S = 0.0005


class Commands:
    """Reads what the console says while the run is on; the run's own thread never looks here."""

    def __init__(self, source: BinaryIO, hand_over: HandOver, dead_man: bool) -> None:
        self._source = source
        self._hand_over = hand_over
        self._limit_s = DEAD_MAN_S if dead_man else None
        self._ended = False
        self._orders: deque[Any] = deque()
        self.change: Callable[[str, float], Any] = _nothing_yet
        self._rest = b""
        threading.Thread(target=self._listen, name="commands", daemon=True).start()

    def close(self) -> None:
        """Stop nothing any more."""
        self._ended = True

    def _listen(self) -> None:
        descriptor = self._source.fileno()
        while True:
            ready, _, _ = select.select([descriptor], [], [], self._limit_s)
            if not ready:
                self._stop(f"the operator's page was silent for {DEAD_MAN_S:g} s")
                self._limit_s = None
                continue
            data = os.read(descriptor, 65536)
            if not data:
                self._stop("the console has ended")
                return
            *lines, self._rest = (self._rest + data).split(b"\n")
            for line in lines:
                self._take(json.loads(line))

    def _take(self, message: dict[str, Any]) -> None:
        if "note" in message:
            self._hand_over.note("operator", str(message["note"]))
        elif message.get("arm") is True:
            self._orders.append(ARM)
        elif "set" in message or "step" in message:
            try:
                self._orders.append(
                    step_of(*message["step"])
                    if "step" in message
                    else self.change(str(message["set"]), float(message["value"]))
                )
            except BadInput as error:
                self._hand_over.say(said=str(error))

    def take(self) -> list[Any]:
        """Return what was ordered since the last call; the run's thread asks."""
        return [self._orders.popleft() for _ in range(len(self._orders))]

    def _stop(self, why: str) -> None:
        if not self._ended:
            self._hand_over.note("operator", f"stopped: {why}")
            os.kill(os.getpid(), signal.SIGINT)


def _nothing_yet(key: str, _value: float) -> NoReturn:
    raise BadInput(f"{key}: the run has not begun yet")


def main() -> int:
    """Serve one order; the status is that of `hil run`."""
    signal.signal(
        signal.SIGINT, signal.default_int_handler
    )  # a background job begins with it ignored
    take_signals()
    sys.setswitchinterval(_SWITCH_S)
    out = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what a law prints is not part of the messages
    folders = Folders(Path(sys.argv[1]), Path(sys.argv[2]))
    try:
        line = sys.stdin.buffer.raw.readline() if hasattr(sys.stdin.buffer, "raw") else b""
    except KeyboardInterrupt:
        return 130
    if not line:
        return 0
    tree = json.loads(line)
    order = order_of(tree)
    hand_over = HandOver(out, order.real_time and order.simulated)
    commands = Commands(sys.stdin.buffer, hand_over, order.dead_man)
    try:
        record = _run(order, folders, hand_over, commands)
        commands.close()
        hand_over.close()
        hand_over.say(end=end_of(record, folders))
        write_report(folders, [record.path])
        hand_over.say(report=True)
        return exit_status(record)
    except HilError as error:
        hand_over.close()
        hand_over.say(refused=str(error), status=error.exit_status)
        return error.exit_status
    except KeyboardInterrupt:
        hand_over.close()
        hand_over.say(refused="stopped before the robot could move", status=130)
        return 130
    except Exception as error:
        hand_over.close()
        said = " ".join(f"{type(error).__name__}: {error}".split())
        hand_over.say(refused=f"an error of the program itself: {said}", status=3)
        raise


def _run(order: Order, folders: Folders, hand_over: HandOver, commands: Commands) -> RunRecord:
    from hil.runs.execute import execute  # noqa: PLC0415 - beside its first use

    spec = spec_of(order, folders)
    manifest = make_manifest(spec, board_parameters(spec.scenario, spec.inner), used_things(spec))
    known, law = tunables(spec), OUTER_LAWS.get(spec.outer)
    commands.change = lambda key, value: change_of(known, law, key, value)
    hand_over.say(
        begin={
            "record": folders.name_of(spec.out),
            "names": manifest.sample_names,
            "frame_names": FRAME_NAMES,
            "scenario": spec.scenario.model_dump(mode="json"),
            "law": spec.outer,
            "target": spec.target,
            "seed": spec.seed,
            "floor": floor_of(spec.scenario),
            "notes": manifest.notes,
            "by_hand": order.armed_by_hand,
            "tunables": [asdict(item) for item in known.values()],
        }
    )
    try:
        return execute(
            spec, watch=hand_over, orders=OrderSource(commands.take, order.armed_by_hand)
        )
    except KeyboardInterrupt:
        if not (spec.out / MANIFEST).is_file():
            raise
        record = read_run(spec.out)
        if record.manifest.outcome == "running":
            raise
        return record  # pressed again while the record was being closed: it is whole


def end_of(record: RunRecord, folders: Folders) -> dict[str, Any]:
    """Return how a run ended, for the page."""
    return {
        "record": folders.name_of(record.path),
        "outcome": record.manifest.outcome,
        "detail": record.manifest.outcome_detail,
        "status": exit_status(record),
        "requirements": [item.to_json() | {"text": item.text()} for item in record.verdicts()],
        "diagnoses": record.diagnoses(),
    }


if __name__ == "__main__":
    sys.exit(main())
