"""A campaign file becomes the runs it says, and every mistake in it is one line."""

from __future__ import annotations

import math
import re
import statistics
import subprocess
import sys
from pathlib import Path
from random import Random

import pyarrow.parquet as pq
import pytest
from pydantic import ValidationError

from hil.config.load import builtin_names
from hil.core.errors import BadInput
from hil.study.campaign.axes import Distribution, Range
from hil.study.campaign.findings import outcomes_of
from hil.study.campaign.plan import ROW_COLUMNS, Campaign, load_campaign
from hil.study.campaign.results import schema_of
from hil.study.campaign.work import run_campaign


def campaign(folder: Path, text: str) -> Campaign:
    path = folder / "campaign.toml"
    path.write_text(f'scenario = "scenario-1"\n{text}', encoding="utf-8")
    return load_campaign(str(path))


def test_runs_are_the_product_of_grid_lists_draws_seeds_and_laws(tmp_path: Path) -> None:
    """2 grid points x 3 in step x 2 draws x 2 seeds x 2 laws = 48 runs, laws beside each other."""
    found = campaign(
        tmp_path,
        """
        seeds = 2
        draws = 2
        [grid.link]
        latency_s = [0.01, 0.02]
        [[together]]
        "camera.latency_s" = [0.05, 0.06, 0.07]
        "link.latency_jitter_s" = [0.0, 0.005, 0.01]
        [random]
        "robot.mass_kg" = { kind = "uniform", low = 2.0, high = 3.0 }
        """,
    )
    jobs = found.jobs()
    assert len(jobs) == 48
    assert [job.index for job in jobs] == list(range(48))
    first, second = jobs[0], jobs[1]
    assert (first.outer, second.outer) == ("pid", "asg-ism")
    assert (first.point, first.seed, first.draw) == (second.point, second.seed, second.draw)
    in_step = {
        (dict(j.point)["camera.latency_s"], dict(j.point)["link.latency_jitter_s"]) for j in jobs
    }
    assert in_step == {(0.05, 0.0), (0.06, 0.005), (0.07, 0.01)}
    masses = {(job.draw, dict(job.point)["robot.mass_kg"]) for job in jobs}
    assert len(masses) == 2  # a draw is the same at every point and for every law
    assert found.scenario(first.point).link.latency_s == 0.01


def test_ranges_and_distributions() -> None:
    """Both ends belong to a range; equal ratios on a log scale; draws stay in their bounds."""
    assert Range(first=0, last=1, count=5).points() == [0, 0.25, 0.5, 0.75, 1]
    log = Range(first=0.01, last=1, count=3, scale="log").points()
    assert log == pytest.approx([0.01, 0.1, 1.0])
    rng = Random(3)
    uniform = Distribution(kind="uniform", low=2, high=4)
    values = [uniform.draw(rng) for _ in range(2000)]
    assert 2 <= min(values) < max(values) <= 4
    assert statistics.fmean(values) == pytest.approx(3.0, abs=0.05)
    loguniform = Distribution(kind="loguniform", low=0.01, high=1)
    logs = [math.log10(loguniform.draw(rng)) for _ in range(2000)]
    assert statistics.fmean(logs) == pytest.approx(-1.0, abs=0.05)
    normal = Distribution(kind="normal", mean=1, sd=0.5, low=0)
    drawn = [normal.draw(rng) for _ in range(2000)]
    assert min(drawn) > 0
    assert len(set(drawn)) == 2000


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ('[grid]\n"link.latencyy_s" = [1]', "link.latency_s"),
        ('[grid]\n"link.latency_s" = [0.01, -1]', "link.latency_s = -1"),
        ('[grid]\n"link.latency_s" = { first = 1, last = 2, count = 1 }', "count"),
        ("seedz = 3", "unknown key 'seedz'; near: seed"),
        ("draws = 3", "nothing to draw"),
        ('figures = ["ise"]', "no such figure"),
        ('[[together]]\n"link.latency_s" = [0.1]\n"link.baud" = [9600, 57600]', "differ in length"),
        (
            '[grid]\n"robot.mass_kg" = [3]\n[random."robot.mass_kg"]\nkind = "normal"',
            "varied twice",
        ),
        ('[random."robot.mass_kg"]\nkind = "uniform"', "needs low and high"),
        ("[grid", "not valid TOML"),
        (
            '[grid]\n"link.latency_s" = [0.02, 0.03]\n"link" = [{baud = 57600}, {baud = 115200}]',
            "link.latency_s lies in link",
        ),
        (
            '[grid]\n"link" = [{baud = 57600}]\n[random]\n'
            '"link.loss_ratio" = { kind = "uniform", low = 0.0, high = 0.1 }',
            "link.loss_ratio lies in link",
        ),
        (
            '[grid]\n"requirements.0.max" = [1.0]\n[[together]]\n"requirements.00.max" = [2.0]',
            "varied twice",
        ),
        ('set = ["link.latency_s=0.1"]\n[grid]\n"link.latency_s" = [0.01]', "is varied as"),
        ('set = ["link.baud=9600"]\n[grid]\n"link" = [{latency_s = 0.01}]', "is varied as link"),
        ('[grid]\n"link.latency_s" = []', "at least one value"),
        ('[[together]]\n"link.latency_s" = []', "at least one value"),
        ("[[together]]", "an empty table"),
        ('[grid]\n"link.latency_s" = [0.02, 0.02]', "are the same"),
        ('[grid]\n"link.baud" = [57600, 57600.0]', "are the same"),
        ('[grid]\n"link.latency_s" = { first = 0.02, last = 0.02, count = 3 }', "are the same"),
        (
            '[[together]]\n"link.latency_s" = [0.02, 0.03, 0.02]\n"link.loss_ratio" = [0, 0.1, 0]',
            "link.latency_s = 0.02, link.loss_ratio = 0 are the same",
        ),
        ('outer = ["pid", "pid"]', "outer: pid is named twice"),
        ('inner = ["pid", "pid"]', "inner: pid is named twice"),
        ('figures = ["holds", "holds"]', "figures: holds is named twice"),
    ],
)
def test_mistakes_are_named(tmp_path: Path, text: str, said: str) -> None:
    """Each is refused before anything runs."""
    with pytest.raises(BadInput) as refusal:
        campaign(tmp_path, text)
    assert said in str(refusal.value)
    assert "\n" not in str(refusal.value)


