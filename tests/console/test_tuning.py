"""Tuning in the browser on the served twin: found, armed, tuned, written; the record replays exactly."""

from __future__ import annotations

import json

import pytest

import hil
from hil.config.load import load_robot, load_scenario
from hil.console.folders import Folders
from hil.console.orders import Order
from hil.console.tuning import Tuning, write_tuned
from hil.core.errors import BadInput
from tests.console.rig import CHROMIUM, NO_CHROMIUM
from tests.console.test_browser import start


@pytest.mark.realtime
@pytest.mark.skipif(CHROMIUM is None, reason=NO_CHROMIUM)
def test_values_are_tuned_on_the_rig_and_written(rig, open_page):
    """Found, then armed; a value of the law and one of the board; undo; a step; written; exact replay."""
    from playwright.sync_api import expect  # noqa: PLC0415 - where there is a browser

    page, viewer = open_page(rig), open_page(rig)
    start(page, "scenario-1", 60, arm=False)
    expect(page.locator("#phase")).to_have_text("found, not armed")
    expect(page.locator("#pose")).to_contain_text("robot found at x -0.60")
    expect(viewer.locator("#arm")).to_be_disabled()
    page.click("#arm")
    expect(page.locator("#phase")).to_have_text("running")
    page.locator("#tune summary").click()
    viewer.locator("#tune summary").click()
    gain = '[data-key="law.k1_s"]'
    was = float(page.input_value(gain))
    page.fill(gain, "2.5")
    page.locator(gain).blur()
    expect(page.locator("#tune-changes li")).to_have_text([f"law.k1_s: {was:g} → 2.5"])
    page.fill("#tune-filter", "coulomb")
    page.fill('[data-key="board.FF_DEAD"]', "0.2")
    page.locator('[data-key="board.FF_DEAD"]').blur()
    expect(viewer.locator("#tune-changes li")).to_have_count(2)
    expect(viewer.locator(gain)).to_be_disabled()
    page.fill('[data-key="board.FF_DEAD"]', "0.9")
    page.locator('[data-key="board.FF_DEAD"]').blur()
    expect(page.locator("#tune-said")).to_contain_text("allowed is 0 to 0.5")
    page.click("#tune-undo")
    expect(page.locator("#tune-changes li")).to_have_count(1)
    page.click("#step")
    expect(page.locator("#step-figures li")).to_have_count(1)
    page.click("#tune-write")
    expect(page.locator("#tune-written")).to_contain_text("k1_s = 2.5")
    page.locator("#tune-filter").blur()
    page.keyboard.press("Space")
    expect(page.locator("#phase")).to_have_text("ended")
    expect(page.locator("#outcome")).to_contain_text("Stopped.")
    record = hil.open_record(
        rig.records / page.locator("#outcome").inner_text().split("Record: ")[1].strip()
    )
    told = [event.text for event in record.events if event.kind == "tuning"]
    assert told == [
        f"law.k1_s {was:g} -> 2.5",
        "board.FF_DEAD 0.16 -> 0.2",
        "board.FF_DEAD 0.2 -> 0.16",
        "goal stepped by (+0.100, +0.000) m",
    ]
    assert hil.replay(record).identical
    file = rig.records / "set-up" / "robot-tuned.toml"
    assert (
        load_scenario("scenario-2", [f"robot.file={file}"]).control.gains.tuned.asg_ism.k1_s == 2.5
    )


def test_what_is_written_lies_on_the_runs_robot(tmp_path):
    """Board and gains in the robot's file; a second tuning goes on with it; its vehicle stays what it was."""
    folders = Folders(tmp_path / "runs", tmp_path)
    folders.make()
    first = Order(scenario="scenario-1", overrides=("robot.file=diff-2wd",))
    file = write_tuned(folders, first, "asg-ism", "tuned", {"board.PID_KP": 0.3, "law.k1_s": 1.5})
    again = Order(scenario="scenario-1", overrides=("robot.file=set-up/robot-tuned.toml",))
    assert write_tuned(folders, again, "pid", "tuned", {"law.kp_s3": 9.0}) == file
    scenario = load_scenario("scenario-3", [f"robot.file={file}"])
    assert scenario.board["PID_KP"] == 0.3
    gains = scenario.control.gains.tuned
    assert (gains.asg_ism.k1_s, gains.pid.kp_s3) == (1.5, 9.0)
    assert scenario.robot.vehicle.kind == "differential"
    assert load_robot(str(file)) == load_robot("diff-2wd")
    mine = tmp_path / "mine.toml"
    mine.write_text(
        f'base = "scenario-1"\nname = "mine"\n[robot]\nfile = "{file}"\n[board]\nPID_KP = 0.4\n'
    )
    assert load_scenario(str(mine)).board["PID_KP"] == 0.4  # the scenario's own lies above
    assert load_scenario(str(mine)).control.gains.tuned.asg_ism.k1_s == 1.5


def test_a_robots_file_has_gains_and_nothing_else_of_the_control(tmp_path):
    """A limit of the law in a robot's file is refused, and so is a board parameter out of bounds."""
    file = tmp_path / "robot.toml"
    file.write_text('base = "thesis-4wd"\n[control.limits]\neta1_max_m_s = 0.4\n')
    with pytest.raises(BadInput, match=r"control\.limits: a robot's file has gains"):
        load_scenario("scenario-1", [f"robot.file={file}"])
    file.write_text('base = "thesis-4wd"\n[board]\nPID_KP = 9.0\n')
    with pytest.raises(BadInput, match="PID_KP = 9"):
        load_scenario("scenario-1", [f"robot.file={file}"])


def test_undo_takes_back_one_change_after_the_other():
    """The stack of changes; what is undone is none; without a run nothing is changed."""
    said, on = [], [True]
    tuning = Tuning(lambda: on[0], lambda **message: said.append(message))
    tuning.begin([{"key": "law.k1_s", "value": 1.0}, {"key": "board.PID_KP", "value": 0.2}])
    tuning.take({"law.k1_s": 2.0})
    tuning.take({"law.k1_s": 2.0, "board.PID_KP": 0.3})
    tuning.take({"law.k1_s": 3.0, "board.PID_KP": 0.3})
    changes = [("law.k1_s", 1.0, 2.0), ("board.PID_KP", 0.2, 0.3), ("law.k1_s", 2.0, 3.0)]
    assert tuning.message()["changes"] == changes
    tuning.undo()
    tuning.take({"law.k1_s": 2.0, "board.PID_KP": 0.3})
    assert tuning.message()["changes"] == changes[:2]
    tuning.undo()
    tuning.take({"law.k1_s": 2.0, "board.PID_KP": 0.2})
    tuning.undo()
    tuning.take({"law.k1_s": 1.0, "board.PID_KP": 0.2})
    assert tuning.moved() == {}
    assert [json.dumps(message) for message in said] == [
        '{"set": "law.k1_s", "value": 2.0}', '{"set": "board.PID_KP", "value": 0.2}',
        '{"set": "law.k1_s", "value": 1.0}',
    ]  # fmt: skip
    with pytest.raises(BadInput, match="nothing was changed"):
        tuning.undo()
    with pytest.raises(BadInput, match="give a number"):
        tuning.change("law.k1_s", float("nan"))
    on[0] = False
    with pytest.raises(BadInput, match="while a run is on"):
        tuning.change("law.k1_s", 2.0)
