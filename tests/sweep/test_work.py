"""Campaigns run to their end whatever happens on the way, with the same results everywhere."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

from hil.cli.sweep import program_lines
from hil.core.errors import BadInput, RigFault
from hil.core.figures import METRICS
from hil.runs.execute import RunSpec, execute
from hil.study.campaign import growth, many_rows, merge
from hil.study.campaign.cluster import on_dask
from hil.study.campaign.findings import documents, outcomes_of, sentences
from hil.study.campaign.maps import write_page
from hil.study.campaign.plan import Campaign, load_campaign
from hil.study.campaign.results import ResultStore, program, programs
from hil.study.campaign.work import Worker, run_campaign
from hil.study.campaign.workers import Pool, in_processes
from tests.sweep.deadly import Counts, DiesOnce, always_dies, dies_on_three, looked_through

TEXT = """
scenario = "scenario-1"
set = ["duration_s=0.6"]
seeds = 2
[grid]
"link.latency_s" = [0.01, 0.05]
"camera.latency_s" = [0.05, 0.08]
"""


@pytest.fixture(scope="module")
def campaign(tmp_path_factory: pytest.TempPathFactory) -> Campaign:
    """16 runs of 0.6 s."""
    path = tmp_path_factory.mktemp("sweep") / "delays.toml"
    path.write_text(TEXT, encoding="utf-8")
    return load_campaign(str(path))


@pytest.fixture(scope="module")
def finished(campaign: Campaign, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Run it on two processes."""
    folder = tmp_path_factory.mktemp("sweep") / "results"
    run_campaign(campaign, folder, workers=2)
    return folder


def test_rows_are_the_figures_of_full_runs(
    campaign: Campaign, finished: Path, tmp_path: Path
) -> None:
    """A run kept in memory has exactly the figures of the same run with a record."""
    row = pq.read_table(finished / "results.parquet").to_pylist()[5]
    job = campaign.jobs()[5]
    spec = RunSpec(
        campaign.scenario(job.point), "twin", "pose", job.outer, job.inner, job.seed,
        tmp_path / "run", rerun=False,
    )  # fmt: skip
    values = execute(spec).figures().values
    for metric in METRICS:
        value = values[metric.name]
        assert row[metric.name] == (None if math.isnan(value) else value), metric.name


def test_interrupted_campaign_goes_on(campaign: Campaign, finished: Path, tmp_path: Path) -> None:
    """Rows of an earlier attempt are not run again, and the file is the same, byte for byte."""
    folder = tmp_path / "again"
    store = ResultStore(folder, campaign)
    for job in campaign.jobs()[3:9]:
        store.add(Worker(campaign)(job).row)
    store.flush()
    calls: list[tuple[int, int]] = []
    _, totals = run_campaign(campaign, folder, 2, progress=lambda a, b: calls.append((a, b)))
    assert totals.runs_now == 10
    assert calls[-1] == (16, 16)
    assert (folder / "results.parquet").read_bytes() == (finished / "results.parquet").read_bytes()
    _, totals = run_campaign(campaign, folder, 2)
    assert totals.runs_now == 0


def test_cluster_gives_the_same_file(campaign: Campaign, finished: Path, tmp_path: Path) -> None:
    """Two Dask workers give what two processes give, byte for byte."""
    distributed = pytest.importorskip("distributed")
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, dashboard_address=None, silence_logs=50
    ) as cluster:
        run_campaign(campaign, tmp_path / "dask", dask=cluster.scheduler_address)
    other = (tmp_path / "dask" / "results.parquet").read_bytes()
    assert other == (finished / "results.parquet").read_bytes()


