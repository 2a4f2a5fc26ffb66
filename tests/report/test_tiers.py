"""The gap between two targets, against runs made to differ by known amounts."""

from dataclasses import replace

import numpy as np
import pytest

from hil.report.compare import compare_runs
from hil.report.target_gap import tier_gap
from tests.record.synthetic import make_run


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    return make_run(tmp_path_factory.mktemp("tiers") / "run", "pid")


def on_pil(run, **columns):
    """Return the run as if it came from the processor in the loop, with columns replaced."""
    manifest = run.manifest.model_copy(update={"target": "pil"})
    return replace(run, manifest=manifest, samples=run.samples | columns)


def test_equal_runs_have_no_gap(run):
    """The same samples on another target: equal PWM, no distance."""
    text = tier_gap(run, on_pil(run))
    assert "PWM equal in every tick" in text
    assert "0 mm and 0 rad apart" in text


def test_first_difference_and_rms_are_named(run):
    """PWM 7 counts more from row 5 on, and 3-4-5: 3 mm in X and 4 mm in Y make 5 mm."""
    pwm = run.samples["pwm_left_counts"].copy()
    pwm[5:] += 7
    other = on_pil(
        run,
        pwm_left_counts=pwm,
        true_x_m=run.samples["true_x_m"] + 0.003,
        true_y_m=run.samples["true_y_m"] - 0.004,
    )
    text = tier_gap(run, other)
    assert f"first differs at {run.samples['t_s'][5]:.3f} s" in text
    assert f"{pwm[5] - 7:.0f} against {pwm[5]:.0f}" in text
    assert "5 mm and 0 rad apart" in text
    assert any("gap between twin and pil" in line for line in compare_runs([run, other]).warnings)


def test_nothing_is_said_where_more_than_the_target_differs(run):
    """Another seed, the same target, or poses nobody knows: no gap between tiers."""
    other = on_pil(run)
    assert tier_gap(run, run) is None
    seeded = other.manifest.model_copy(update={"seed": run.manifest.seed + 1})
    assert tier_gap(run, replace(other, manifest=seeded)) is None
    unknown = np.full_like(run.samples["true_x_m"], np.nan)
    assert tier_gap(run, on_pil(run, true_x_m=unknown)) is None