def test_a_value_may_come_again_beside_another(tmp_path: Path) -> None:
    """Lists in step are rows: one value twice is two points when the row differs."""
    found = campaign(
        tmp_path,
        '[[together]]\n"link.latency_s" = [0.02, 0.02]\n"link.loss_ratio" = [0.0, 0.1]\n'
        '[grid]\n"link.baud" = [57600]\n"link.latency_jitter_s" = [0.0]',
    )
    assert len(found.grid_points()) == 2


def test_empty_list_ends_the_command_with_one_line(tmp_path: Path) -> None:
    """Through the command: status 2, one line, and no folder."""
    path = tmp_path / "c.toml"
    path.write_text('scenario = "scenario-1"\n[grid]\n"link.latency_s" = []\n', encoding="utf-8")
    done = subprocess.run(
        [sys.executable, "-m", "hil", "sweep", str(path), "--out", str(tmp_path / "s")],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 2
    assert len(done.stderr.splitlines()) == 1
    assert "link.latency_s = []" in done.stderr
    assert not (tmp_path / "s").exists()


def test_built_in_campaigns_are_sound():
    """Every campaign that ships loads, and the large one has the runs its text promises."""
    found = {name: load_campaign(name) for name in builtin_names("campaigns")}
    assert len(found["limits"].jobs()) == 10_000
    assert all(campaign.file.name == name for name, campaign in found.items())


def test_bounded_normal_is_drawn_again_and_not_piled_up() -> None:
    """Half of it lies below the bound: the mean of the rest is that of the cut-off normal.

    Its density ratio at the bound, a = (0.9 - 1.0) / 0.4 = -0.25: mean 1 + 0.4 phi(a) / (1 - Phi(a)),
    phi = 0.38667, Phi = 0.40129, which is 1.2583.
    """
    bounded = Distribution(kind="normal", mean=1.0, sd=0.4, low=0.9)
    rng = Random(1)
    values = [bounded.draw(rng) for _ in range(4000)]
    assert values.count(0.9) == 0
    assert statistics.fmean(values) == pytest.approx(1.2583, abs=0.015)
    with pytest.raises(ValidationError, match="lies within low and high"):
        Distribution(kind="normal", mean=0.0, sd=0.1, low=1.0)


def test_the_length_of_a_run_is_varied_beside_the_figure_of_its_name(tmp_path: Path) -> None:
    """What was asked has a column of its own; the figure says how long each run lasted."""
    file = tmp_path / "lengths.toml"
    file.write_text(
        'scenario = "scenario-1"\ncamera = "pose"\nouter = ["pid", "asg-ism"]\nfigures = ["iae_m_s"]\n'
        "[grid]\nduration_s = [0.5, 1.0]\n"
    )
    campaign = load_campaign(str(file))
    run_campaign(campaign, tmp_path / "out", workers=1)
    table = pq.read_table(tmp_path / "out" / "results.parquet")
    assert table.column("scenario.duration_s").to_pylist() == [0.5, 0.5, 1.0, 1.0]
    assert table.column("duration_s").to_pylist() == pytest.approx([0.5, 0.5, 1.0, 1.0])
    stations = outcomes_of(campaign, table).stations("duration_s")
    assert [station.value for station in stations] == [0.5, 1.0]


@pytest.mark.parametrize(
    ("grid", "figure", "said"),
    [
        (
            'camera_source = ["pose", "rendered"]',
            "camera_source",
            "camera_source: cannot be varied",
        ),
        ('"link.loss_ratio" = [0.0, 0.1]', "seed", "figure 'seed': tables have a column seed"),
        ('"link.loss_ratio" = [0.0, 0.1]', "index", "figure 'index': tables have a column index"),
    ],
)
def test_no_two_columns_have_one_name(tmp_path: Path, grid: str, figure: str, said: str) -> None:
    """It is said before anything is run or made: a row has room for one value of a name."""
    figures = ""
    if figure:
        own = tmp_path / f"{figure}_figure.py"
        own.write_text(
            f'import hil\n\n\n@hil.figure("{figure}", unit="m", meaning="a test\'s")\n'
            "def given(run):\n    return 7.0\n"
        )
        figures = f'figures = ["{own}"]\n'
    file = tmp_path / "clash.toml"
    file.write_text(f'scenario = "scenario-1"\ncamera = "pose"\n{figures}[grid]\n{grid}\n')
    with pytest.raises(BadInput, match=re.escape(said)):
        load_campaign(str(file))


def test_the_columns_that_names_are_kept_from_are_those_of_the_results():
    """What is refused as a name is what a row has beside varied values and figures."""
    made = load_campaign("layer")
    names = schema_of(made).names
    assert len(names) == len(set(names))
    assert set(names) - set(made.axes) - set(made.figures) == ROW_COLUMNS
