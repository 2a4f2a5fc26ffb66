"""The run that is on: its process, what it has said so far, and what the pages are told of it.

Nothing here is in the control loop: that runs in a process of its own (`hil.console.worker`), which
this one starts, reads, and stops.
"""

from __future__ import annotations

import asyncio
import json
import math
import os
import signal
import sys
import time
from array import array
from collections import deque
from typing import Any

import numpy as np

from hil.analysis import metrics
from hil.console.folders import Folders
from hil.console.hand_over import FRAME_LENGTH, HEAD, PICTURE, ROWS
from hil.console.orders import Order, inside
from hil.console.people import Message, Page, People
from hil.console.tuning import Tuning
from hil.core.errors import BadInput

# What a page draws over time, in this order; error and |s| are worked out.
TRAIL = (
    "t_s", "est_x_m", "est_y_m", "est_theta_rad", "true_x_m", "true_y_m", "ref_z1_x_m", "ref_z1_y_m",
    "delta1_x_m", "delta1_y_m", "s_x_m_s2", "s_y_m_s2", "eps_m_s2", "omega_cmd_left_rad_s",
    "omega_cmd_right_rad_s", "omega_meas_left_rad_s", "omega_meas_right_rad_s", "pwm_left_counts",
    "pwm_right_counts",
)  # fmt: skip
NOW = (
    "battery_v", "in_layer", "saturated", "pose_seen", "pose_accepted", "pose_quality",
    "camera_latency_s", "exposure_to_actuation_s", "rtt_s", "clock_sigma_s", "link_lost",
    "eta1_cmd_m_s", "theta_dot_cmd_rad_s", "est_eta1_m_s", "est_theta_dot_rad_s",
)  # fmt: skip
# Who was armed by hand has this long to press Start.
ARMED_S = 30.0
# A second STOP within this time is the same one; later it becomes the emergency stop.
_SAME_STOP_S = 0.5
_JUDGED_EVERY_S = 0.5
_HISTORY_ROWS = 600
_EVENTS = 300


