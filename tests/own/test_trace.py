"""A law's own trace columns: in the record with their units, in its replay, in the viewer's charts."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

from hil.record.reader import read_run
from hil.record.rrd import blueprint, own_plots, write_rrd
from hil.record.schema import SAMPLE_NAMES
from hil.report.compare import compare_runs
from hil.report.figures import own_looks, traces
from tests.cli.command import hil, run_pose
from tests.own.starts import law_text, written


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a short record of a law with a term of its own."""
    folder = tmp_path_factory.mktemp("trace")
    file = written(folder / "traced.py", law_text("traced-law"))
    done = run_pose("--outer", file, "--set", "duration_s=2", "--out", folder / "run")
    assert done.status == 1, done.err  # two seconds are too few to arrive
    return folder / "run"


def test_own_columns_follow_those_of_every_record(run: Path):
    """Name, unit and meaning stand in samples.parquet and in the manifest, after the usual columns."""
    schema = pq.read_schema(run / "samples.parquet")
    assert schema.names == [*SAMPLE_NAMES, "abeam_m_s"]
    notes = schema.field("abeam_m_s").metadata
    assert notes[b"unit"] == b"m/s"
    assert notes[b"meaning"] == b"wanted speed across the heading, left positive"
    record = read_run(run)
    assert [term.name for term in record.manifest.trace] == ["abeam_m_s"]
    assert np.isfinite(record.samples["abeam_m_s"]).all()
    # At the start the point lies 43 deg to the right of the heading.
    assert record.samples["abeam_m_s"][0] < -0.3


def test_viewer_has_a_chart_for_them(run: Path, tmp_path: Path):
    """The chart names law, term and unit, and the file for the viewer is written with it."""
    record = read_run(run)
    (plot,) = own_plots(record)
    assert plot.title == "traced-law: abeam_m_s (m/s)"
    assert plot.lines == (("abeam_m_s", "abeam_m_s", 1.0),)
    assert blueprint([record], ["r"]) is not None
    write_rrd(tmp_path / "run.rrd", [record])
    assert b"law/abeam_m_s" in (tmp_path / "run.rrd").read_bytes()


def test_exact_replay_compares_them(run: Path):
    """The replay reproduces the term bit for bit, and an altered one is the difference it finds."""
    assert hil("replay", run).status == 0
    channels = {c["name"]: c for c in hil("replay", run, "--json").json["channels"]}
    assert channels["abeam_m_s"]["rows"] == 61
    table = pq.read_table(run / "samples.parquet")
    values = table["abeam_m_s"].to_numpy().copy()
    values[7] += 1e-12
    place = table.column_names.index("abeam_m_s")
    field = table.schema.field("abeam_m_s")
    before = (run / "samples.parquet").read_bytes()
    pq.write_table(table.set_column(place, field, [values]), run / "samples.parquet")
    try:
        done = hil("replay", run, "--json")
    finally:
        (run / "samples.parquet").write_bytes(before)
    assert done.status == 1
    assert done.json["first_divergence"]["name"] == "abeam_m_s"


def test_a_shadow_has_the_columns_of_its_own_law(run: Path, tmp_path: Path):
    """Replayed rows of another law hold that law's terms, not those of the record's law."""
    done = hil("replay", run, "--outer", "pid", "--out", tmp_path / "shadow")
    assert done.status == 0, done.err
    names = pq.read_schema(tmp_path / "shadow" / "replayed.parquet").names
    assert names == list(SAMPLE_NAMES)


@pytest.mark.parametrize(
    ("trace", "said"),
    [
        ('{"est_x_m": ("m", "taken")}', "'est_x_m' is that of a column that every record has"),
        ('{"s_x": ("m", "taken")}', "'s_x' is that of a column that every record has"),
        ('{"abeam m": ("m", "no name")}', "needs names with unit and meaning"),
        ('{"abeam_m_s": "m/s"}', "needs names with unit and meaning"),
        ('["abeam_m_s"]', "needs names with unit and meaning"),
    ],
)
def test_a_trace_that_cannot_be_is_refused_before_anything_is_written(trace, said, tmp_path: Path):
    """A name that is taken or none, or a term without unit and meaning, is one line and status 2."""
    good = '{"abeam_m_s": ("m/s", "wanted speed across the heading, left positive")}'
    text = law_text("untraceable").replace(good, trace)
    assert trace in text
    file = written(tmp_path / "law.py", text)
    assert said in run_pose("--outer", file, "--out", tmp_path / "run").refusal
    assert not (tmp_path / "run").exists()


def test_a_trace_value_that_is_no_number_ends_the_run_in_good_order(tmp_path: Path):
    """The robot is stopped, the record closed, and the fault names law, term and value: status 3."""
    text = law_text("wordy").replace('{"abeam_m_s": abeam}', '{"abeam_m_s": "left"}')
    done = run_pose("--outer", written(tmp_path / "law.py", text), "--out", tmp_path / "run")
    assert done.status == 3
    assert "trace['abeam_m_s'] = 'left', not a number" in done.out
    assert read_run(tmp_path / "run").manifest.outcome == "fault"


def test_colour_of_a_law_stands_in_its_record(run: Path):
    """A report made where the law is not known paints it as it registered itself."""
    record = read_run(run)
    (plugin,) = record.manifest.plugins
    assert (plugin.label, plugin.colour) == ("traced-law", "#009e73")
    (entry,) = compare_runs([record], 1).entries
    assert own_looks([entry], "colour")["traced-law"] == "#009e73"


def test_label_of_a_law_stands_in_the_legends(tmp_path: Path):
    """As it registered itself, and a law without one by its name."""
    text = law_text("tr-law").replace('"tr-law",', '"tr-law", label="Traced, of Lab 7",')
    run_pose(
        "--outer", written(tmp_path / "law.py", text), "--set", "duration_s=0.4", "--out",
        tmp_path / "own",
    )  # fmt: skip
    run_pose("--outer", "pid", "--set", "duration_s=0.4", "--out", tmp_path / "pid")
    entries = compare_runs([read_run(tmp_path / "own"), read_run(tmp_path / "pid")]).entries
    assert [trace.label for trace in traces(entries)] == ["Traced, of Lab 7", "pid"]
