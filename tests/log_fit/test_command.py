"""`hil fit` on the command line: robot file, page, JSON, replay, and input that is refused."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path

import pytest

from hil.config.load import load_robot
from tests.log_fit.twins import Answer, Log, drive, write_csv
from tests.replay.logs import Command, hil

__all__ = ["hil"]

MAP = """
t = { column = "ms", scale = 0.001 }
[columns]
est_x_m = { column = "X", scale = 0.001 }
est_y_m = { column = "Y", scale = 0.001 }
est_theta_rad = { column = "deg", scale = 0.017453292519943295 }
eta1_cmd_m_s = { column = "v" }
theta_dot_cmd_rad_s = { column = "w" }
"""


@pytest.fixture(scope="module")
def log() -> Log:
    """Return the log of one robot."""
    return drive(Answer(), 21, 20.0, pose_hz=15.0)


def mapped(folder: Path, log: Log) -> tuple[Path, Path]:
    """Write the log in ms, mm and degrees, and its mapping."""
    lines = ["ms,X,Y,deg,v,w"]
    rows = [(t, f"{1e3 * x},{1e3 * y},{57.29577951308232 * a},,") for t, x, y, a in log.poses]
    rows += [(t, f",,,{v},{w}") for t, v, w in log.commands]
    lines += [f"{1e3 * t},{text}" for t, text in sorted(rows)]
    table, mapping = folder / "mm.csv", folder / "map.toml"
    table.write_text("\n".join(lines) + "\n", encoding="utf-8")
    mapping.write_text(MAP, encoding="utf-8")
    return table, mapping


def test_units_by_a_mapping_give_the_same_robot(hil: Command, tmp_path: Path, log: Log) -> None:
    """Milliseconds, millimetres and degrees give the robot that SI units give; file and page hold it."""
    write_csv(tmp_path / "log.csv", log)
    mapped(tmp_path, log)
    status, out, _ = hil("fit", "log.csv", "--robot", "si.toml", "--json")
    assert status == 0
    in_si = json.loads(out)["layers"]["body"]
    status, out, err = hil("fit", "mm.csv", "--map", "map.toml", "--robot", "mm.toml", "--json")
    assert status == 0, err
    document = json.loads(out)
    for name, item in document["layers"]["body"].items():
        assert item["value"] == pytest.approx(in_si[name]["value"], abs=2e-3), name
    robot = load_robot("mm.toml")
    assert robot.log_fit is not None
    scale = robot.log_fit.told["body.distance_scale_ratio"]
    assert scale.low < 0.95 < scale.high
    assert robot.log_fit.twin["dead_time_s"] == pytest.approx(Answer().dead_time_s, abs=0.03)
    assert robot.mass_kg == load_robot("thesis-4wd").mass_kg
    page = (tmp_path / "mm.html").read_text(encoding="utf-8")
    assert "distance_scale_ratio" in page
    assert "plain odometry" in page
    assert "nan" not in page.casefold().split("<body>")[1]
    assert {"fitted twin", "standing still"} <= set(document["held_out"])
    assert document["not_told"]

    status, out, _ = hil("fit", "log.csv", "--replay", "--robot", "mm.toml", "--json")
    assert status == 0
    scores = json.loads(out)["scores"]
    assert (
        scores["fitted twin"]["position_rms_m"]
        < 0.5 * scores["plain odometry (commands)"]["position_rms_m"]
    )


def test_a_robot_file_that_stands_there_is_begun_with_and_kept(
    hil: Command, tmp_path: Path, log: Log
) -> None:
    """Its values stay where the log tells nothing; a second fit begins with the same file again."""
    write_csv(tmp_path / "log.csv", log)
    own = 'base = "thesis-4wd"\nname = "mine"\nmass_kg = 4.5\n'
    Path("mine.toml").write_text(own, encoding="utf-8")
    status, _, err = hil("fit", "log.csv", "--robot", "mine.toml")
    assert status == 0
    assert "mine.before.toml" in err
    assert Path("mine.before.toml").read_text(encoding="utf-8") == own
    assert load_robot("mine.toml").mass_kg == 4.5
    assert (
        tomllib.loads(Path("mine.toml").read_text(encoding="utf-8"))["base"] == "mine.before.toml"
    )
    first = Path("mine.toml").read_bytes()
    assert hil("fit", "log.csv", "--robot", "mine.toml")[0] == 0
    assert Path("mine.toml").read_bytes() == first


def refused(hil: Command, *words: str) -> str:
    """Return the one line with which a fit is refused, nothing written."""
    before = sorted(Path().iterdir())
    status, out, err = hil("fit", *words)
    assert (status, out) == (2, "")
    assert err.count("\n") == 1, err
    assert sorted(Path().iterdir()) == before
    return err


def test_bad_input_is_refused_in_one_line(hil: Command, tmp_path: Path, log: Log) -> None:
    """What is missing or in another unit is named, with what to try; nothing is written."""
    write_csv(tmp_path / "log.csv", log)
    to = ("--robot", "out.toml")
    assert "no such file" in refused(hil, "none.csv", *to)
    rows = Path("log.csv").read_text(encoding="utf-8").splitlines()
    Path("commands.csv").write_text("t_s,v,w\n0,0.1,0\n1,0.1,0\n", encoding="utf-8")
    assert "neither poses nor wheel speeds" in refused(hil, "commands.csv", *to)
    Path("poses.csv").write_text(
        "t_s,x,y,theta\n" + "".join(f"{k},{k},0,0\n" for k in range(40)), encoding="utf-8"
    )
    assert "no command, wheel speed or voltage" in refused(hil, "poses.csv", *to)
    Path("short.csv").write_text("\n".join(rows[:60]) + "\n", encoding="utf-8")
    assert "too few" in refused(hil, "short.csv", *to)
    Path("bad.csv").write_text("\n".join([rows[0], "x,,,,,", *rows[1:]]) + "\n", encoding="utf-8")
    assert "is not a number" in refused(hil, "bad.csv", *to)
    Path("names.csv").write_text("a,b\n1,2\n", encoding="utf-8")
    assert "--map" in refused(hil, "names.csv", *to)
    Path("map.toml").write_text('[columns]\nest_q = { column = "x" }\n', encoding="utf-8")
    assert "columns.est_q" in refused(hil, "log.csv", "--map", "map.toml", *to)
    Path("zero.toml").write_text(
        '[columns]\nest_x_m = { column = "x", scale = 0.0 }\n', encoding="utf-8"
    )
    assert "must not be 0" in refused(hil, "log.csv", "--map", "zero.toml", *to)
    Path("mm.toml").write_text(
        't = { column = "t_s" }\n[columns]\neta1_cmd_m_s = { column = "v_cmd", scale = 1000.0 }\n'
        'est_x_m = { column = "x" }\nest_y_m = { column = "y" }\n', encoding="utf-8"
    )  # fmt: skip
    assert "in mm/s?" in refused(hil, "log.csv", "--map", "mm.toml", *to)
    assert "no such folder" in refused(hil, "log.csv", "--robot", "nowhere/out.toml")
    assert "ends in .toml" in refused(hil, "log.csv", "--robot", "out.txt")
    Path("plain.toml").write_text('base = "thesis-4wd"\n', encoding="utf-8")
    assert "no fitted twin" in refused(hil, "log.csv", "--replay", "--robot", "plain.toml")


def test_an_imported_record_is_replayed_on_a_twin_fitted_to_it(
    hil: Command, tmp_path: Path, log: Log
) -> None:
    """`hil replay IMPORTED --fit` foretells the part held out; with another law it is refused."""
    table, mapping = mapped(tmp_path, log)
    task = 'scenario = "circle"\nset = ["requirements=[]"]\nouter = "pid"\n'
    mapping.write_text(task + mapping.read_text(encoding="utf-8"), encoding="utf-8")
    # `hil import` wants a command in each row that has a pose.
    rows, held = table.read_text(encoding="utf-8").splitlines(), "0.0,0.0"
    whole = [rows[0]]
    for row in rows[1:]:
        cells = row.split(",")
        held = ",".join(cells[4:]) if cells[4] else held
        if cells[1]:
            whole.append(",".join([*cells[:4], held]))
    table.write_text("\n".join(whole) + "\n", encoding="utf-8")
    assert hil("import", "mm.csv", "--map", "map.toml", "--out", "imported")[0] == 0
    status, out, err = hil("replay", "imported", "--fit", "--out", "again", "--json")
    assert status == 0, err
    scores = json.loads(out)["held_out"]["scores"]
    twin, word = (
        scores["fitted twin"],
        scores["commands taken at their word"]
        if ("commands taken at their word" in scores)
        else scores["plain odometry (commands)"],
    )
    assert twin["position_rms_m"] < word["position_rms_m"]
    assert Path("again/replay.json").is_file()
    assert Path("again/replay.html").is_file()
    status, _, err = hil("replay", "imported", "--fit", "--outer", "pid")
    assert status == 2
    assert "imported log" in err
