"""The conformance kit of laws: the built-in ones keep every rule, and a law that breaks one is told by it."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import hil
from hil.core.errors import BadInput
from hil.core.registries import OUTER_LAWS
from hil.core.registry import BUILT_IN
from hil.tools.conformance import law_report
from hil.tools.conformance.batches import CHECK
from hil.tools.conformance.laws import ON_THE_FLOOR, ON_THE_TWIN
from tests.cli.command import hil as command
from tests.own.starts import law_text, written

# A run of a second neither holds a scenario nor needs to: the checks on the floor are looked at.
SHORT = ("duration_s=1",)


@pytest.mark.parametrize(
    "name", [entry.name for entry in OUTER_LAWS.entries() if entry.origin == BUILT_IN]
)
def test_built_in_laws_keep_every_rule(name):
    """Every law that is built in passes the whole kit, twin included."""
    report = hil.check_law(name)
    assert [finding.name for finding in report.findings] == [
        "step time", *ON_THE_FLOOR, *ON_THE_TWIN,
    ]  # fmt: skip
    assert report.passed


# (name of the check, what the good law has, what the bad one has in its place)
STEP = "        limits, gains = self._limits, self._gains\n"
RETURN = "        return hil.OuterCommand(self._forward_m_s, turn, {"
BROKEN = {
    "finite": (RETURN, "        turn = math.nan if x_m > 0.3 else turn\n" + RETURN),
    "keeps to limits": (RETURN, "        turn = 1.5 * turn\n" + RETURN),
    "trace declared": ('{"abeam_m_s": abeam}', '{"abeam_m_s": abeam, "ahead": ahead}'),
    "reset equals new": ("        self._forward_m_s = estimate.eta1_m_s\n", "        pass\n"),
    "no state shared": (STEP, STEP + "        Gains.last = turn_before = x_sum[0]\n"
                        "        x_sum[0] = 0.9 * x_sum[0] + estimate.z1_m[0]\n"),
    "no clock": (STEP, STEP + "        monotonic()\n"),
    "no unseeded random number": (STEP, STEP + "        random.random()\n"),
    "mirror symmetry": (RETURN, "        turn = 0.9 * turn + 0.01\n" + RETURN),
    "step time": (STEP, STEP + "        sleep(0.02)\n"),
}  # fmt: skip
IMPORTS = "import math\nimport random\nfrom time import monotonic, sleep\n\nx_sum = [0.0]\n"


@pytest.mark.parametrize("check", BROKEN)
def test_a_law_that_breaks_a_rule_is_told_by_its_name(check, tmp_path: Path):
    """Each check has a law that violates it, and it alone is reported of those on the floor."""
    good, bad = BROKEN[check]
    if check == "no state shared":
        bad = bad.replace("        Gains.last = turn_before = x_sum[0]\n", "")
        text = law_text("shared").replace(good, bad)
        text = text.replace(RETURN, "        turn *= 1.0 / (1.0 + abs(x_sum[0]))\n" + RETURN)
    else:
        text = law_text(f"broken-{check.replace(' ', '-')}").replace(good, bad)
    assert bad in text
    file = written(tmp_path / "broken.py", text.replace("import math\n", IMPORTS))
    report = law_report(file, overrides=SHORT)
    assert check in report.failures
    on_the_floor = [name for name in report.failures if name in ON_THE_FLOOR]
    if check == "step time":
        assert all("not tried" in f.said for f in report.findings if f.name != "step time")
    elif check == "no state shared":  # what is shared is there after a reset, too
        assert set(on_the_floor) >= {"no state shared"}
        assert "against itself" in report.failures
    else:
        assert on_the_floor == [check]
    with pytest.raises(AssertionError, match=check):
        hil.check_law(file, overrides=SHORT)


def test_a_generator_without_a_seed_is_heard_and_makes_instances_differ(tmp_path: Path):
    """random.Random() in an instance is no call of the module's functions, and is found all the same."""
    text = law_text("gambler").replace("import math\n", IMPORTS)
    text = text.replace(
        "self._limits = limits\n", "self._limits = limits\n        self._rng = random.Random()\n"
    )
    text = text.replace(RETURN, "        turn *= self._rng.uniform(0.9, 1.0)\n" + RETURN)
    report = law_report(written(tmp_path / "g.py", text), overrides=SHORT)
    assert {"deterministic", "no unseeded random number"} <= set(report.failures)
    seeded = text.replace("random.Random()", "random.Random(1)").replace('"gambler"', '"seeded"')
    report = law_report(written(tmp_path / "s.py", seeded), overrides=SHORT)
    assert "no unseeded random number" not in report.failures
    assert "deterministic" not in report.failures