def test_groups_of_any_size_give_the_same_file(
    campaign: Campaign, finished: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Runs one by one, and all of them side by side, byte for byte."""
    for size in (1, 5):
        monkeypatch.setattr("hil.study.workers.SIDE_BY_SIDE", size)
        run_campaign(campaign, tmp_path / str(size), workers=1)
        other = (tmp_path / str(size) / "results.parquet").read_bytes()
        assert other == (finished / "results.parquet").read_bytes()


def test_cluster_that_is_not_there_is_one_line() -> None:
    """An address that makes no sense is bad input."""
    pytest.importorskip("distributed")
    with pytest.raises(BadInput, match="no scheduler answers"):
        list(on_dask(abs, [1], "nonsense://127.0.0.1:1"))


def test_killed_worker_costs_nothing_but_time(tmp_path: Path) -> None:
    """Its jobs are done by another, each result comes once."""
    function: Callable[[int], int] = DiesOnce(tmp_path / "died")
    assert sorted(in_processes(function, range(8), 2)) == [n * n for n in range(8)]
    assert (tmp_path / "died").exists()


def test_job_that_kills_every_worker_ends_the_campaign() -> None:
    """Not an endless loop: after five deaths it is said."""
    with pytest.raises(RigFault, match="its worker died 5 times"):
        list(in_processes(always_dies, [1], 1))


def test_job_that_kills_its_worker_costs_only_itself() -> None:
    """It is given up by name; every other job comes once."""
    results = list(in_processes(dies_on_three, range(8), 2, lambda job, reason: (job, reason)))
    lost = [item for item in results if isinstance(item, tuple)]
    assert [job for job, _ in lost] == [3]
    assert "its worker died 5 times" in lost[0][1]
    assert sorted(item for item in results if item not in lost) == [0, 1, 4, 16, 25, 36, 49]


def test_job_that_kills_its_worker_costs_only_itself_in_a_group() -> None:
    """The jobs of its group are done again, one by one."""
    work = in_processes(dies_on_three, range(8), 2, lambda job, reason: (job, reason), 4)
    results = [item for item in work if not isinstance(item, tuple)]
    assert sorted(results) == [0, 1, 4, 16, 25, 36, 49]


def test_jobs_in_groups_are_done_side_by_side_in_their_order() -> None:
    """A function that does many has them in one call; a list of results has the order of its jobs."""
    told: list[tuple[int, tuple[int, int]]] = []
    with Pool(Counts(), 2) as pool:
        found = pool.map(range(13), lambda place, result: told.append((place, result)))
    assert [job for job, _ in found] == list(range(13))
    assert [together for _, together in found] == [2] * 12 + [1]
    assert sorted(told) == list(enumerate(found))
    alone = in_processes(Counts(), range(3), 1)
    assert sorted(alone) == [(0, 1), (1, 1), (2, 1)]
    assert sorted(in_processes(Counts(), range(3), 1, side_by_side=3)) == [(0, 3), (1, 3), (2, 3)]


def test_what_a_worker_holds_after_its_first_job_is_not_looked_through_again() -> None:
    """Its first job finds nothing put aside, all others do; this process is left alone."""
    found = list(in_processes(looked_through, range(5), 1))
    assert len({process for process, _ in found}) == 1
    assert sorted(aside for _, aside in found) == [False, True, True, True, True]


def test_workers_that_die_whatever_the_job_end_the_campaign() -> None:
    """Not a campaign of lost runs: after three in a row it is said."""
    with pytest.raises(RigFault, match="3 runs one after the other"):
        list(in_processes(always_dies, range(4), 1, lambda job, _reason: job))


def test_one_bad_run_is_a_row_and_is_tried_again(
    campaign: Campaign, finished: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """An error of the program names type, text and line; going on runs that row alone."""
    job = campaign.jobs()[5]

    def fails(*_parts: object) -> None:
        raise ZeroDivisionError("of two")

    with monkeypatch.context() as patch:
        patch.setattr("hil.runs.execute.make_parts", fails)
        row = Worker(campaign)(job).row
    assert row["outcome"] == "error"
    assert row["detail"].startswith("ZeroDivisionError: of two (test_work.py:")
    store = ResultStore(tmp_path / "s", campaign)
    store.add(row)
    for other in pq.read_table(finished / "results.parquet").to_pylist():
        if other["index"] != job.index:
            store.add(other)
    store.finish()
    table, totals = run_campaign(campaign, tmp_path / "s", 1)
    assert totals.runs_now == 1
    assert pq.read_table(table.path).equals(pq.read_table(finished / "results.parquet"))


def test_rows_say_which_program_made_them(
    campaign: Campaign, finished: Path, tmp_path: Path
) -> None:
    """A folder taken up after an update tells that it mixes rows of two programs."""
    rows = pq.read_table(finished / "results.parquet").to_pylist()
    assert {row["program"] for row in rows} == {program()}
    assert program() in (finished / "campaign.json").read_text(encoding="utf-8")
    store = ResultStore(tmp_path / "s", campaign)
    for row in rows:
        store.add(row | ({"program": "skid-steer-hil 0.0.9"} if row["index"] < 4 else {}))
    table = store.finish()
    assert programs(table) == {"skid-steer-hil 0.0.9": 4, program(): 12}
    (line,) = program_lines(programs(table))
    assert line.startswith("rows of 2 programs are mixed: 4 by skid-steer-hil 0.0.9, 12 by ")
    assert program_lines({program(): 16}) == []


def test_other_folder_is_left_alone(campaign: Campaign, finished: Path, tmp_path: Path) -> None:
    """Results of another campaign, and anybody's files, are not touched."""
    path = tmp_path / "other.toml"
    path.write_text(TEXT.replace("0.05]", "0.06]", 1), encoding="utf-8")
    with pytest.raises(BadInput, match="another campaign"):
        ResultStore(finished, load_campaign(str(path)))
    (tmp_path / "own").mkdir()
    (tmp_path / "own" / "letter.txt").write_text("dear", encoding="utf-8")
    with pytest.raises(BadInput, match="neither empty nor a campaign"):
        ResultStore(tmp_path / "own", campaign)


def test_answers_and_page(campaign: Campaign, finished: Path, tmp_path: Path) -> None:
    """Along each value: one verdict per figure; the page has lines and a map, nothing from afar."""
    outcomes = outcomes_of(campaign, pq.read_table(finished / "results.parquet"))
    assert outcomes.labels == ("pid", "asg-ism")
    assert outcomes.complete.all()
    assert len(list(documents(outcomes))) == 4
    stations = outcomes.stations("link.latency_s")
    assert [(s.value, s.pairs.size) for s in stations] == [(0.01, 4), (0.05, 4)]
    assert len(sentences(outcomes)) == 4
    write_page(tmp_path / "page.html", outcomes, "hil sweep delays.toml")
    page = (tmp_path / "page.html").read_text(encoding="utf-8")
    assert page.count("<svg") == 6
    assert "http" not in page.replace("http://www.w3.org", "")


def test_share_of_runs_that_hold_counts_those_without_figures(tmp_path: Path) -> None:
    """On a link that loses nearly everything no run ends by itself: no figures, and not held."""
    path = tmp_path / "cut.toml"
    path.write_text(
        'scenario = "scenario-1"\n'
        'set = ["duration_s=1", "requirements=[]", "link.loss_burst_chunks=10"]\n'
        'figures = ["holds", "iae_m_s"]\n'
        '[grid]\n"link.loss_ratio" = [0.0, 0.9]\n',
        encoding="utf-8",
    )
    campaign = load_campaign(str(path))
    table, _ = run_campaign(campaign, tmp_path / "results", workers=2)
    outcomes = outcomes_of(campaign, table)
    whole, broken = (s.pairs for s in outcomes.stations("link.loss_ratio"))
    assert outcomes.level("holds", 0, whole)[0] == 1.0
    assert outcomes.level("holds", 0, broken)[0] == 0.0
    assert np.isnan(outcomes.figures["iae_m_s"][broken]).all()
    assert any("met every requirement" in line for line in sentences(outcomes))


def test_results_of_one_group_have_the_bytes_of_one_table(finished: Path, tmp_path: Path) -> None:
    """Rows put together from parts are, byte for byte, the whole table written at once."""
    path = finished / "results.parquet"
    table = pq.read_table(path)
    pq.write_table(table, tmp_path / "one", compression="zstd", write_page_checksum=True)
    assert (tmp_path / "one").read_bytes() == path.read_bytes()


def test_many_rows_are_put_together_in_groups(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Rows that came in any order, some twice or to be run again, stand once each and in order."""
    campaign = many_rows.campaign_of(2000)
    monkeypatch.setattr(merge, "GROUP_ROWS", 300)
    store = ResultStore(tmp_path / "s", campaign)
    many_rows.write_parts(tmp_path / "s", campaign)
    whole = pq.read_table(tmp_path / "s" / "parts")
    (part,) = (tmp_path / "s" / "parts").iterdir()
    part.unlink()
    order = np.random.default_rng(2).permutation(whole.num_rows)
    failed = whole.take(order[:50]).to_pylist()
    for row in failed:
        store.add(row | {"outcome": "error", "detail": "first try"})
    store.flush()
    for k in range(0, len(order), 190):
        for row in whole.take(np.concatenate((order[k : k + 190], order[:5]))).to_pylist():
            store.add(row)
        store.flush()
    results = store.finish()
    read = pq.ParquetFile(results.path)
    sizes = [read.metadata.row_group(k).num_rows for k in range(read.num_row_groups)]
    assert sizes == [300] * 6 + [200]
    assert read.read().to_pylist() == whole.sort_by("index").to_pylist()
    assert ResultStore(tmp_path / "s", campaign).done.all()
    assert results.column("index").to_pylist() == list(range(2000))


def test_jobs_are_made_when_asked_for(campaign: Campaign) -> None:
    """The same in any way of asking, numbered in order, laws of one seed beside each other."""
    jobs = campaign.jobs()
    assert [jobs[k] for k in range(len(jobs))] == list(jobs) == jobs[:]
    assert [job.index for job in jobs] == list(range(16))
    assert jobs[-1] == jobs[15]
    assert [job.outer for job in jobs[:4]] == ["pid", "asg-ism"] * 2
    with pytest.raises(IndexError):
        jobs[16]


def test_growth_is_told_by_its_slope() -> None:
    """Of points on a line: its slope and its unit; of one point no slope."""
    line = growth.Series("run", "s of run", "MB", (10.0, 110.0, 210.0), (1.0, 3.0, 5.0))
    *points, slope, begin = line.figures()
    assert [figure.median for figure in points] == [1.0, 3.0, 5.0]
    assert (slope.unit, slope.median) == ("MB per s of run", pytest.approx(0.02))
    assert (begin.unit, begin.median) == ("MB", pytest.approx(0.8))
    assert len(growth.Series("run", "s of run", "MB", (10.0,), (1.0,)).figures()) == 1


def test_a_long_run_tells_its_memory_on_the_way() -> None:
    """A recorded run in a process of its own: twenty times evenly over it, never above the largest."""
    run = growth.recorded_run(20)
    times_s, memory_mb = zip(*run.course, strict=True)
    assert times_s == pytest.approx(np.arange(1.0, 21.0), abs=0.04)
    assert min(memory_mb) > 20.0
    assert max(memory_mb) <= run.peak_mb
    assert run.cpu_s > 0.0
    assert run.disk_mb > 0.1


def test_growth_is_drawn(tmp_path: Path) -> None:
    """Every series has its line in a picture that is the same for the same values."""
    found = [
        growth.Series(what, over, "s", (1.0, 2.0), (3.0, 6.0))
        for what, over in (("a run", "s of run"), ("rows together", "rows"), ("rate", "workers"))
    ]
    found.append(growth.Series("falls", "runs", "s", (0.0, 2.0), (3.0, 1.0)))
    growth.write_plot(tmp_path / "a.svg", found)
    growth.write_plot(tmp_path / "b.svg", found)
    text = (tmp_path / "a.svg").read_text(encoding="utf-8")
    assert all(series.what in text for series in found)
    # The constants of each line stand beside it: 0 + 3 x, and 3 - 1 x.
    assert "+ 3 t" in text
    assert "falls, s: 3 - 1 n" in text
    assert text == (tmp_path / "b.svg").read_text(encoding="utf-8")
