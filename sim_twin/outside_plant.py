"""A robot whose motion another program works out: `robot.plant` is a file or a port of this machine.

Once a period of the board (4 ms) the program is told the motors' voltages, held over the period, and
answers with pose, speeds and wheel angles at its end: one JSON document a line, both ways
(docs/own-plant.md). Board, link, camera and record stay this program's. Nothing depends on how long an
answer takes, so a program that is deterministic gives runs that are.
"""

from __future__ import annotations

import contextlib
import json
import math
import queue
import re
import socket
import subprocess
import sys
import tempfile
import threading
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any

from hil.core.errors import BadInput, RigFault
from sim_twin import _native

if TYPE_CHECKING:
    from hil.config.robot import RobotConfig
    from hil.core.types import Pose

PROTOCOL = 1
PERIOD_US = 4000  # the board's tick (firmware_arduino/src/core/constants.h)
HELLO_TIMEOUT_S = 60.0  # a physics engine may take long to load
STEP_TIMEOUT_S = 10.0  # a thousand times what an answer should take
_LINE_LIMIT = 65_536
_FASTEST_WHEEL_RAD_S = 1e4
_FASTEST_ROBOT_M_S = 100.0

_WANTED = (
    "x_m",
    "y_m",
    "theta_rad",
    "eta1_m_s",
    "theta_dot_rad_s",
    "wheel_left_rad",
    "wheel_right_rad",
)
_OPTIONAL = (
    "eta2_m_s",
    "omega_left_rad_s",
    "omega_right_rad_s",
    "current_left_a",
    "current_right_a",
)
_X, _Y, _THETA = 0, 1, 2
_SPEEDS_AND_CURRENTS = (3, 4, 5, 6, 7, 10, 11)
State = list[float]


