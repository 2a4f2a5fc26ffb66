"""Who is let in, and what can be reached: token, host, origin, policy, and nothing outside the records."""

from __future__ import annotations

import json
import math
import os
import stat
import subprocess

import pytest
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

from hil.console.access import Gate, kept_token
from hil.console.folders import confined
from hil.core.errors import BadInput
from tests.console.rig import HIL, Console


@pytest.fixture(scope="module")
def console(tmp_path_factory):
    """One console over records with hostile names."""
    work = tmp_path_factory.mktemp("access")
    secret = work / "secret"
    secret.mkdir()
    (secret / "manifest.json").write_text('{"scenario": {"name": "secret"}}')
    (work / "secret.toml").write_text('password = "hunter2"\n')
    records = work / "runs"
    records.mkdir()
    (records / "link").symlink_to(secret)
    hostile = records / "<img src=x onerror=alert(1)>"
    hostile.mkdir()
    tree = {"scenario": {"name": "<script>alert(1)</script>"}, "outer": "</td>", "outcome": "fault"}
    (hostile / "manifest.json").write_text(json.dumps(tree | {"outcome_detail": "\u202e<b>"}))
    with Console(work) as started:
        yield started


def test_the_token_opens_the_page_and_leaves_the_address(console):
    """The address that was printed gives a cookie that no script reads, and an address without the token."""
    status, headers, _ = console.ask("/", {"token": console.token}, Cookie="", Origin="")
    assert (status, headers["location"]) == (303, "/")
    assert "HttpOnly" in headers["set-cookie"]
    assert "SameSite=strict" in headers["set-cookie"]
    status, headers, page = console.ask("/", Origin="")
    assert status == 200
    policy = headers["content-security-policy"]
    assert "default-src 'none'" in policy
    assert "unsafe" not in policy
    assert b"http" not in page.replace(b"http-equiv", b"")  # nothing from elsewhere
    assert headers["x-content-type-options"] == "nosniff"


@pytest.mark.parametrize(
    ("headers", "why"),
    [
        ({"Cookie": ""}, "no token"),
        ({"Cookie": "hil_console_1=x"}, "no token"),
        ({"Host": "rig.example"}, "another name"),
        ({"Origin": "http://evil.example"}, "another site"),
    ],
)
def test_others_are_refused(console, headers, why):
    """Without token, under a foreign name, from another site: 403 and not a word of the content."""
    status, _, said = console.ask("/api/records", **headers)
    assert status == 403
    assert why in said.decode()


def test_what_changes_something_needs_the_page_itself(console):
    """A form of another page carries the cookie at most: no origin, no change; and no socket."""
    status, _, _ = console.ask("/api/delete", method="POST", body={"names": []}, Origin="")
    assert status == 403
    status, _, said = console.ask("/", {"token": "guessed"}, Cookie="", Origin="")
    assert (status, b"wrong token" in said) == (403, True)
    for origin in (None, "http://evil.example"):
        with pytest.raises(InvalidStatus) as refused:
            connect(
                f"ws://{console.host}/ws",
                origin=origin,
                additional_headers={"Cookie": console.cookie},
            )
        assert refused.value.response.status_code == 403


@pytest.mark.parametrize(
    "name", ["../secret", "link", "/etc", ".console", "a/../../secret", "..", "", "x\0y", ".bin/x"]
)
def test_nothing_outside_the_records_is_reached(console, name):
    """Neither by dots, nor by links, nor hidden: a report, an export, a bin are of records alone."""
    for path, query in (
        ("/api/report", {"name": name}),
        ("/api/export", {"name": name, "to": "csv"}),
    ):
        status, _, said = console.ask(path, query)
        assert status == 400, said
        assert b'secret"' not in said
    with console.page("op"):
        status, said = console.send("/api/delete", {"names": [name]}, "op")
    assert status == 400
    assert "error" in said
    assert (console.work / "secret" / "manifest.json").is_file()


