"""Lists of records, the bin, and campaigns: what is asked for, through the server."""

from __future__ import annotations

import json
import os
import time

import pytest

from hil.console import listing
from hil.console.choices import describe
from hil.console.folders import Folders, in_bin, out_of_bin, require_closed
from hil.console.listing import Listing, Wanted
from hil.console.orders import inside, order_of
from hil.core.errors import BadInput
from hil.core.files import hold
from tests.console.rig import PATIENCE_S, Console

pytestmark = pytest.mark.realtime

CAMPAIGN = """
name = "small"
scenario = "scenario-1"
set = ["duration_s=0.5"]
seeds = 3
outer = ["pid"]

[grid]
"robot.mass_kg" = [2.5, 3.0]
"""


def record(root, name, **manifest):
    """Make the two files of a record that a list reads."""
    folder = root / name
    folder.mkdir(parents=True)
    tree = {"scenario": {"name": "circle"}, "outer": "pid", "outcome": "complete", "seed": 2,
            "start_time_utc": "2026-03-04T05:06:07+00:00"}  # fmt: skip
    (folder / "manifest.json").write_text(json.dumps(tree | manifest))
    failed = [{"metric": "ise_m2_s", "holds": name != "bad"}]
    (folder / "metrics.json").write_text(json.dumps({"requirements": failed}))
    return folder


@pytest.fixture
def folders(tmp_path):
    """Five records, one of them damaged, one in an experiment's folder, and what is none."""
    found = Folders(tmp_path / "runs", tmp_path)
    found.make()
    record(found.root, "good")
    record(found.root, "bad", outer="asg-ism", start_time_utc="2026-05-01T00:00:00+00:00")
    record(found.root, "deck/one", outcome="fault", outcome_detail="geofence: left")
    record(found.root, "cut", outcome="running")
    (record(found.root, "torn") / "manifest.json").write_text('{"scenario": ')
    (found.root / "no record").mkdir()
    (found.root / "loop").symlink_to(found.root)
    return found


def test_the_list_says_how_each_ended(folders):
    """Held, failed and why, fault and its cause, cut off, damaged; the newest first."""
    items = {item.name: item for item in Listing(folders).items()}
    assert {name: item.verdict for name, item in items.items()} == {
        "good": "held", "bad": "failed", "deck/one": "fault", "cut": "running", "torn": "damaged",
    }  # fmt: skip
    assert items["bad"].failed == ("ise_m2_s",)
    assert items["deck/one"].detail == "geofence: left"
    assert Listing(folders).items()[0].name == "bad"


@pytest.mark.parametrize(
    ("wanted", "names"),
    [
        ({"text": "GEOFENCE"}, ["deck/one"]),
        ({"law": "asg-ism"}, ["bad"]),
        ({"verdict": "held"}, ["good"]),
        ({"since": "2026-05-01"}, ["bad"]),
        ({"until": "2026-03-04", "scenario": "circle", "text": "pid go"}, ["good"]),
        ({"text": "nothing of it"}, []),
    ],
)
def test_the_list_is_filtered(folders, wanted, names):
    """Every word, exact names, days with both ends."""
    page = Listing(folders).page(Wanted(**wanted), 0, 10)
    assert [item["name"] for item in page["items"] if item["verdict"] != "damaged"] == names
    assert page["total"] == 5


def test_only_what_is_new_is_read(folders, monkeypatch):
    """From the index of another console nothing is opened again, but for a manifest that has changed."""
    Listing(folders).items()
    opened = []
    read = listing.read_item
    monkeypatch.setattr(
        listing, "read_item", lambda path, name: opened.append(name) or read(path, name)
    )
    again = Listing(folders)
    again.items()
    assert opened == []
    manifest = folders.root / "cut" / "manifest.json"
    manifest.write_text(manifest.read_text().replace("running", "interrupted"))
    os.utime(manifest, ns=(1, 1))
    found = {item.name: item.verdict for item in again.items()}
    assert opened == ["cut"]
    assert found["cut"] == "interrupted"
    (folders.own / "index.json").write_text("not an index")
    assert len(Listing(folders).items()) == 5


def test_a_record_goes_into_the_bin_and_back(folders):
    """It is gone from the list, its place is kept; a place that is taken is not overwritten."""
    place = in_bin(folders.root, folders.record("deck/one"))
    assert place.name == "deck__one"
    assert "deck/one" not in {item.name for item in Listing(folders).items()}
    record(folders.root, "deck/one")
    with pytest.raises(BadInput, match="taken"):
        out_of_bin(folders.root, "deck__one")
    assert in_bin(folders.root, folders.record("deck/one")).name == "deck__one-2"
    assert out_of_bin(folders.root, "deck__one") == folders.root / "deck" / "one"
    for name in ("../good", "none", ".x", "a/b"):
        with pytest.raises(BadInput, match="no record in the bin"):
            out_of_bin(folders.root, name)