class OutsidePlant:
    """The other program's end of the lockstep; `step` never raises, `fault` says what went wrong.

    After a fault the robot stands where it was, so that the board can still be told to stop.
    """

    def __init__(self, where: str, robot: RobotConfig, start: Pose, seed: int) -> None:
        """Start or reach the program; raises BadInput for a file that is none, else RigFault."""
        self.fault = ""
        self._name = where
        self._lines: queue.Queue[str | None] = queue.Queue()
        self._state: State = [0.0] * len(_native.STATES)
        self._state[_X : _THETA + 1] = start.x_m, start.y_m, start.theta_rad
        self._process: subprocess.Popen[bytes] | None = None
        self._socket: socket.socket | None = None
        self._said: IO[bytes] | None = None
        reading, self._writing = self._connect(where)
        threading.Thread(target=self._read_all, args=(reading,), daemon=True).start()
        try:
            ready = self._greet(robot, start, seed)
        except RigFault:
            self.close()
            raise
        self.takes = frozenset(str(name) for name in ready.get("takes", ()))

    def _connect(self, where: str) -> tuple[IO[bytes], IO[bytes]]:
        if where.startswith("tcp:"):
            host, _, port = where.removeprefix("tcp:").rpartition(":")
            try:
                self._socket = socket.create_connection((host, int(port)), timeout=5.0)
            except OSError as error:
                raise RigFault(
                    f"plant {where}: {error.strerror or error}; start the program that listens there first"
                ) from None
            self._socket.settimeout(None)
            self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            return self._socket.makefile("rb"), self._socket.makefile("wb")
        if not Path(where).is_file():
            raise BadInput(
                f"robot.plant = {where!r}: no such file; docs/own-plant.md has one to start from"
            )
        self._said = tempfile.TemporaryFile()  # noqa: SIM115 - closed in close()
        # A session of its own: Ctrl-C is for this program, which stops the robot and then the plant.
        self._process = subprocess.Popen(
            [sys.executable, where],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._said,
            start_new_session=True,
        )
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        return self._process.stdout, self._process.stdin

    def _read_all(self, reading: IO[bytes]) -> None:
        """Queue every line of the program; None at its end."""
        with contextlib.suppress(OSError, ValueError):
            while line := reading.readline(_LINE_LIMIT):
                self._lines.put(line.decode("utf-8", "replace"))
        self._lines.put(None)

    def _greet(self, robot: RobotConfig, start: Pose, seed: int) -> Mapping[str, Any]:
        ready = self._exchange(
            {
                "hello": PROTOCOL,
                "dt_s": 1e-6 * PERIOD_US,
                "seed": seed,
                "start": {"x_m": start.x_m, "y_m": start.y_m, "theta_rad": start.theta_rad},
                "robot": robot.model_dump(mode="json"),
            },
            HELLO_TIMEOUT_S,
        )
        if ready.get("ready") != PROTOCOL:
            raise RigFault(f'plant {self._name}: answered the hello without "ready": {PROTOCOL}')
        if not isinstance(ready.get("takes", []), list):
            raise RigFault(f'plant {self._name}: "takes" must be a list of names')
        return ready

    def check_takes(self, wanted: Sequence[str]) -> None:
        """Raise BadInput for a load or fault of the scenario that the program does not know."""
        for name in wanted:
            if name not in self.takes:
                known = ", ".join(sorted(self.takes)) or "none"
                raise BadInput(
                    f"plant {self._name}: does not take {name}, which the scenario has; it takes: {known}"
                )

    def step(
        self, t_us: int, volts: Sequence[float], loads: Sequence[float], jam: Sequence[float]
    ) -> State:
        """Return the state one period later, in the order of `_native.STATES`."""
        if not self.fault:
            try:
                self._state = self._asked(1e-6 * t_us, volts, loads, jam)
            except RigFault as fault:
                self.fault = str(fault)
                for index in _SPEEDS_AND_CURRENTS:
                    self._state[index] = 0.0
        return self._state

    def _asked(
        self, t_s: float, volts: Sequence[float], loads: Sequence[float], jam: Sequence[float]
    ) -> State:
        dt_s = 1e-6 * PERIOD_US
        question: dict[str, Any] = {"t_s": t_s, "dt_s": dt_s, "volts": list(volts)}
        acting = {name: load for name, load in zip(_native.LOADS, loads, strict=True) if load}
        if acting:
            question["loads"] = acting
        if any(jam):
            question["jam_n_m_s_rad"] = list(jam)
        answer = self._exchange(question, STEP_TIMEOUT_S)
        return self._checked(answer, t_s, dt_s)

    def _checked(self, answer: Mapping[str, Any], t_s: float, dt_s: float) -> State:
        """Return the state that an answer gives; RigFault for one that no robot can have."""
        when = f"at t = {t_s:.3f} s"
        for name in _WANTED:
            if name not in answer:
                raise RigFault(f"plant {self._name}: its answer {when} has no {name}")
        given: dict[str, float] = {}
        for name in (*_WANTED, *_OPTIONAL):
            value = answer.get(name, 0.0)
            if (
                isinstance(value, bool)
                or not isinstance(value, int | float)
                or not math.isfinite(value)
            ):
                raise RigFault(f"plant {self._name}: answered {name} = {value!r} {when}; a finite number "
                               "is needed")  # fmt: skip
            given[name] = float(value)
        before = dict(zip(_native.STATES, self._state, strict=True))
        turns = round((before["theta_rad"] - given["theta_rad"]) / (2.0 * math.pi))
        given["theta_rad"] += 2.0 * math.pi * turns  # a program may wrap its heading
        for side in ("left", "right"):
            turned = given[f"wheel_{side}_rad"] - before[f"wheel_{side}_rad"]
            if f"omega_{side}_rad_s" not in answer:
                given[f"omega_{side}_rad_s"] = turned / dt_s
            self._not_beyond(
                f"wheel_{side}_rad", turned / dt_s, _FASTEST_WHEEL_RAD_S, "rad/s", when
            )
        for name in ("x_m", "y_m"):
            self._not_beyond(
                name, (given[name] - before[name]) / dt_s, _FASTEST_ROBOT_M_S, "m/s", when
            )
        return [given.get(name, 0.0) for name in _native.STATES]

    def _not_beyond(self, name: str, rate: float, limit: float, unit: str, when: str) -> None:
        if abs(rate) > limit:
            raise RigFault(
                f"plant {self._name}: {name} jumps {when}, at {rate:.3g} {unit} (limit {limit:g} {unit})"
            )

    def _exchange(self, question: Mapping[str, Any], timeout_s: float) -> Mapping[str, Any]:
        try:
            self._writing.write(json.dumps(question, separators=(",", ":")).encode() + b"\n")
            self._writing.flush()
            line = self._lines.get(timeout=timeout_s)
        except (OSError, ValueError):
            line = None
        except queue.Empty:
            raise RigFault(f"plant {self._name}: no answer for {timeout_s:g} s") from None
        if line is None:
            raise RigFault(f"plant {self._name}: {self._ended()}")
        try:
            answer = json.loads(line)
        except ValueError:
            answer = None
        if not isinstance(answer, dict):
            raise RigFault(
                f"plant {self._name}: answered {line.strip()[:60]!r}, which is no JSON object"
            )
        return answer

    def _ended(self) -> str:
        """Say how the program ended, with the last of what it wrote to stderr."""
        if self._process is None or self._said is None:
            return "closed the connection"
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._process.wait(timeout=2.0)
        self._said.seek(0)
        lines = [line.strip() for line in self._said.read().decode("utf-8", "replace").splitlines()]
        last = next((line for line in reversed(lines) if line), "")
        places = [re.search(r'File "(.*)", line (\d+)', line) for line in lines]
        own = [at for at in places if at and Path(at[1]).resolve() == Path(self._name).resolve()]
        where = f"line {own[-1][2]}: " if own else ""
        status = self._process.returncode
        ended = "closed its output" if status is None else f"ended with status {status}"
        if not last and status == 0:
            return f"{ended} and said nothing; a plant's file ends with hil.serve_plant(...)"
        return f"{ended}: {where}{last[:160]}" if last else ended

    def close(self) -> None:
        """End the program, or the connection to it; safe to call twice."""
        with contextlib.suppress(OSError, ValueError):
            self._writing.close()  # the end of its input: a program that serves ends by itself
        if self._socket is not None:
            with contextlib.suppress(OSError):
                self._socket.shutdown(socket.SHUT_RDWR)
            self._socket.close()
        if self._process is not None:
            try:
                self._process.wait(timeout=2.0)
            except subprocess.TimeoutExpired:
                self._process.kill()
                self._process.wait()
        if self._said is not None:
            self._said.close()