class Live:
    """Starts and stops runs, one at a time, and tells the people of them."""

    def __init__(self, folders: Folders, people: People) -> None:
        self._folders = folders
        self._people = people
        people.in_a_run = lambda: self.busy
        self._spare: asyncio.subprocess.Process | None = None
        self._warming = asyncio.Lock()
        self._tasks: set[asyncio.Task[None]] = set()
        self._process: asyncio.subprocess.Process | None = None
        self._armed_until_s = -math.inf
        self._stop_s = -math.inf
        self._run_id = 0
        self.tuning = Tuning(lambda: self.phase == "running", self._say)
        self.phase = "idle"  # idle, starting, ready (to be armed), running, stopping, ended
        self.order: Order | None = None
        self._forget()

    def _forget(self) -> None:
        self._begin: Message = {}
        self._end: Message = {}
        self._refused = ""
        self._rows: list[np.ndarray[Any, np.dtype[np.float64]]] = []
        self._events: deque[Any] = deque(maxlen=_EVENTS)
        self._requirements: list[Message] = []
        self._judged_s = -math.inf
        self._sigma: list[float] | None = None
        self._misses = 0
        self._picture: bytes | None = None
        self._found: Message = {}
        self.tuning.begin([])

    # -- what a page asks ------------------------------------------------------------------------

    @property
    def busy(self) -> bool:
        """True while a run is on."""
        return self._process is not None

    @property
    def begun(self) -> Message:
        """Return what the run said when it began; empty before."""
        return self._begin

    @property
    def armed(self) -> bool:
        """True while the operator has armed and not started yet."""
        return time.monotonic() < self._armed_until_s

    def arm(self, wanted: bool) -> None:
        """Arm the robot that a run has found; else a simulated run, for ARMED_S, or lay it down."""
        if self.phase == "ready" and wanted:
            self._say(arm=True)
            return
        wanted = wanted and not self.busy
        self._armed_until_s = time.monotonic() + ARMED_S if wanted else -math.inf
        if wanted:
            task = asyncio.get_running_loop().create_task(self.warm())
            self._tasks.add(task)
            task.add_done_callback(self._tasks.discard)
        self.tell()

    def state(self) -> Message:
        """Return everything that a page needs to know of the run, but for its ticks."""
        left_s = max(self._armed_until_s - time.monotonic(), 0.0)
        return {
            "run": self._run_id,
            "phase": self.phase,
            "armed_s": left_s,
            "command": self.order.command() if self.order else "",
            "dead_man": bool(self.order and self.order.dead_man),
            "begin": {k: v for k, v in self._begin.items() if k not in {"names", "frame_names"}},
            "end": self._end,
            "refused": self._refused,
            "found": self._found,
            "tuned": self.tuning.message(),
        }

    def tell(self) -> None:
        """Tell every page."""
        self._people.tell("state", self.state())

    def greet(self, page: Page) -> None:
        """Tell a page that has just come, or was loaded again in mid-run, how things stand."""
        page.put("state", self.state())
        if self._begin:
            page.put("history", self._history())
        if self._picture is not None:
            page.put("picture", self._picture)

    async def warm(self) -> None:
        """Have a process ready that has loaded everything."""
        async with self._warming:
            if self._spare is None or self._spare.returncode is not None:
                self._spare = await self._new_process()

    async def _new_process(self) -> asyncio.subprocess.Process:
        log = (self._folders.own / "worker.log").open("ab")
        try:
            return await asyncio.create_subprocess_exec(
                sys.executable, "-m", "hil.console.worker",
                str(self._folders.root), str(self._folders.work),
                stdin=asyncio.subprocess.PIPE, stdout=asyncio.subprocess.PIPE, stderr=log,
                start_new_session=True,
            )  # fmt: skip
        finally:
            log.close()

    async def start(self, order: Order) -> None:
        """Start a run; raises BadInput while another is on, for files elsewhere, and where it was not armed.

        A real robot is armed later, when it was found: only a simulated one is armed before.
        """
        if self.busy:
            raise BadInput("a run is on: STOP it first, or wait for its end")
        if not self.armed and not order.armed_by_hand:
            raise BadInput("not armed: arm first, then start")
        inside(order, self._folders)
        self._armed_until_s = -math.inf
        self._forget()
        self._run_id += 1
        self.order, self.phase = order, "starting"
        await self.warm()
        process, self._spare = self._spare, None
        assert process is not None
        assert process.stdin is not None
        self._process = process
        process.stdin.write(order.model_dump_json().encode() + b"\n")
        self.tell()
        asyncio.get_running_loop().create_task(self._follow(process))

    def stop(self, who: str) -> None:
        """Stop the robot now; a second press becomes the emergency stop. For operator and viewers."""
        process, now_s = self._process, time.monotonic()
        if process is None or now_s - self._stop_s < _SAME_STOP_S:
            return
        self._stop_s = now_s
        if process.returncode is None:
            os.kill(process.pid, signal.SIGINT)
            self._say(note=f"STOP pressed on the page of {who}")
        self.phase = "stopping"
        self.tell()

    def beat(self) -> None:
        """Pass on that the operator's page is there."""
        if self.order is not None and self.order.dead_man:
            self._say(beat=1)

    def _say(self, **message: Any) -> None:
        process = self._process
        if process is not None and process.stdin is not None and not process.stdin.is_closing():
            process.stdin.write(json.dumps(message).encode() + b"\n")

    async def close(self) -> None:
        """Stop whatever is on and wait until it stands."""
        for process in (self._process, self._spare):
            if process is None or process.returncode is not None:
                continue
            if process is self._process:
                os.kill(process.pid, signal.SIGINT)
            if process.stdin is not None:
                process.stdin.close()
            try:
                await asyncio.wait_for(process.wait(), 15.0)
            except TimeoutError:
                process.kill()

    # -- what the run says -----------------------------------------------------------------------

    async def _follow(self, process: asyncio.subprocess.Process) -> None:
        """Read the run's messages to the end."""
        run = self._run_id
        assert process.stdout is not None
        try:
            while True:
                head = await process.stdout.readexactly(HEAD.size)
                kind, size = HEAD.unpack(head)
                body = await process.stdout.readexactly(size)
                if run == self._run_id:  # else it still writes its report, and another has begun
                    self._take(kind, body)
        except asyncio.IncompleteReadError:
            pass
        status = await process.wait()
        if process is self._process:
            self._refused = f"the run's process ended with status {status}; see worker.log"
            self._over()
            self.tell()
        if process.stdin is not None:
            process.stdin.close()

    def _over(self) -> None:
        """Take note that the robot stands; the process may still have its report to write."""
        self._process, self.phase = None, "ended"

    def _take(self, kind: bytes, body: bytes) -> None:
        if kind == ROWS:
            self._take_rows(np.frombuffer(body, np.float64))
        elif kind == PICTURE:
            self._take_picture(body)
        else:
            self._take_message(json.loads(body))

    def _take_order(self, message: Message) -> bool:
        """Take what came of the operator's orders; return whether it was that."""
        if "found" in message:
            self._found = message["found"]
            self._people.tell("found", self._found)
            if self.phase == "starting":
                self.phase = "ready"
                self.tell()
        elif "armed" in message:
            self.phase = "running" if self.phase == "ready" else self.phase
            self.tell()
        elif "tuned" in message:
            self.tuning.take(message["tuned"])
            self._people.tell("tuned", self.tuning.message())
        elif "said" in message:
            self._people.tell("said", {"error": message["said"]})
        else:
            return False
        return True

    def _take_message(self, message: Message) -> None:
        if self._take_order(message):
            return
        if "begin" in message:
            self._begin = message["begin"]
            self.tuning.begin(self._begin["tunables"])
            if not self._begin["by_hand"] and self.phase == "starting":
                self.phase = "running"
            names = self._begin["names"]
            self._trail_at = [names.index(name) for name in TRAIL]
            self._now_at = {name: names.index(name) for name in NOW}
            self._miss_at = names.index("deadline_miss")
        elif "sigma" in message:
            self._sigma = message["sigma"]
            return
        elif "events" in message:
            self._events.extend(message["events"])
            self._people.tell("live", {"events": message["events"]})
            return
        elif "end" in message:
            self._end = message["end"]
            self._over()
        elif "refused" in message:
            self._refused = message["refused"]
            self._over()
        elif "report" in message:
            self._end = self._end | {"report": message["report"]}
        self.tell()
        if "begin" in message:
            self._people.tell("history", self._history())

    def _take_rows(self, flat: np.ndarray[Any, np.dtype[np.float64]]) -> None:
        rows = flat.reshape(-1, len(self._begin["names"]))
        self._rows.append(rows)
        self._misses += int(np.nansum(rows[:, self._miss_at]))
        self._judge()
        last = rows[-1]
        now = {name: float(last[at]) for name, at in self._now_at.items()}
        self._people.tell(
            "live",
            {
                "run": self._run_id,
                "trail": _rounded(rows[-240:, self._trail_at]),
                "now": now | {"deadline_misses": self._misses},
                "sigma": self._sigma,
                "requirements": self._requirements,
            },
        )

    def _judge(self) -> None:
        """Hold what was seen so far against the requirements, twice a second."""
        now_s = time.monotonic()
        count = sum(len(block) for block in self._rows)
        every_s = _JUDGED_EVERY_S * (1 + count // 10_000)
        if count < 2 or now_s - self._judged_s < every_s:
            return
        self._judged_s = now_s
        table = np.concatenate(self._rows)
        self._rows = [table]
        columns = {name: table[:, at] for at, name in enumerate(self._begin["names"])}
        verdicts = metrics.check(metrics.compute(columns), self._begin["scenario"])
        self._requirements = [item.to_json() | {"text": item.text()} for item in verdicts]

    def _take_picture(self, body: bytes) -> None:
        size = FRAME_LENGTH.unpack_from(body)[0]
        start = FRAME_LENGTH.size
        row = array("d")
        row.frombytes(body[start : start + size])
        names = self._begin["frame_names"]
        seen = {name: row[names.index(name)] for name in names[4:]}
        head = json.dumps({k: v if math.isfinite(v) else None for k, v in seen.items()}).encode()
        self._picture = FRAME_LENGTH.pack(len(head)) + head + body[start + size :]
        self._people.tell("picture", self._picture)

    def _history(self) -> Message:
        """Return the ticks so far, thinned, for a page that comes in mid-run."""
        trail: list[Any] = []
        if self._rows:
            table = np.concatenate(self._rows)
            step = max(len(table) // _HISTORY_ROWS, 1)
            trail = _rounded(table[::step][:, self._trail_at])
        return {
            "run": self._run_id,
            "trail": trail,
            "events": list(self._events),
            "requirements": self._requirements,
        }


def _rounded(rows: np.ndarray[Any, np.dtype[np.float64]]) -> list[list[float]]:
    found: list[list[float]] = np.round(rows, 5).tolist()
    return found


def name_of(page: Page, people: People) -> str:
    """Return how a record names who pressed STOP."""
    return "the operator" if page.key == people.operator else "a viewer"
