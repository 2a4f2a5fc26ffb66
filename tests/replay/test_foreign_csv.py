"""CSV of other programs: what cannot be read rightly is refused by row, or repaired and said."""

from __future__ import annotations

import json
import warnings
from pathlib import Path

import numpy as np
import pytest

from hil.record.reader import read_run
from tests.replay.logs import MAP, Command, arc_rows, hil, write_rows

__all__ = ["hil"]


def changed(path: Path, extra: str) -> None:
    """Put keys at the top of a mapping."""
    path.write_text(extra + "\n" + path.read_text(encoding="utf-8"), encoding="utf-8")


def speeds(folder: str) -> np.ndarray:
    return read_run(Path(folder)).samples["est_eta1_m_s"]


def test_time_that_falls_back_is_refused_by_its_row(hil: Command) -> None:
    """From the 151st row on times are 2.147 s less: that row is named, and no folder is left."""
    rows = [(t - 2.147 * (k >= 150), *pose) for k, (t, *pose) in enumerate(arc_rows())]
    write_rows(Path("log.csv"), rows)
    status, out, err = hil("import", "log.csv", "--map", "log.toml", "--out", "run")
    assert status == 2
    assert "row 151 (line 152)" in err
    assert "falls back by 2.097 s" in err  # 2.147 s less one period
    assert out == ""
    assert err.count("\n") == 1
    assert not Path("run").exists()


def test_time_that_falls_back_is_cut_when_asked(hil: Command) -> None:
    """150 rows stay, the note counts the other 50; the speed stays 0.3 m/s."""
    rows = [(t - 2.147 * (k >= 150), *pose) for k, (t, *pose) in enumerate(arc_rows())]
    write_rows(Path("log.csv"), rows)
    changed(Path("log.toml"), 'disorder = "cut"')
    status, out, _ = hil("import", "log.csv", "--map", "log.toml", "--out", "run", "--json")
    assert status == 0
    assert any("50 of 200 rows left out" in note for note in json.loads(out)["notes"])
    assert speeds("run") == pytest.approx(np.full(150, 0.3), abs=1e-3)


@pytest.mark.parametrize("wrong_s", [-3.0, 4000.0])
def test_one_damaged_time_costs_its_row(hil: Command, wrong_s: float) -> None:
    """A single time outside those of its neighbours is left out and said; two halves are not."""
    rows = [(wrong_s if k == 77 else t, *pose) for k, (t, *pose) in enumerate(arc_rows())]
    write_rows(Path("log.csv"), rows)
    status, _, err = hil("import", "log.csv", "--map", "log.toml", "--out", "run")
    assert status == 0
    assert "1 of 200 rows have a time outside those of their neighbours" in err
    assert speeds("run") == pytest.approx(np.full(199, 0.3), abs=2e-3)


def test_shuffled_rows_are_sorted_when_asked(hil: Command) -> None:
    rows = arc_rows()
    write_rows(Path("log.csv"), rows[100:] + rows[:100])
    assert hil("import", "log.csv", "--map", "log.toml", "--out", "a")[0] == 2
    changed(Path("log.toml"), 'disorder = "sort"')
    status, _, err = hil("import", "log.csv", "--map", "log.toml", "--out", "b")
    assert status == 0
    assert "sorted" in err
    assert speeds("b") == pytest.approx(np.full(200, 0.3), abs=1e-3)


@pytest.mark.parametrize(("wraps_at", "unit_s"), [(2**32, 1e-6), (2**16, 1e-3)])
def test_a_counter_that_wraps_is_counted_on(hil: Command, wraps_at: int, unit_s: float) -> None:
    """A 32-bit count of microseconds, a 16-bit one of milliseconds: 10 s of log stay 10 s."""
    first = wraps_at - round(5.0 / unit_s)
    rows = [((first + round(t / unit_s)) % wraps_at, *pose) for t, *pose in arc_rows()]
    write_rows(Path("log.csv"), rows)
    plain = MAP.replace('t = { column = "t" }', f't = {{ column = "t", scale = {unit_s} }}')
    Path("log.toml").write_text(plain, encoding="utf-8")
    status, _, err = hil("import", "log.csv", "--map", "log.toml", "--out", "a")
    assert status == 2
    assert f"wraps_at = {wraps_at}" in err
    assert "row 101" in err
    Path("log.toml").write_text(plain.replace(" }", f", wraps_at = {wraps_at} }}", 1), "utf-8")
    assert hil("import", "log.csv", "--map", "log.toml", "--out", "b")[0] == 0
    assert read_run(Path("b")).samples["t_s"][-1] == pytest.approx(9.95)
    assert speeds("b") == pytest.approx(np.full(200, 0.3), abs=2e-3)


