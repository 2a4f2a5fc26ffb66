"""The report on the machine: complete, never fatal, each lack with its cure."""

import json
from types import SimpleNamespace

from click.testing import CliRunner
from serial.tools import list_ports

from hil.cli.doctor import command
from hil.tools import doctor


def by_name(findings):
    return {finding.name: finding for finding in findings}


def test_json_is_one_document_and_the_status_is_0():
    """`hil doctor --json`: packages with versions, native modules, nothing else on stdout."""
    result = CliRunner().invoke(command, ["--json"])
    assert result.exit_code == 0
    findings = {f["name"]: f for f in json.loads(result.stdout)["findings"]}
    assert findings["pymavlink"]["state"] == "ok"
    assert findings["pymavlink"]["detail"][0].isdigit()
    assert findings["hil.board._firmware"]["state"] == "ok"


def test_the_table_names_every_group():
    """`hil doctor` prints a line per finding under the heading of its group."""
    result = CliRunner().invoke(command, [])
    assert result.exit_code == 0
    for group in ("system", "packages", "firmware tools", "viewer", "serial ports", "cameras"):
        assert group in result.stdout


def test_a_machine_with_nothing_gets_hints(monkeypatch):
    """No tools, ports or cameras: all missing ones are named with a way to get them."""
    monkeypatch.setenv("PATH", "")
    monkeypatch.setattr(doctor, "_ARDUINO_CORE", doctor.Path("/nonexistent"))
    monkeypatch.setattr(doctor.ctypes.util, "find_library", lambda _: None)
    monkeypatch.setattr(list_ports, "comports", list)
    monkeypatch.setattr(doctor.glob, "glob", lambda _: [])
    findings = by_name(doctor.examine())
    for name, package in [
        ("avr-g++", "gcc-avr"),
        ("avrdude", "avrdude"),
        ("arduino core", "arduino-core-avr"),
        ("libsimavr", "libsimavr-dev"),
    ]:
        assert findings[name].state == "missing"
        assert f"apt install {package}" in findings[name].hint
    assert findings["none"].state == "note"
    assert "pil" in findings["none"].detail


def test_a_missing_package_is_named(monkeypatch):
    """A package the project asks for and that is not there is a lack, not a crash."""
    monkeypatch.setattr(doctor, "_requirements", lambda: ["no-such-package>=1.2"])
    finding = by_name(doctor.examine())["no-such-package"]
    assert (finding.state, finding.detail) == ("missing", "wanted: no-such-package>=1.2")


def test_boards_are_recognised_and_permissions_told(monkeypatch):
    """A Mega's USB identity is named; a port without permission says which group is missing."""
    port = SimpleNamespace(device="/dev/ttyACM0", description="n/a", hwid="USB", vid=0x2341)
    monkeypatch.setattr(list_ports, "comports", lambda: [port])
    monkeypatch.setattr(doctor.os, "access", lambda *_: True)
    finding = by_name(doctor.examine())["/dev/ttyACM0"]
    assert finding.state == "ok"
    assert "Arduino" in finding.detail
    assert finding.hint == "--on serial:/dev/ttyACM0"
    monkeypatch.setattr(doctor.os, "access", lambda *_: False)
    finding = by_name(doctor.examine())["/dev/ttyACM0"]
    assert finding.state == "missing"
    assert "dialout" in finding.hint


def runnable(findings):
    return {f.name: f for f in findings if f.group == "can be run now"}


def test_what_can_be_run_now_is_listed(monkeypatch):
    """A machine with all tools and no board: twin and pil run, a rig needs port and camera."""
    monkeypatch.setattr(doctor.shutil, "which", lambda name: f"/usr/bin/{name}")
    monkeypatch.setattr(doctor, "_version_line", lambda *_: "1.0")
    monkeypatch.setattr(doctor.ctypes.util, "find_library", lambda _: "libsimavr.so")
    monkeypatch.setattr(doctor, "_folder", lambda name, *_: doctor.Finding("tools", name, "ok", ""))
    monkeypatch.setattr(
        doctor.importlib, "import_module", lambda name: SimpleNamespace(__file__=name)
    )
    monkeypatch.setattr(list_ports, "comports", list)
    monkeypatch.setattr(doctor.glob, "glob", lambda _: [])
    states = [f.state for f in runnable(doctor.examine()).values()]
    assert states == ["ok", "ok", "note", "note"]


def test_target_pil_needs_its_module(monkeypatch):
    """Without sim_twin._pil: missing, with the way to build it, and pil is not among what can run."""
    real = doctor.importlib.import_module

    def without(name):
        if name == "sim_twin._pil":
            raise ImportError("no module named sim_twin._pil")
        return real(name)

    monkeypatch.setattr(doctor.importlib, "import_module", without)
    findings = doctor.examine()
    assert by_name(findings)["sim_twin._pil"].state == "missing"
    assert ".ci/setup" in by_name(findings)["sim_twin._pil"].hint
    lines = runnable(findings)
    assert "sim_twin._pil" in lines["--on pil, hil replay --elf, hil bench firmware"].detail
    assert all("pil" not in name for name in doctor.as_document(findings)["can_run_now"])
