"""The report is one self-contained page with every figure, caption, verdict and assumption."""

from __future__ import annotations

import itertools
import math
import re
import time
from html.parser import HTMLParser
from types import SimpleNamespace
from xml.etree import ElementTree

import numpy as np
import pytest

from hil.config.load import load_scenario
from hil.core.errors import BadInput
from hil.core.figures import METRICS
from hil.report.assumptions import assumptions, gain_assumptions
from hil.report.circle import CircleStudy
from hil.report.compare import compare_runs
from hil.report.html import render, write_report
from tests.record.synthetic import make_run, scenario


@pytest.fixture(scope="module")
def comparisons(tmp_path_factory):
    folder = tmp_path_factory.mktemp("runs")
    return [
        compare_runs(
            [make_run(folder / f"{name}-{law}", law, tree=scenario(name), images=law == "pid",
                      rate_hz=rate)
             for law, rate in (("pid", 2.0), ("asg-ism", 2.6))]
        )
        for name in ("scenario-1", "scenario-2")
    ]  # fmt: skip


def circle():
    """Return a study whose figures are known: errors 3 mm and 1 mm, ||s|| at most 0.01."""
    t_s = np.linspace(0.0, 20.0, 2001)

    def run(error_m, s):
        pairs = np.column_stack((np.cos(t_s), np.sin(t_s)))
        flat = np.column_stack((np.full(t_s.size, error_m), np.zeros(t_s.size)))
        layer = np.column_stack((np.full(t_s.size, s), np.zeros(t_s.size)))
        return SimpleNamespace(
            t_s=t_s, z1_m=pairs + flat, z1_ref_m=pairs, delta1_m=flat, s=layer, u=pairs
        )

    return CircleStudy.of(
        {"asg-ism": run(0.001, 0.01), "pid": run(0.003, math.nan)}, 0.02, "0.1 sin(3 t) m/s²"
    )


@pytest.fixture(scope="module")
def page(comparisons):
    return render(comparisons, command="hil experiment --seed 1", circle=circle())


def test_page_needs_no_network(page):
    """No address of another place: scripts, styles, fonts and images are all inside."""
    outside = re.findall(r"""(?:src|href|url\()\s*=?\s*["']?(https?:|//|/|\w+\.\w)""", page)
    assert outside == []
    assert "<script" not in page
    assert page.count("data:image/jpeg;base64,") == 2 * 3


def test_page_is_well_formed(page):
    """Every element that is opened is closed, in order."""
    void = {"meta", "br", "img", "link", "hr", "input"}

    class Checker(HTMLParser):
        def __init__(self):
            super().__init__()
            self.open = []

        def handle_starttag(self, tag, attrs):  # noqa: ARG002
            if tag not in void:
                self.open.append(tag)

        def handle_endtag(self, tag):
            assert self.open.pop() == tag

        def handle_startendtag(self, tag, attrs):
            pass

    checker = Checker()
    checker.feed(page)
    assert checker.open == []


def test_every_thesis_figure_is_there(page):
    """Figures 8.10 to 8.12 and 8.14 to 8.16, photographs, and 8.2 to 8.4, each with a caption."""
    for number in ("8.10", "8.11", "8.12", "8.13", "8.14", "8.15", "8.16", "8.2", "8.3", "8.4"):
        assert f"(thesis figure {number})" in page
    svgs = re.findall(r"<svg.*?</svg>", page, flags=re.DOTALL)
    assert len(svgs) == 2 * 5 + 4
    for svg in svgs:
        ElementTree.fromstring(svg)
        assert "var(--run-" in svg
        assert not re.search(r"#[0-9a-f]{6}", svg)  # every colour follows the page


def test_identifiers_of_figures_do_not_collide(page):
    """An id occurs once in the page, or a clip of one figure would cut another."""
    found = re.findall(r'\bid="([^"]+)"', page)
    assert len(found) == len(set(found))


def test_every_metric_unit_and_requirement_is_there(page):
    """Each figure stands with its label; each requirement with its verdict; findings beside."""
    for metric in METRICS:
        assert metric.label in page
        assert metric.name in page
    assert "delta1_worst_last_second_m &lt;= 0.02 m" in page
    assert "no interval: repeats are needed" in page
    assert "hil experiment --seed 1" in page


def test_failures_are_told_at_the_top(tmp_path):
    """A run that misses its requirement is named in the summary, not hidden below."""
    runs = [
        make_run(tmp_path / law, law, rate_hz=rate) for law, rate in (("pid", 2), ("asg-ism", 0.2))
    ]
    page = render([compare_runs(runs)], command="hil compare a b")
    assert "asg-ism never; pid is better." in page
    assert "1 of 2 runs did not meet every requirement: scenario-1 asg-ism." in page


def test_text_from_a_record_cannot_become_markup(tmp_path):
    """A scenario may be called anything; the page shows it as text."""
    tree = scenario() | {"name": "a <script>x</script> & b"}
    runs = [make_run(tmp_path / law, law, tree=tree) for law in ("pid", "asg-ism")]
    page = render([compare_runs(runs)], command="<b>")
    assert "<script" not in page
    assert "&lt;script&gt;" in page


def test_circle_findings_are_computed_and_honest():
    """Integral of 9 mm² over 20 s against 1 mm²; leaving the layer is said in capitals."""
    lines = circle().findings()
    assert "stays in the layer" in lines[0]
    assert "pid 0.00018 m²·s, asg-ism 2e-05 m²·s; asg-ism is better by a factor of 9" in lines[1]
    assert "pid 3 mm, asg-ism 1 mm" in lines[2]
    narrow = CircleStudy(circle().runs, 0.005, "")
    assert "LEAVES the layer" in narrow.findings()[0]