@pytest.mark.parametrize("mark", [";", "\t", ","])
def test_a_spreadsheet_with_decimal_commas(hil: Command, mark: str) -> None:
    """Columns parted by semicolons, tabs, or commas around quoted numbers: the same record."""
    lines = [mark.join(["t", "x", "y", "theta"])]
    quote = '"' if mark == "," else ""
    for row in arc_rows():
        lines.append(mark.join(quote + f"{v:.5f}".replace(".", ",") + quote for v in row))
    Path("log.csv").write_text("\n".join(lines), encoding="utf-8")
    Path("log.toml").write_text(MAP, encoding="utf-8")
    status, _, err = hil("import", "log.csv", "--map", "log.toml", "--out", "run")
    assert status == 0
    assert "decimal commas in t, theta, x, y" in err
    assert speeds("run") == pytest.approx(np.full(200, 0.3), abs=2e-3)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("t,x,y,theta\n0,05,1,0,2,5\n", "6 cells, the heading has 4"),
        ("t;x;y;theta\n0;1,234;0;0\n1;1,500;0;0\n", "may have a decimal comma"),
        ("t;x;y;theta\n0;1,25;0;0\n1;1.5;0;0\n", "may have a decimal comma"),
        ("t,x,y,theta\n0,0,0,0\n1,0.1 m,0,0\n", "row 2 (line 3), column 'x': '0.1 m'"),
        ("t,x,y,theta\n0,0,0,0\n1,1_000,0,0\n", "'1_000' is not a number"),
        ("t,x,y,theta\n0,0,0,0\n1,1e999,0,0\n", "'1e999' is not a number"),
        ("t,x,y,theta\n0,0,0,0\n1,inf,0,0\n", "'inf' is not a number"),
        ("t,x,y,x,theta\n0,0,0,0,0\n1,0,0,0,0\n", "2 columns are called 'x'"),
        ("t,x,y,theta\n", "no rows below it"),
        ("", "is empty"),
        ("\0\1\2\3", "is binary, not CSV"),
        ("t,x,y,th\n0,0,0,0,9\n1,1,0,0,9\n", "5 cells, the heading has 4"),
        ("t,x,y,th\n0,0,0,0\n1,1,0,0\n", "no column 'theta'"),
        ("t,x,y,theta\n0,0,0,\n1,1,0,\n", "0 poses with a time of their own"),
        ("t,x,y,theta\n5,0,0,0\n5,1,0,0\n", "1 poses with a time of their own"),
    ],
)
def test_what_cannot_be_read_is_one_line(hil: Command, text: str, said: str) -> None:
    """Row, column and text, status 2, nothing written."""
    Path("log.csv").write_text(text, encoding="utf-8")
    Path("log.toml").write_text(MAP, encoding="utf-8")
    status, out, err = hil("import", "log.csv", "--map", "log.toml", "--out", "run")
    assert (status, out) == (2, "")
    assert said in err
    assert err.count("\n") == 1
    assert not Path("run").exists()


def test_the_mapping_says_what_a_comma_is(hil: Command) -> None:
    """The same cell is 1.234 or 1234."""
    for decimal, value in ((",", 1.234), (".", 1234.0)):
        write_rows(Path("log.csv"), [("0", "1,234", "0", "0"), ("1", "1,234", "0", "0")],
                   "t;x;y;theta")  # fmt: skip
        changed(Path("log.toml"), f'decimal = "{decimal}"')
        hil("import", "log.csv", "--map", "log.toml", "--out", f"run{value:.0f}")
        assert read_run(Path(f"run{value:.0f}")).samples["est_x_m"][0] == value


