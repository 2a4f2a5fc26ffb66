"""The other end of `robot.plant`: lets a class of one's own work out the robot's motion.

    class MyPlant:
        takes = ()                                  # names of loads it knows, from docs/twin.md

        def reset(self, robot, start, dt_s, seed): ...
        def step(self, volts, dt_s, loads): ...      # returns a dict, see docs/own-plant.md

    if __name__ == "__main__":
        serve(MyPlant())

Needs nothing but Python's own library, so that the file may also run where the harness is not installed.
"""

from __future__ import annotations

import json
import os
import socket
import sys
from collections.abc import Iterable, Mapping
from typing import IO, Any, Protocol

PROTOCOL = 1


class ServedPlant(Protocol):
    """What a plant of one's own answers; SI units, frames as in docs/own-plant.md."""

    def reset(
        self, robot: Mapping[str, Any], start: Mapping[str, float], dt_s: float, seed: int
    ) -> None:
        """Put the robot at rest at `start` (x_m, y_m, theta_rad), wheel angles zero."""

    def step(
        self, volts: tuple[float, float], dt_s: float, loads: Mapping[str, float]
    ) -> Mapping[str, float]:
        """Move on by `dt_s` at constant motor voltages (left, right); return the state then."""


def serve(plant: ServedPlant, port: int | None = None) -> None:
    """Answer one run over stdin and stdout, or every run that comes to `port` of this machine."""
    if port is None:
        # What the plant prints goes to stderr: stdout is the wire.
        with os.fdopen(os.dup(1), "wb") as answers:
            os.dup2(2, 1)
            _answer(plant, sys.stdin.buffer, answers)
        return
    with socket.create_server(("127.0.0.1", port)) as server:
        while True:
            connection, _ = server.accept()
            connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            with connection, connection.makefile("rb") as asked, connection.makefile("wb") as said:
                _answer(plant, asked, said)


def _answer(plant: ServedPlant, questions: Iterable[bytes], answers: IO[bytes]) -> None:
    """Answer every line until the other end closes."""
    try:
        for line in questions:
            answers.write(json.dumps(_answer_to(plant, json.loads(line))).encode() + b"\n")
            answers.flush()
    except (BrokenPipeError, ConnectionResetError):
        return


def _answer_to(plant: ServedPlant, question: Mapping[str, Any]) -> Mapping[str, Any]:
    if "hello" in question:
        plant.reset(question["robot"], question["start"], question["dt_s"], question["seed"])
        return {"ready": PROTOCOL, "takes": list(getattr(plant, "takes", ()))}
    left, right = question["volts"]
    loads = dict(question.get("loads", {}))
    if "jam_n_m_s_rad" in question:
        loads["jam_left_n_m_s_rad"], loads["jam_right_n_m_s_rad"] = question["jam_n_m_s_rad"]
    return plant.step((left, right), question["dt_s"], loads)
