"""A run of the console is the run of `hil run`: same bytes, whoever looks; and how it is stopped."""

from __future__ import annotations

import json
import os
import signal
import threading
import time

import pytest

import hil
from hil.console.people import Page, People
from tests.console.rig import PATIENCE_S, Console, is_gone, served_twin

pytestmark = pytest.mark.realtime

ORDER = {"scenario": "scenario-1", "camera": "pose", "seed": 3, "real_time": False,
         "overrides": ["duration_s=2"]}  # fmt: skip


@pytest.fixture(scope="module")
def console(tmp_path_factory):
    """One console for all."""
    with Console(tmp_path_factory.mktemp("runs")) as started:
        yield started


@pytest.fixture(scope="module")
def heard(console):
    """Return what the operator hears of one run, nobody else looking."""
    with console.page("op") as operator:
        told = operator.run(**ORDER)
        return told + operator.until("state", phase="ended", end=told[-1]["end"] | {"report": True})


def samples(console, heard):
    """Return the bytes of the samples of the run that was heard."""
    return (console.records / heard[-1]["end"]["record"] / "samples.parquet").read_bytes()


def test_same_bytes_with_no_one_five_viewers(console, heard, tmp_path):
    """samples.parquet is that of `hil run`, with nobody else, and with five viewers that read late."""
    for seed in (3, 4):
        out = tmp_path / str(seed)
        hil.run("scenario-1", seed=seed, camera="pose", duration_s=2.0, out=out)
    wanted, other = ((tmp_path / seed / "samples.parquet").read_bytes() for seed in "34")
    assert samples(console, heard) == wanted
    assert samples(console, heard) != other
    with console.page("op") as operator:
        viewers = [console.page(f"viewer {k}") for k in range(5)]
        assert samples(console, operator.run(**ORDER)) == wanted
    for viewer in viewers:
        assert viewer.ticks()
        viewer.socket.close()


def test_what_is_told_of_a_run(console, heard):
    """Where it is, how sure, how it stands; the command of the same run; the requirements at the end."""
    begin = next(m["begin"] for m in heard if isinstance(m, dict) and m.get("begin"))
    assert begin["floor"]["fence"] == [-0.9, 0.9, -0.62, 0.62]
    live = [m for m in heard if isinstance(m, dict) and m["kind"] == "live" and m.get("trail")]
    assert live[-1]["trail"][-1][0] == pytest.approx(2.0, abs=0.02)
    assert len(live[-1]["sigma"]) == 4
    assert {"battery_v", "rtt_s", "link_lost", "in_layer"} <= set(live[-1]["now"])
    end = heard[-1]["end"]
    assert (end["outcome"], end["status"]) == ("complete", 1)
    assert end["requirements"][0]["holds"] is False
    command = "hil run scenario-1 --camera pose --seed 3 --set duration_s=2"
    assert heard[-1]["command"] == command
    manifest = json.loads((console.records / end["record"] / "manifest.json").read_text())
    assert manifest["command"] == command
    status, headers, page = console.ask("/api/report", {"name": end["record"]})
    assert status == 200
    assert "sandbox" in headers["content-security-policy"]
    assert b"<svg" in page or b"<img" in page


def test_wrong_orders_are_one_line(console):
    """A value out of bounds, an unknown law, no arming, a run by a viewer: said, and nothing is written."""
    before = set(console.records.iterdir())
    with console.page("op") as operator, console.page("looks") as viewer:
        for change, said in (
            ({"overrides": ["duration_s=-1"]}, "duration_s = -1"),
            ({"law": "asg-ims"}, "near"),
        ):
            heard = operator.run(**ORDER | change)
            assert said in heard[-1]["refused"]
            assert "\n" not in heard[-1]["refused"]
        operator.say(do="arm", wanted=True)
        operator.say(do="start", order=ORDER | {"scenario": "scenario-9"})
        assert "scenario-9: no .toml file" in operator.until("said")[-1]["error"]
        operator.say(do="arm", wanted=False)
        operator.say(do="start", order=ORDER)
        assert "not armed" in operator.until("said")[-1]["error"]
        viewer.say(do="arm", wanted=True)
        assert "only the operator" in viewer.until("said")[-1]["error"]
        operator.say(do="arm", wanted=True)
        operator.say(do="start", order=ORDER | {"sudo": True})
        assert "sudo" in operator.until("said")[-1]["error"]
        operator.say(do=["nonsense"])
        operator.socket.send("not json")
        assert "not understood" in operator.until("said")[-1]["error"]
    assert set(console.records.iterdir()) == before


