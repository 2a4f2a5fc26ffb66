"""`hil bringup` over a pseudo-terminal in real time, and its bad usage."""

from __future__ import annotations

import json
import threading
import time

import pytest
from click.testing import CliRunner

from hil.cli.bringup import Person, command
from hil.config.events import Fault
from hil.core.errors import BadInput, RigFault
from hil.tools.bringup import measure
from hil.tools.bringup.wiring import Seen
from hil.tools.serve_twin import TwinServer
from tests.bringup.rigs import SPEEDS, lifted

pytestmark = pytest.mark.realtime


@pytest.fixture
def served(tmp_path):
    """Return a function that serves a twin from a thread and gives its port."""
    stop = threading.Event()
    threads = []

    def serve(twin) -> str:
        server = TwinServer(twin, tmp_path / "board", tmp_path / "camera")

        def run():
            while not stop.is_set():
                server.run(time.monotonic() + 0.05)
            server.close()

        threads.append(threading.Thread(target=run))
        threads[0].start()
        return f"serial:{tmp_path / 'board'}"

    yield serve
    stop.set()
    threads[0].join()


def test_planted_faults_are_found_through_a_pseudo_terminal(served, monkeypatch, tmp_path):
    """Swapped phases left, a dead encoder right, somebody answering: both named, status 1."""
    monkeypatch.setattr(measure, "_LOOK_S", 2.2)  # real time: up to 45 % duty and a bit
    monkeypatch.setattr(measure, "_LOOK_HOLD_S", 0.2)
    twin = lifted(
        Fault(kind="swapped_phases", side="left"), Fault(kind="dead_encoder", side="right")
    )
    out = tmp_path / "robot.toml"
    arguments = ["--on", served(twin), "--json", "--out", str(out)]
    answers = "y\n\nlf\n\nrf\n"
    run = CliRunner().invoke(command, arguments, input=answers, standalone_mode=False)
    document = json.loads(run.stdout)
    assert run.return_value == 1
    assert not document["passed"]
    failed = [(c["name"], c["fault"]) for c in document["checks"] if c["state"] == "fail"]
    assert failed == [("left encoder", "swapped_phases"), ("right encoder", "dead_encoder")]
    assert "FAIL  left encoder" in run.stderr
    assert not out.exists()
    assert max(abs(twin._kernel.state()[i]) for i in SPEEDS) < 0.05


def test_nobody_to_answer_is_bad_input(tmp_path):
    """No terminal and no --yes: one line, nothing opened, nothing moved."""
    (tmp_path / "port").touch()
    run = CliRunner().invoke(command, ["--on", f"serial:{tmp_path}/port"], input="")
    assert isinstance(run.exception, BadInput)
    assert "--yes" in str(run.exception)


def test_wheels_on_the_ground_end_it(tmp_path):
    """Any answer but yes: status 2 before the port is opened."""
    (tmp_path / "port").touch()
    run = CliRunner().invoke(command, ["--on", f"serial:{tmp_path}/port"], input="n\n")
    assert run.exit_code == 2
    assert "nothing was moved" in run.stderr


def test_the_twin_is_tried_through_its_port():
    """A simulated target is no port: the line says how the twin is brought up."""
    run = CliRunner().invoke(command, ["--on", "twin", "--yes"])
    assert isinstance(run.exception, BadInput)
    assert "hil twin serve --set robot.variant=lifted" in str(run.exception)


@pytest.mark.parametrize("more", [["--yes"], []])
def test_a_port_that_is_not_there_is_a_rig_fault(more):
    """Status 3's error names the port, before any question is asked."""
    run = CliRunner().invoke(command, ["--on", "serial:/dev/none", *more], input="")
    assert isinstance(run.exception, RigFault)
    assert "/dev/none" in str(run.exception)
    assert "[y/N]" not in run.stderr


def test_an_answer_that_is_none_is_said(monkeypatch, capsys):
    """An empty line and a word that is no answer: what can be typed is named, and asked again."""
    answers = iter(["", "left", "lb"])
    monkeypatch.setattr("builtins.input", lambda: next(answers))
    assert Person().seen("left") == Seen("left", forward=False)
    said = capsys.readouterr().err
    assert "an empty line is none of them; type one of lf, lb, rf, rb, n, ?" in said
    assert "'left' is none of them" in said