def test_nonsense_is_answered_in_one_line(console):
    """Brackets without end, a list for a word, numbers beyond all: neither a fault nor a page lost."""
    deep = b"[" * 50_000
    with console.page("op") as page:
        for path, body in (
            ("/api/delete", deep),
            ("/api/calibrate", {"step": ["lens"]}),
            ("/api/calibrate", {"step": "floor", "points": [[math.nan] * 4] * 4}),
        ):
            status, said = console.send(path, body, "op")
            assert status == 400, said
            assert said["error"].startswith(("not understood", "calibrate: ")), said
        for text in (deep.decode(), f'{{"do":"step","x_m":1{"0" * 400},"y_m":1}}'):
            page.socket.send(text)
            assert "not understood" in page.until("said")[-1]["error"]


def test_files_of_the_user_alone_are_named(console):
    """A law, a scenario, a robot file of another folder is refused before it is opened."""
    orders = (
        {"scenario": "/etc/passwd"},
        {"scenario": "../secret.toml"},
        {"scenario": "scenario-1", "law": "/tmp/evil.py"},
        {"scenario": "scenario-1", "overrides": ["robot.file=/etc/hil.toml"]},
        {"scenario": "scenario-1", "target": "replay:../secret"},
        {"scenario": "scenario-1", "camera": "/etc/passwd"},
    )
    with console.page("op") as page:
        for order in orders:
            page.say(do="arm", wanted=True)
            page.say(do="start", order=order)
            heard = page.until("said")
            assert "no" in heard[-1]["error"], order
            assert "hunter2" not in json.dumps(heard)
    assert [item["name"] for item in console.get("/api/records")["items"]] == [
        "<img src=x onerror=alert(1)>"
    ]


def test_the_token_is_the_owners_alone(tmp_path):
    """It is kept, with mode 0600; a file that holds none, or an open one, is made good."""
    first = kept_token(tmp_path)
    assert kept_token(tmp_path) == first
    file = tmp_path / "token"
    assert stat.S_IMODE(file.stat().st_mode) == 0o600
    os.chmod(file, 0o644)
    kept_token(tmp_path)
    assert stat.S_IMODE(file.stat().st_mode) == 0o600
    file.write_text("short")
    assert len(kept_token(tmp_path)) >= 24


def test_a_gate_knows_its_names():
    """Host with the right port, in every way of writing loopback; no other name that ends like it."""
    gate = Gate("t" * 32, 8700)
    assert all(gate.knows_host(host) for host in ("127.0.0.1:8700", "localhost:8700", "[::1]:8700"))
    for host in (
        "127.0.0.1",
        "127.0.0.1:1",
        "localhost.evil.example:8700",
        "",
        ":8700",
        "[::1:8700",
    ):
        assert not gate.knows_host(host), host


def test_a_path_is_inside_or_refused(tmp_path):
    """The positive control beside the refusals."""
    (tmp_path / "a").mkdir()
    assert confined(tmp_path, "a/b") == tmp_path / "a" / "b"
    for name in ("a/../b", "../x", "/etc", "a\\b", ".a", "a/.b"):
        with pytest.raises(BadInput):
            confined(tmp_path, name)


def test_a_port_in_use_is_one_line(console, tmp_path):
    """Which port, and what to try; nothing of the console that runs is disturbed."""
    said = subprocess.run(
        [*HIL, "console", "--no-browser", "--port", str(console.port)],
        cwd=tmp_path, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert said.returncode == 2
    assert f"port {console.port}" in said.stderr
    assert "--port" in said.stderr
    assert len(said.stderr.splitlines()) == 1


def test_without_the_extra_one_line_says_how_to_get_it(tmp_path):
    """Starlette, uvicorn and websockets are of an extra."""
    code = (
        "import sys; sys.modules['starlette'] = None; sys.modules['uvicorn'] = None; "
        "sys.argv = ['hil', 'console', '--no-browser']; from hil.cli.main import main; main()"
    )
    said = subprocess.run(
        [HIL[0], "-c", code], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert said.returncode == 2
    assert "pip install 'skid-steer-hil[console]'" in said.stderr
    assert len(said.stderr.splitlines()) == 1
    assert list(tmp_path.iterdir()) == []
