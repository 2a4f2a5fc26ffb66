"""What a campaign says of its rows: intervals over seeds and draws, words that fit the figure."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest

from hil.analysis.intervals import mean_interval
from hil.analysis.metrics import METRICS
from hil.study.campaign.findings import Outcomes, documents, outcomes_of, sentences
from hil.study.campaign.maps import write_page
from hil.study.campaign.plan import Job, load_campaign
from hil.study.campaign.results import row_of, schema_of

MASSES = "[2.7, 2.7001, 2.7002, 2.7003, 2.7004, 2.7005, 2.7006, 2.7007, 2.7008, 2.7009]"
GRID = f'[grid]\n"link.latency_s" = [0.02, 0.05]\n"robot.mass_kg" = {MASSES}\n'


def outcomes(folder: Path, text: str, figure: Callable[[Job], float]) -> Outcomes:
    """Return a campaign's outcomes without running it: every figure of a job is `figure(job)`."""
    path = folder / "campaign.toml"
    path.write_text(f'scenario = "scenario-1"\n{text}', encoding="utf-8")
    campaign = load_campaign(str(path))
    rows = []
    for job in campaign.jobs():
        value = figure(job)
        outcome = "fault" if math.isnan(value) else "complete"
        figures = [] if outcome == "fault" else [(metric.name, value) for metric in METRICS]
        rows.append(row_of(job, outcome, "", outcome == "complete", 1.0, figures))
    return outcomes_of(campaign, pa.Table.from_pylist(rows, schema_of(campaign)))


def of_seed(job: Job) -> float:
    """Return 1, and for ASG-ISM what the seed adds to it; the point adds a millionth."""
    own = np.random.default_rng(job.seed).normal(0.2, 1.0)
    mass = float(dict(job.point)["robot.mass_kg"])
    return 1.0 + (own + 1e-3 * (mass - 2.7) if job.outer == "asg-ism" else 0.0)


def test_points_of_a_seed_are_one_tape(tmp_path: Path) -> None:
    """6 seeds at 10 masses that hardly differ: the interval of six values, not of sixty."""
    found = outcomes(tmp_path, f'seeds = 6\nfigures = ["iae_m_s"]\n{GRID}', of_seed)
    six = np.array([np.random.default_rng(seed).normal(0.2, 1.0) for seed in range(1, 7)])
    expected = mean_interval(six)
    for station in found.stations("link.latency_s"):
        result = found.difference("iae_m_s", 1, station.pairs)
        assert (result.pairs, result.tapes) == (60, 6)
        assert result.interval.low == pytest.approx(expected.low, abs=1e-4)
        assert result.interval.high == pytest.approx(expected.high, abs=1e-4)
        mean, span = found.level("iae_m_s", 1, station.pairs)
        assert mean == pytest.approx(1.0 + six.mean(), abs=1e-5)
        assert span.high - span.low == pytest.approx(expected.high - expected.low, abs=1e-4)
    tree = next(iter(documents(found)))["stations"][0]
    assert (tree["pairs"], tree["tapes"]) == (60, 6)


def test_draws_in_common_are_tapes_too(tmp_path: Path) -> None:
    """What a draw adds at every seed does not average out over the seeds: 5 draws of 40 seeds."""
    text = (
        'seeds = 40\ndraws = 5\nfigures = ["iae_m_s"]\n'
        '[random]\n"robot.mass_kg" = { kind = "uniform", low = 2.2, high = 3.4 }\n'
        '[grid]\n"link.latency_s" = [0.02]\n'
    )

    def of_draw(job: Job) -> float:
        own = np.random.default_rng(job.draw).normal() + 0.01 * (job.seed % 7)
        return own if job.outer == "asg-ism" else 0.0

    found = outcomes(tmp_path, text, of_draw)
    result = found.difference("iae_m_s", 1, found.stations("link.latency_s")[0].pairs)
    five = np.array([np.random.default_rng(draw).normal() for draw in range(5)])
    reach = 2.776445 * five.std(ddof=1) / math.sqrt(5)  # Student's t with 4 degrees of freedom
    assert (result.pairs, result.tapes) == (200, 5)
    assert 0.5 * (result.interval.high - result.interval.low) == pytest.approx(reach, rel=0.05)


def test_one_seed_and_no_runs_are_said(tmp_path: Path) -> None:
    """Without a second seed nothing is sure; without a run there is nothing to compare."""
    text = 'seeds = {}\nfigures = ["iae_m_s"]\n[grid]\n"link.latency_s" = [0.02, 0.05]\n'

    def broken_at_50_ms(job: Job) -> float:
        if dict(job.point)["link.latency_s"] == 0.05:
            return math.nan
        return 1.0 + (0.1 * job.seed if job.outer == "asg-ism" else 0.0)

    one, many = (outcomes(tmp_path, text.format(n), broken_at_50_ms) for n in (1, 8))
    assert "known from one seed alone at 0.02; without runs to compare at 0.05" in sentences(one)[0]
    assert "worse at 0.02; without runs to compare at 0.05" in sentences(many)[0]


def test_a_figure_that_has_no_better_is_lower_or_higher(tmp_path: Path) -> None:
    """A net turn is no merit: the words are higher and lower, on the page too."""
    text = (
        'seeds = 8\nfigures = ["turn_rad", "holds"]\n[grid]\n"link.latency_s" = [0.02]\n'
        '"link.loss_ratio" = [0.0, 0.1]\n'
    )
    found = outcomes(tmp_path, text, lambda job: job.seed * (1.0 + (job.outer == "pid")))
    lines = [line for line in sentences(found) if line.startswith("net turn")]
    assert lines
    assert all("is lower at" in line and "better" not in line for line in lines)
    write_page(tmp_path / "page.html", found, "hil sweep")
    page = (tmp_path / "page.html").read_text(encoding="utf-8")
    assert "neither" not in page