# What step_batch has, and what makes it another law, or one that minds its company.
MANY = "        return hil.CommandBatch(forward_m_s, turn, {"
MISFITS = {
    "another sign": (MANY, "        turn = -turn\n" + MANY, "step_batch returned"),
    "the mean of all": (MANY, "        turn = turn + 1e-12 * turn.mean()\n" + MANY, "in another order|alone"),
    "a gain of its own": ("[one.speed_s for", "[1.0 + 1e-6 for", "step_batch returned"),
    "a place too many": ("self._forward_m_s[where] = estimate.eta1_m_s",
                         "self._forward_m_s[:] = 0.1", "again after a reset|alone|order"),
}  # fmt: skip


def test_a_law_that_steps_many_at_once_is_held_to_its_step(tmp_path: Path):
    """The template's agrees to rounding, and the report says how well."""
    report = hil.check_law(written(tmp_path / "many.py", law_text("many")))
    (finding,) = [finding for finding in report.findings if finding.name == CHECK]
    assert finding.holds
    assert finding.said.startswith("as step to ")


@pytest.mark.parametrize("misfit", MISFITS)
def test_a_law_that_steps_many_otherwise_is_told(misfit, tmp_path: Path):
    """One that gives other commands than `step`, or whose runs see each other (negative control)."""
    good, bad, said = MISFITS[misfit]
    text = law_text(f"misfit-{misfit.replace(' ', '-')}")
    assert good in text
    report = law_report(written(tmp_path / "m.py", text.replace(good, bad)), overrides=SHORT)
    (finding,) = [finding for finding in report.findings if finding.name == CHECK]
    assert not finding.holds
    assert re.search(said, finding.said)
    assert [name for name in report.failures if name in ON_THE_FLOOR] == []


def test_a_law_that_does_nothing_does_not_pass(tmp_path: Path):
    """A law at rest is finite and deterministic, and holds no scenario."""
    text = law_text("lazy").replace(RETURN, "        return hil.OuterCommand(0.0, 0.0, {")
    text = text.replace("    def batch(", "    def no_batch(")
    report = law_report(written(tmp_path / "lazy.py", text), overrides=("duration_s=3",))
    assert report.failures == ("scenario holds", "negative control")


def test_a_scenario_that_says_nothing_of_a_law_is_told():
    """Without requirements the law with its turn the other way passes too: the control fails."""
    report = law_report("pid", overrides=("duration_s=1", "requirements=[]"))
    assert report.failures == ("negative control",)


def test_exit_statuses_and_json(tmp_path: Path):
    """1 when a check does not hold, 2 for what cannot be checked (0: where `hil new` is tested)."""
    bad = written(tmp_path / "bad.py", law_text("bad").replace(*BROKEN["mirror symmetry"]))
    done = command("check", "law", bad, "--set", "duration_s=1")
    assert done.status == 1
    assert "FAILS  mirror symmetry: " in done.out
    none = written(tmp_path / "none.py", "x = 1\n")
    assert "registers no outer law" in command("check", "law", none).refusal
    raising = written(tmp_path / "raising.py", "import hil\n\n1 / 0\n")
    assert "line 3: ZeroDivisionError" in command("check", "law", raising).refusal
    assert "near: pid" in command("check", "law", "pidd").refusal
    assert command("check", "wheel", "pid").status == 2
    with pytest.raises(BadInput, match="not registered"):
        hil.check_law(dict)
