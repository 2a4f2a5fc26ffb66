"""Figures for a paper: each in three formats and two widths, with the numbers that are drawn."""

from __future__ import annotations

import csv
import re

import numpy as np
import pytest
from click.testing import CliRunner

from hil.cli.compare import command
from tests.record.synthetic import make_run


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    top = tmp_path_factory.mktemp("paper")
    runs = [str(make_run(top / law, law).path) for law in ("pid", "asg-ism")]
    asked = [*runs, "--figures", str(top / "figures"), "--json"]
    done = CliRunner().invoke(command, asked, standalone_mode=False, catch_exceptions=False)
    assert done.exception is None
    return top


def test_every_figure_is_there_in_each_format_and_width(folder):
    """Path, error, control, sliding variable and wheels: SVG, PDF and PNG, one and two columns."""
    found = {path.name for path in (folder / "figures").iterdir()}
    for name in ("path", "error", "control", "sliding", "wheels"):
        stem = f"scenario-1-{name}"
        wanted = {f"{stem}-{n}col.{kind}" for n in (1, 2) for kind in ("svg", "pdf", "png")}
        assert wanted | {f"{stem}.csv"} <= found
    assert not [name for name in found if name.endswith(".part")]


def test_widths_are_those_of_one_and_two_columns(folder):
    """3.5 in and 7.16 in, in points of 1/72 in, whatever the number of panels."""
    for columns, width_in in ((1, 3.5), (2, 7.16)):
        text = (folder / "figures" / f"scenario-1-error-{columns}col.svg").read_text("utf-8")
        width_pt = float(re.search(r'width="([\d.]+)pt"', text)[1])
        assert width_pt == pytest.approx(72.0 * width_in, abs=0.1)


def test_the_data_are_the_lines_that_are_drawn(folder):
    """The path in the CSV ends where the record's robot ends."""
    from hil.record.reader import read_run  # noqa: PLC0415

    with (folder / "figures" / "scenario-1-path.csv").open(encoding="utf-8") as file:
        rows = [row for row in csv.DictReader(file) if row["panel"] == "1" and row["line"] == "pid"]
    samples = read_run(folder / "pid").samples
    last = np.array([float(rows[-1]["x"]), float(rows[-1]["y"])])
    assert last == pytest.approx([samples["true_x_m"][-1], samples["true_y_m"][-1]], abs=1e-6)
    assert rows[0]["x_title"] == "X in m"


def test_a_folder_that_cannot_be_made_is_refused_by_name(folder):
    """A file stands in its place: one line that names the option."""
    (folder / "file").write_text("")
    asked = [str(folder / "pid"), str(folder / "asg-ism"), "--figures", str(folder / "file" / "x")]
    done = CliRunner().invoke(command, asked, standalone_mode=False)
    assert "--figures" in str(done.exception)
    assert "cannot be made" in str(done.exception)
