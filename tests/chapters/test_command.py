"""`hil reproduce` as a user meets it: laws of one's own, changed studies, bad input."""

from __future__ import annotations

import json

import pytest
from click.testing import CliRunner

from hil.cli.main import cli
from hil.core.errors import BadInput

SMALL = """
base = "underwater-6dof"
title = "ten seconds"
sensitivity_rows = []
claims = []
figures = []
beliefs = []
[parameters.duration_s]
value = 10.0
[parameters.settle_s]
value = 5.0
[choices."fins off"]
fin_moments = 0.0
[[rows]]
row = "P"
kind = "baseline"
label = "PD 2/1"
law = "pd"
choices = ["fins off"]
"""
PD = """
class Law:
    def __init__(self, stage, axes):
        assert (stage, axes) == ("position", 3)
    def reset(self, p, q):
        self.start = p
    def output(self, t_s, p, q, dt_s):
        return [-2.0 * a - b for a, b in zip(p, q)]
"""


def run(*arguments):
    """Return status, document and stderr; expected errors are raised."""
    result = CliRunner().invoke(cli, ["reproduce", *arguments, "--json"], standalone_mode=False)
    if result.exception is not None:
        raise result.exception
    return result.return_value, json.loads(result.stdout), result.stderr


@pytest.fixture
def study(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)

    def write(text=SMALL):
        (tmp_path / "study.toml").write_text(text)
        return "study.toml"

    return write


def law(tmp_path, text):
    path = tmp_path / "my_law.py"
    path.write_text(text)
    return str(path)


def test_own_law_in_python_gives_the_row_of_the_same_law_compiled(study, tmp_path):
    """PD 2/1 by the protocol: the row L has the figures of the compiled row to the last digit."""
    status, document, _ = run(study(), "--law", law(tmp_path, PD), "--out", "made")
    assert status == 0
    rows = {row["row"]: row for row in document["rows"]}
    own, compiled = rows["L fins off"], rows["P fins off"]
    assert own["kind"] == "own law"
    for name in ("end", "ise_m2_s", "worst_m", "effort", "peak"):
        assert own[name] == compiled[name]
    assert (tmp_path / "made" / "report.html").is_file()


def test_own_law_of_three_stages_feeds_its_rate_forward(study, tmp_path):
    """The cascade of chapters 5 and 7 with a Python P law in every stage, beside the compiled one."""
    text = """
class Law:
    gains = {"position": 0.5, "sideways": 2.0, "drive": 10.0}
    def __init__(self, stage, axes):
        self.k = self.gains[stage]
    def reset(self, p, q):
        pass
    def output(self, t_s, p, q, dt_s):
        return [-self.k * x for x in q]
"""
    small = SMALL.replace("underwater-6dof", "underwater-5dof").replace('"pd"', '"p"')
    small = small.replace('[choices."fins off"]\nfin_moments = 0.0\n', "").replace(
        'choices = ["fins off"]\n', ""
    )
    _, document, _ = run(study(small), "--law", law(tmp_path, text))
    own, compiled = (next(r for r in document["rows"] if r["row"] == name) for name in ("L", "P"))
    assert own["ise_m2_s"] == pytest.approx(compiled["ise_m2_s"], rel=1e-2)
    assert own["worst_m"] == pytest.approx(compiled["worst_m"], rel=1e-2)