def test_viewers_order_nothing_and_nothing_is_ordered_without_a_run(console):
    """Tuning, steps, bring-up, cameras: the operator's alone; wrongly said or out of place, one line each."""
    with console.page("op") as operator, console.page("looks") as viewer:
        orders = (
            {"do": "tune", "key": "law.k1_s", "value": 2},
            {"do": "step", "x_m": 0.1, "y_m": 0},
            {"do": "undo"},
            {"do": "bring-up", "order": {"target": "serial:/dev/null"}},
            {"do": "answer", "value": "go"},
            {"do": "look", "what": "open", "camera": {"source": "0"}},
        )
        for order in orders:
            viewer.say(**order)
            assert "only the operator" in viewer.until("said")[-1]["error"]
        for order, said in zip(
            orders,
            ("while a run is on", "while a run is on", "while a run is on", "ALL wheels are off",
             "nothing is asked", ""),
            strict=True,
        ):  # fmt: skip
            if said:
                operator.say(**order)
                assert said in operator.until("said")[-1]["error"]
        for camera, said in (
            ({"source": "../x.avi"}, "x.avi"),
            ({"source": "twin:/nowhere"}, "no such socket"),
            ({"source": "0", "find": "board", "board": "chess:$(id)"}, "not understood"),
            ({"source": "0", "find": "robot"}, "calibrate first"),
            ({"source": "0", "controls": {"white_balance_k": -1}}, "white_balance_k"),
        ):
            operator.say(do="look", what="open", camera=camera)
            assert said in operator.until("said")[-1]["error"]


def test_anybody_stops(console):
    """STOP by a viewer in mid-run: the robot stands, the record is whole and says who did it."""
    with console.page("op") as operator, console.page("looks") as viewer:
        operator.begin(**ORDER | {"real_time": True, "overrides": []})
        viewer.ticks()
        viewer.say(do="stop")
        end = operator.until("state", phase="ended")[-1]["end"]
    assert end["outcome"] == "interrupted"
    record = hil.open_record(console.records / end["record"])
    assert record.problems == ()
    texts = [f"{event.kind}: {event.text}" for event in record.events]
    assert "operator: STOP pressed on the page of a viewer" in texts
    assert "stopped: DISARMED" in texts
    assert record.samples["t_s"][-1] < 19.0
    assert hil.replay(record).identical


def beat(page, ended):
    """Say four times a second that the page is there, as a page does from the start on."""
    while not ended.wait(0.25):
        page.say(do="beat")


def test_the_dead_man_stops_when_the_page_is_silent(console):
    """Beats keep the run going, their absence ends it; without the option silence is nothing."""
    long = ORDER | {"real_time": True, "overrides": ["duration_s=60"]}
    with console.page("op") as operator:
        beats = threading.Event()
        threading.Thread(target=beat, args=(operator, beats), daemon=True).start()
        operator.begin(**long | {"dead_man": True})
        operator.ticks()
        end_s = time.monotonic() + 2.0
        while time.monotonic() < end_s:
            assert operator.ticks()  # it goes on as long as there are beats
        beats.set()
        end = operator.until("state", phase="ended")[-1]["end"]
        assert end["outcome"] == "interrupted"
        events = (console.records / end["record"] / "events.jsonl").read_text()
        assert "silent for 1 s" in events


def test_a_console_that_is_killed_stops_the_robot(tmp_path):
    """SIGKILL of the console in mid-run: its run stops the robot, closes its record, and is gone."""
    with (
        served_twin(tmp_path, "--camera", "pose") as (target, camera),
        Console(tmp_path) as console,
    ):
        with console.page("op") as operator:
            operator.begin(scenario="scenario-1", target=target, camera=camera)
            operator.ticks()
        console.end(signal.SIGKILL)
        (record,) = [path for path in console.records.iterdir() if path.name.startswith("scenario")]
        end_s = time.monotonic() + PATIENCE_S
        while time.monotonic() < end_s:
            manifest = json.loads((record / "manifest.json").read_text())
            if manifest["outcome"] != "running":
                break
            time.sleep(0.1)
        assert manifest["outcome"] == "interrupted"
        events = (record / "events.jsonl").read_text()
        assert "the console has ended" in events
        assert '"stopped", "text": "DISARMED"' in events


def test_the_operator_is_one_and_comes_back():
    """The first page operates; after a reload it does still; gone for long, another one may."""
    now = [0.0]
    people = People(lambda: now[0])
    people.in_a_run = lambda: True
    first, second = Page("a"), Page("b")
    people.came(first)
    people.came(second)
    assert people.operator == "a"
    assert not people.take_over(second)
    people.went(first)
    now[0] = 9.0
    people.came(Page("a"))
    assert people.operator == "a"
    for page in [page for page in people.pages if page.key == "a"]:
        people.went(page)
    now[0] = 30.0
    assert people.take_over(second)
    assert people.operator == "b"
    people.went(second)
    people.in_a_run = lambda: False
    third = Page("c")
    people.came(third)  # nothing runs: whoever comes next operates at once
    assert people.operator == "c"


def test_a_slot_takes_the_newest():
    """A page that does not read holds one message of a kind; ticks are bounded."""
    page = Page("a")
    for k in range(1000):
        page.put("live", {"trail": [[k]] * 10, "now": k})
        page.put("state", {"run": k})
    waiting = page._slots
    assert set(waiting) == {"live", "state"}
    assert waiting["state"] == {"run": 999}
    assert len(waiting["live"]["trail"]) == 240
    assert waiting["live"]["trail"][-1] == [999]
    page.put("live", {"events": [[0.0, "fault", "x"]]})
    assert waiting["live"]["now"] == 999


def test_gone_means_gone():
    """The control of `is_gone`."""
    assert not is_gone(os.getpid())
