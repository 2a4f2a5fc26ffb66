"""Parts of a law switched off: which there are, that they are off, and that a part that works is seen."""

import json
from functools import partial

import pytest
from click.testing import CliRunner

from hil.cli.ablate import command
from hil.config.control import ControlConfig
from hil.config.load import load_scenario
from hil.control.laws.asg_ism import AsgIsm
from hil.control.laws.parts import WithoutFeedForward, has_block, leave_out
from hil.core.errors import BadInput
from hil.core.registries import OUTER_LAWS
from hil.core.types import ReferenceState
from hil.runs.together import figures_together
from hil.study.ablation import ablate
from hil.study.parts_off import opened_without, parts_of
from hil.study.suite import KEPT, Job, Yardstick


def test_each_law_has_its_own_parts():
    """The sliding law has alpha, Psi, kappa and gamma, PID its integral; what is around them both have."""
    assert set(parts_of("asg-ism")) >= {
        "alpha",
        "psi",
        "kappa",
        "gamma",
        "feed-forward",
        "hold",
        "lead",
    }
    assert set(parts_of("pid")) >= {"integral", "feed-forward", "restrictions", "lead", "hold"}
    assert not {"alpha", "kappa", "gamma"} & set(parts_of("pid"))


def block_without(part=""):
    """Return the sliding block of the shipped law, started, without a part."""
    control = ControlConfig()
    law = AsgIsm(control.active_gains.of(OUTER_LAWS.get("asg-ism")), control.limits, 0.03)
    assert has_block(law)
    if part:
        leave_out(law, part)
    law._block.reset((0.1, 0.2), (0.5, -0.4))
    return law._block


def test_without_kappa_the_rest_is_as_it_was():
    """Of equal terms kappa alone is zero: s(0) = 0 all the same, and gamma stays."""
    whole, off = block_without(), block_without("kappa")
    now = (0.2, (0.1, 0.0), (0.5, 0.3))
    s, kappa, *rest = whole.terms(*now)
    assert min(map(abs, kappa)) > 0.1
    assert off.terms(*now) == (s, (0.0, 0.0), *rest)
    assert off.eta == whole.eta


def test_without_gamma_there_is_a_reaching_phase():
    """With eta = 0, s(0) = q + mu p, worked out by hand; with gamma it is 0."""
    started = (0.0, (0.1, 0.2), (0.5, -0.4))
    mu0_s = ControlConfig().active_gains.of(OUTER_LAWS.get("asg-ism")).mu0_s
    whole, off = block_without(), block_without("gamma")
    assert whole.terms(*started)[0] == pytest.approx((0.0, 0.0), abs=1e-12)
    assert off.terms(*started)[0] == pytest.approx((0.5 + 0.1 / mu0_s, -0.4 + 0.2 / mu0_s))
    assert off.eta == (0.0, 0.0)


def test_without_feed_forward_the_law_sees_a_reference_at_rest():
    """Its place is kept, its derivatives are zero."""
    seen = []

    class Law:
        def reset(self, reference, _estimate):
            seen.append(reference)

        def step(self, reference, _estimate, _dt_s):
            seen.append(reference)

    law = WithoutFeedForward(Law())
    reference = ReferenceState((1.0, 2.0), (3.0, 4.0), (5.0, 6.0), (7.0, 8.0))
    law.reset(reference, None)
    law.step(reference, None, 0.03)
    assert seen == [ReferenceState((1.0, 2.0), (0.0, 0.0), (0.0, 0.0), (0.0, 0.0))] * 2


def test_nothing_off_is_the_law_itself_and_a_part_off_is_not():
    """The same figures as a plain run; without feed-forward the circle is tracked worse."""
    scenario = load_scenario("circle-fast", ["duration_s=5"])
    whole, again, off = figures_together(
        [partial(opened_without, scenario, "pid", 3, part) for part in ("", "", "feed-forward")]
    )
    assert whole == pytest.approx(again, nan_ok=True)
    assert off["iae_m_s"] > 1.5 * whole["iae_m_s"]
    with pytest.raises(BadInput, match="has no part 'alpha' to switch off"):
        opened_without(scenario, "pid", 3, "alpha")


def test_without_alpha_there_is_no_sliding_term_whatever_it_is_made_of():
    """F+ of (2.9) adds to alpha (4.14): with it the part that is off is the whole term."""
    scenario = load_scenario("ahead", ["duration_s=2", "control.gains.tuned.asg_ism.gamma0_m_s3=4"])
    off, on = figures_together(
        [partial(opened_without, scenario, "asg-ism", 3, part) for part in ("alpha", "")]
    )
    assert on["sliding_term_share"] > 0.0
    assert off["sliding_term_share"] == 0.0
    assert off["iae_m_s"] != on["iae_m_s"]


def test_a_part_that_helps_everywhere_is_found_and_one_that_does_nothing_is_not():
    """Made-up runs: without its lead the law is worse in every cell, without its hold it is the same."""
    cells = [f"task{i} in calm" for i in range(12)]
    yard = Yardstick({f"task{i}": dict.fromkeys(KEPT, 1.0) for i in range(12)})

    def make(jobs: list[Job]):
        worse = {"lead": 1.5}
        return [
            dict.fromkeys(KEPT, worse.get(job.without, 1.0) * (1.0 + 0.01 * job.seed))
            for job in jobs
        ]

    rows = {row.part: row for row in ablate({"pid": None}, cells, [1, 2], yard, make)}
    lead, hold = rows["lead"], rows["hold"]
    assert lead.found["accuracy"]
    assert lead.differences["accuracy"].mean == pytest.approx(0.5 * 1.015)
    assert lead.differences["accuracy"].pairs == 12  # cells, not runs
    assert not hold.found["accuracy"]
    assert hold.differences["accuracy"].mean == 0.0


def test_ablate_from_the_command_line():
    """`hil ablate --json` has a row for the part asked for, over the unseen half."""
    asked = [
        "suite",
        "--outer",
        "pid",
        "--cells",
        "2",
        "--part",
        "lead",
        "--workers",
        "1",
        "--json",
    ]
    run = CliRunner().invoke(command, asked, standalone_mode=False, catch_exceptions=False)
    document = json.loads(run.stdout)
    assert document["cells"] == ["beside in brake-left", "behind in wrong-geometry"]
    (row,) = document["rows"]
    assert (row["law"], row["part"]) == ("pid", "lead")
    assert row["scores"]["accuracy"]["pairs"] == 2
    with pytest.raises(BadInput, match="none of these laws has it"):
        CliRunner().invoke(
            command, ["--part", "wings"], standalone_mode=False, catch_exceptions=False
        )