def test_a_law_that_turns_to_nan_or_runs_away_is_a_row(study, tmp_path, recwarn):
    """The end has a name, figures are numbers or missing, nothing warns."""
    text = PD.replace("return [", "if t_s > 2.0: return [float('nan')] * 3\n        return [")
    status, document, shown = run(study(), "--law", law(tmp_path, text), "--out", "nan")
    row = next(row for row in document["rows"] if row["kind"] == "own law")
    assert (status, row["end"]) == (0, "not finite")
    assert row["end_s"] == pytest.approx(2.001, abs=0.01)
    assert row["worst_m"] is None
    away = PD.replace("-2.0 * a - b", "900.0 * a + b")
    wide = SMALL.replace(
        "[parameters.settle_s]", "[parameters.force_max_n]\nvalue = 1e6\n[parameters.settle_s]"
    )
    _, document, _ = run(study(wide), "--law", law(tmp_path, away), "--out", "away")
    row = next(row for row in document["rows"] if row["kind"] == "own law")
    assert row["end"] in {"diverged", "not finite"}
    assert row["end_s"] < 10.0
    assert "Warning" not in shown
    assert len(recwarn) == 0


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("class Law:\n    def __init__(self, stage, axes): pass\n", "has no reset"),
        ("x = 1\n", "has no class Law"),
        ("import nowhere\n", "No module named 'nowhere'"),
        (PD.replace("[-2.0 * a - b for a, b in zip(p, q)]", "[0.0, 0.0]"), "2 values for 3 axes"),
        (PD.replace("[-2.0 * a - b for a, b in zip(p, q)]", "1 / 0"), "ZeroDivisionError"),
        (PD.replace("[-2.0 * a - b for a, b in zip(p, q)]", "['a'] * 3"), "could not convert"),
    ],
)
def test_own_law_that_cannot_be_used_is_one_line(study, tmp_path, text, told):
    """The file and what is wrong with it; no folder is left behind."""
    with pytest.raises(BadInput, match=told) as caught:
        run(study(), "--law", law(tmp_path, text), "--out", "none")
    assert "my_law.py" in str(caught.value)
    assert "\n" not in str(caught.value)
    assert not (tmp_path / "none").exists()


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["9"], "no numerical study; choose 4, 5, 6, 7, 8"),
        (["8", "--law", "my_law.py"], "--law is for chapters 4 to 7"),
        (["4", "--law", "nowhere.py"], "no such Python file"),
        (["4", "--set", "mass=1"], "PARAMETER=VALUE with one of accel_max"),
        (["4", "--set", "mass_kg=heavy"], "'heavy' is no finite number"),
        (["4", "--set", "mass_kg=nan"], "'nan' is no finite number"),
        (["4", "--set", "mass_kg=-1"], "mass_kg = -1: must be greater than 0"),
        (["4", "--set", "step_s=0"], "step_s = 0: must be greater than 0"),
        (["4", "--set", "step_s=1e-9"], "steps; 1 to 5000000 are possible"),
        (["5", "--set", "surge_min_m_s=1e10"], "must not exceed surge_max_m_s"),
        (["--set", "mass_kg=1"], "name one of the chapters"),
        (["nowhere.toml"], "nowhere.toml"),
        (["4", "--out", "."], "not an empty folder"),
    ],
)
def test_bad_input_is_one_line(study, tmp_path, arguments, told):
    """What, value and limit; nothing is run and nothing written."""
    study()
    with pytest.raises(BadInput, match=told) as caught:
        run(*arguments)
    assert "\n" not in str(caught.value)
    assert [path.name for path in tmp_path.iterdir()] == ["study.toml"]


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ('law = "pd"', 'law = "pb"', "law 'pb' is unknown"),
        ('choices = ["fins off"]', 'choices = ["sails"]', "choice 'sails' is unknown"),
        ('label = "PD 2/1"', 'label = "PD 2/1"\nset = { fins = 1.0 }', "parameter 'fins' is unknown"),
        ('kind = "baseline"', 'kind = "guess"', "kind"),
        ('row = "P"', 'row = "P"\ncolour = 1', "unknown key 'colour'"),
        ("claims = []", '[[claims]]\nchapter="6"\nclaim="c"\nwhere="w"\nprinted="1"\n'
         'measure={figure="size", row="P fins off"}', "figure of a row 'size' is unknown"),
        ("value = 10.0", "value = -3.0", "must be greater than 0"),
        ('law = "pd"', 'law = "pd"\ngains = { kd = -1e400 }', "finite"),
    ],
)  # fmt: skip
def test_study_that_is_wrong_is_one_line(study, old, new, told):
    """A study of one's own is checked before anything runs."""
    text = SMALL.replace(old, new)
    if "[[claims]]" in text:  # tables come after plain keys
        block = text[text.index("[[claims]]") : text.index("figures = []")]
        text = text.replace(block, "") + block
    with pytest.raises(BadInput, match=told):
        run(study(text))


def test_changed_parameter_changes_the_row_and_says_so(study, tmp_path):
    """--set lies over the study: without a disturbance the error is another, and the report tells why."""
    _, before, _ = run(study(), "--out", "a")
    _, after, _ = run(study(), "--set", "disturbance_m_s2=0", "--out", "b")
    assert after["rows"][0]["ise_m2_s"] != before["rows"][0]["ise_m2_s"]
    assert "command line; was 0.2" in (tmp_path / "b" / "report.html").read_text()


def test_missed_limit_is_exit_status_1(study):
    """A row that misses its limit is told and decides the exit status."""
    status, document, _ = run(study(SMALL + "limit_m = 0.001\n"))
    assert status == 1
    assert document["unexpected"] == ["P fins off: complete, misses its limit"]
    assert document["rows"][0]["holds"] is False