def test_topics_on_one_time_column(hil: Command) -> None:
    """A row per pose; the commands between hold; no figure of the pose is missing."""
    rows: list[tuple[object, ...]] = []
    for k, (t, *pose) in enumerate(arc_rows()):
        rows.append((t, *pose, "", ""))
        rows.append((t + 0.01, "", "", "", 0.1 * (k // 100), 12.0))
    write_rows(Path("log.csv"), rows, "t,x,y,theta,v,battery")
    Path("log.toml").write_text(
        MAP + 'eta1_cmd_m_s = { column = "v" }\nbattery_v = { column = "battery" }\n', "utf-8"
    )
    status, out, _ = hil("import", "log.csv", "--map", "log.toml", "--out", "run", "--json")
    assert status == 0
    samples = read_run(Path("run")).samples
    assert samples["t_s"].size == 200
    assert samples["est_eta1_m_s"] == pytest.approx(np.full(200, 0.3), abs=1e-3)
    assert np.isnan(samples["battery_v"][0])
    assert (samples["battery_v"][1:] == 12.0).all()
    assert samples["eta1_cmd_m_s"][[1, 100, 101, 199]].tolist() == [0.0, 0.0, 0.1, 0.1]
    document = json.loads(out)
    assert any("200 of 400 rows have no pose" in note for note in document["notes"])
    assert document["figures"]["ise_m2_s"] is not None


def test_topics_of_one_time_are_one_row(hil: Command) -> None:
    """X and y in one row, theta in the next of the same time: they are the pose of that time."""
    rows: list[tuple[object, ...]] = []
    for t, x, y, theta in arc_rows():
        rows += [(t, x, y, ""), (t, "", "", theta)]
    write_rows(Path("log.csv"), rows)
    assert hil("import", "log.csv", "--map", "log.toml", "--out", "run")[0] == 0
    samples = read_run(Path("run")).samples
    assert samples["t_s"].size == 200
    assert samples["est_theta_rad"] == pytest.approx([row[3] for row in arc_rows()])


def test_one_row_without_a_pose(hil: Command) -> None:
    """One row in 200 is left out and said; the figures stay."""
    rows = [row if k != 90 else (row[0], "", "n/a", "") for k, row in enumerate(arc_rows())]
    write_rows(Path("log.csv"), rows)
    status, _, err = hil("import", "log.csv", "--map", "log.toml", "--out", "run")
    assert status == 0
    assert "1 of 200 rows have no pose" in err
    assert "1 cells of 'y'" in err
    assert np.isfinite(speeds("run")).all()


def test_equal_times_make_no_nan(hil: Command) -> None:
    """The later rows of one time are left out and counted; numpy has nothing to warn of."""
    rows = arc_rows()
    write_rows(Path("log.csv"), [rows[k - k % 2 * (k < 40)] for k in range(200)])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        status, _, err = hil("import", "log.csv", "--map", "log.toml", "--out", "run")
    assert status == 0
    assert "20 of 200 poses have the time of the one before" in err
    assert speeds("run") == pytest.approx(np.full(180, 0.3), abs=2e-3)


def test_one_of_several_vehicles(hil: Command) -> None:
    """Rows of two vehicles: the jumps are said; `only` takes one."""
    rows: list[tuple[object, ...]] = []
    for t, *pose in arc_rows():
        rows += [(t, *pose, 3), (t + 0.02, 5.0, -4.0, 0.0, 7)]
    write_rows(Path("log.csv"), rows, "t,x,y,theta,id")
    assert "two robots in one log" in hil("import", "log.csv", "--map", "log.toml")[2]
    changed(Path("log.toml"), 'only = { id = "3" }')
    status, _, err = hil("import", "log.csv", "--map", "log.toml", "--out", "run")
    assert status == 0
    assert "jumps" not in err
    assert speeds("run") == pytest.approx(np.full(200, 0.3), abs=1e-3)
    Path("log.toml").write_text('only = { id = "4" }\n' + MAP, encoding="utf-8")
    assert "no row has id = '4'" in hil("import", "log.csv", "--map", "log.toml")[2]


def test_a_figure_without_a_value_is_said(hil: Command) -> None:
    """A robot that never comes near: the requirement fails in words, with status 1 and null."""
    write_rows(Path("log.csv"), arc_rows())
    far = 'requirements=[{metric=\\"settling_20mm_s\\", max=5.0}]'
    mapping = MAP.replace('set = ["requirements=[]"]', f'set = ["{far}"]')
    Path("log.toml").write_text(mapping, encoding="utf-8")
    status, out, _ = hil("import", "log.csv", "--map", "log.toml", "--out", "run")
    assert status == 1
    assert "has no value in this run" in out
    assert "nan" not in out.lower()


def test_status_and_notes_of_a_verdict(hil: Command) -> None:
    """A log that fails a requirement ends with 1; an assumed task and a short log are said."""
    write_rows(Path("log.csv"), arc_rows(20))
    columns = MAP.partition("t = {")[2]
    Path("log.toml").write_text("t = {" + columns, encoding="utf-8")
    status, out, err = hil("import", "log.csv", "--map", "log.toml", "--out", "run")
    assert status == 1
    assert "FAILS" in out
    assert "scenario-1 assumed" in err
    assert "lasts 0.95 s, scenario-1 takes 20 s" in err
    kept = [event.text for event in read_run(Path("run")).events if event.kind == "note"]
    assert len(kept) == 2


def test_columns_called_as_in_a_record_need_no_mapping(hil: Command) -> None:
    """What `hil export --to csv` wrote, or a program that uses its names, is read as it stands."""
    hil("run", "scenario-1", "--camera", "pose", "--set", "duration_s=0.5", "--out", "run")
    hil("export", "run", "--to", "csv", "--out", "run.csv")
    hil("import", "run.csv", "--out", "back")
    made, back = read_run(Path("run")).samples, read_run(Path("back")).samples
    for name in ("t_s", "est_x_m", "est_y_m", "est_eta1_m_s", "omega_cmd_left_rad_s", "battery_v"):
        assert back[name].tobytes() == made[name].tobytes(), name
    text = Path("run.csv").read_text(encoding="utf-8")
    Path("other.csv").write_text(text.replace("est_y_m", "y", 1), encoding="utf-8")
    status, _, said = hil("import", "other.csv", "--out", "none")
    assert (status, "gives no est_y_m" in said) == (2, True)