def test_a_record_that_is_being_written_stays_where_it_is(folders):
    """Whoever writes it, `hil run` beside the console too, would lose it; one left behind may go."""
    at_work = record(folders.root, "at work", outcome="running")
    with (at_work / ".reserve").open("xb") as file:
        hold(file)
        with pytest.raises(BadInput, match="at work: its run is on"):
            require_closed(at_work, "at work")
    require_closed(at_work, "at work")
    require_closed(folders.record("good"), "good")


def test_a_number_beyond_all_costs_one_record_and_not_the_list(folders):
    """A manifest of another program may say anything."""
    place = record(folders.root, "huge")
    manifest = place / "manifest.json"
    manifest.write_text(manifest.read_text().replace('"seed": 2', '"seed": 1e999'))
    found = {item.name: item.verdict for item in Listing(folders).items()}
    assert (len(found), found["huge"], found["good"]) == (6, "damaged", "held")


def test_a_file_is_one_of_the_users_own(folders):
    """A law beside the console is found by its name; values that name files are made whole."""
    (folders.work / "mine.py").write_text("import hil\n")
    (folders.root / "set-up" / "camera.toml").write_text("\n")
    order = order_of(
        {
            "scenario": "circle",
            "law": "mine.py:Law",
            "overrides": ["camera.file=set-up/camera.toml"],
        }
    )
    given = inside(order, folders)
    assert given.law == f"{folders.work / 'mine.py'}:Law"
    assert given.overrides == (f"camera.file={folders.root / 'set-up' / 'camera.toml'}",)
    assert order.command() == (
        "hil run circle --outer mine.py:Law --set camera.file=set-up/camera.toml"
    )


def test_every_value_is_shown_with_what_is_known_of_it():
    """Unit, bounds, meaning and source are those of `hil config`."""
    values = {item["key"]: item for item in describe("scenario-1")["values"]}
    mass = values["robot.mass_kg"]
    assert mass["unit"] == "kg"
    assert mass["low"] is not None
    assert mass["high"] is not None
    assert mass["meaning"]
    assert any(item["source"] for item in values.values())
    assert values["camera_source"]["choices"] == ["rendered", "pose"]
    untold = {key for key, item in values.items() if not item["meaning"]}
    assert all(".origin." in key or key.startswith("camera.scene.") for key in untold), untold


def test_a_campaign_is_started_stopped_and_gone_on_with(tmp_path):
    """Through the server: rows on disk, a map of them, the report; a viewer may not start one."""
    (tmp_path / "small.toml").write_text(CAMPAIGN)
    with Console(tmp_path) as console, console.page("op") as operator:
        status, said = console.send("/api/campaign-start", {"campaign": "small.toml"}, "viewer")
        assert (status, said["error"]) == (409, "only the operator's page may do that")
        status, said = console.send("/api/campaign-start", {"campaign": "/etc/x.toml"}, "op")
        assert status == 400
        status, said = console.send("/api/campaign-start", {"campaign": "small.toml"}, "op")
        assert status == 200, said
        name = said["name"]
        assert console.send("/api/campaign-start", {"campaign": "small.toml"}, "op")[0] == 400
        end_s = time.monotonic() + PATIENCE_S
        while not (tmp_path / "runs" / name / "campaign.json").exists():
            assert time.monotonic() < end_s
            time.sleep(0.1)
        assert console.send("/api/campaign-stop", {"name": name}, "op")[0] == 200
        ended(operator, name)
        status, said = console.send("/api/campaign-go-on", {"name": name}, "op")
        assert status == 200, said
        item = ended(operator, name)
        assert (item["done"], item["total"], item["finished"]) == (6, 6, True)
        found = console.get("/api/campaign-map", {"name": name})
        assert found["axes"] == ["robot.mass_kg"]
        assert sorted({row[0] for row in found["rows"]}) == [2.5, 3.0]
        status, headers, _ = console.ask("/api/campaign-report", {"name": name})
        assert status == 200
        assert "sandbox" in headers["content-security-policy"]


def ended(page, name):
    """Wait until a campaign is not on any more; return what the list says of it."""
    while True:
        items = {item["name"]: item for item in page.until("campaigns")[-1]["items"]}
        if name in items and not items[name]["on"]:
            return items[name]