def test_report_that_cannot_be_written_is_one_clear_line(comparisons, tmp_path):
    """A folder that is not there: one line, and nothing half-written anywhere."""
    with pytest.raises(BadInput, match="cannot be written: No such file"):
        write_report(tmp_path / "nowhere" / "r.html", comparisons[:1], command="x")
    write_report(tmp_path / "r.html", comparisons[:1], command="x")
    assert [path.name for path in tmp_path.iterdir()] == ["r.html"]


def test_report_is_fast(comparisons):
    """A scenario costs at most a second and a half of processor time: three fit in 6 s easily."""
    start_s = time.process_time()
    render(comparisons[:1], command="x")
    assert time.process_time() - start_s < 1.5


def test_assumptions_carry_unit_meaning_and_source():
    """Values of a resolved scenario come with unit, meaning of the field, and the file's comment."""
    tree = {
        "name": "scenario-1",
        "duration_s": 20.0,
        "robot": {"wheel_radius_m": 0.0482, "motor": {"gear_ratio": 30.0}},
        "disturbances": [{"start_s": 1.0}],
        "control": {"gains": {"k": 1}},
    }
    items = {item.key: item for _, group in assumptions(tree) for item in group}
    radius = items["robot.wheel_radius_m"]
    assert (radius.value, radius.unit) == ("0.0482", "m")
    assert radius.meaning
    assert "table 8.3" in radius.source
    assert items["robot.motor.gear_ratio"].source == "motor sheet"
    assert "disturbances.0.start_s" in items
    assert not any(key.startswith("control.gains") for key in items)


def test_every_value_of_a_shipped_scenario_says_what_it_means():
    """No row of the table stands there as a bare number: mismatch, board and gains included."""
    tree = load_scenario("scenario-1").model_dump(mode="json")
    items = {item.key: item for _, group in assumptions(tree) for item in group}
    kinds = {"reference.kind", "robot.name", "robot.variant"}
    assert [key for key, item in items.items() if not item.meaning and key not in kinds] == []
    mismatch = items["mismatch.mass_kg"]
    assert (mismatch.unit, mismatch.value) == ("(ratio)", "1.1")
    assert items["board.ISM_K0"].unit == "duty"
    gains = gain_assumptions("asg-ism", tree["control"]["gains"]["tuned"]["asg_ism"], "set tuned")
    assert all(item.meaning and item.source == "set tuned" for item in gains)
    units = {item.key: item.unit for item in gains}
    assert (units["k1_s"], units["alpha_m_s3"], units["mu0_s"], units["p"]) == (
        "1/s",
        "m/s^3",
        "s",
        "",
    )
    speed = items["control.limits.eta1_max_m_s"]
    assert speed.unit == "m/s"
    assert speed.meaning.startswith("forward speed command")


class Structure(HTMLParser):
    """Collects what a screen reader goes by."""

    def __init__(self):
        super().__init__()
        self.headings, self.tags, self.open, self.unnamed = [], [], [], []

    def handle_starttag(self, tag, attrs):
        given = dict(attrs)
        self.tags.append((tag, given))
        if re.fullmatch(r"h[1-6]", tag):
            self.headings.append(int(tag[1]))
        if tag == "svg":
            names = [a.get("aria-label") for t, a in self.open if a.get("role") == "img"]
            if not any(names):
                self.unnamed.append(given)
        if tag in {"div", "main", "figure"}:
            self.open.append((tag, given))

    def handle_endtag(self, tag):
        if self.open and self.open[-1][0] == tag:
            self.open.pop()


def test_page_can_be_heard(page):
    """One main part, headings without gaps, a name for each drawing, header cells with their scope."""
    found = Structure()
    found.feed(page)
    assert [tag for tag, _ in found.tags].count("main") == 1
    assert found.headings[0] == 1
    assert found.headings.count(1) == 1
    assert all(b - a <= 1 for a, b in itertools.pairwise(found.headings))
    assert sum(tag == "svg" for tag, _ in found.tags) > 5
    assert not found.unnamed
    cells = [given for tag, given in found.tags if tag == "th"]
    assert {given.get("scope") for given in cells} == {"col", "row"}
    assert all(given.get("alt") for tag, given in found.tags if tag == "img")
    assert any(tag == "nav" and given.get("aria-label") for tag, given in found.tags)


def test_page_fits_a_phone_and_paper(page):
    """Width of the device; tables and drawings go on sideways within their own box, with a mark."""
    found = Structure()
    found.feed(page)
    assert (
        "meta",
        {"name": "viewport", "content": "width=device-width, initial-scale=1"},
    ) in found.tags
    boxes = [given for _, given in found.tags if "scroll" in given.get("class", "").split()]
    assert len(boxes) >= sum(tag in {"table", "svg"} for tag, _ in found.tags)
    assert all(box["tabindex"] == "0" and box["aria-label"] for box in boxes)
    assert "goes on to the right" in page
    assert "@media print" in page
    assert "@page" in page


def test_page_says_where_its_numbers_come_from(page):
    """The thesis is cited by author, title and year, and the symbols are told."""
    assert "Alejandra Hernández Sánchez" in page
    assert "<dt>z1, d0</dt>" in page
