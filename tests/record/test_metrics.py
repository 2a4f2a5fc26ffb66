"""Every figure against a signal whose value is known by hand; requirements hold and fail."""

from __future__ import annotations

import math

import numpy as np
import pytest

from hil.analysis import metrics
from hil.analysis.metrics import LinkStats
from hil.core import figures as figure_table
from hil.core.errors import BadInput
from hil.core.figures import METRICS
from hil.record.schema import SAMPLE_NAMES

T_S = np.linspace(0.0, 10.0, 1001)


def columns(**given):
    """Return samples of 10 s at 100 Hz: NaN everywhere except what a test names."""
    filled = {name: np.full(T_S.size, np.nan) for name in SAMPLE_NAMES}
    flat = {name: np.zeros(T_S.size) for name in ("delta1_x_m", "delta1_y_m", "est_x_m",
            "est_y_m", "est_theta_rad", "deadline_miss")}  # fmt: skip
    return (
        filled | flat | {"t_s": T_S} | {k: np.broadcast_to(v, T_S.shape) for k, v in given.items()}
    )


def values(**given):
    return metrics.compute(columns(**given)).values


def test_every_figure_is_computed():
    """The result has exactly the declared figures, and metrics.json has null for NaN."""
    figures = metrics.compute(columns())
    assert set(figures.values) == {metric.name for metric in METRICS}
    tree = figures.to_json()
    assert tree["figures"]["reaching_s"] == {"value": None, "unit": "s"}


def test_error_integrals_of_a_ramp():
    """|delta1| = 1 - t/10: ISE = 10/3, IAE = 5, ITAE = 50 - 100/3; |.| joins X and Y as 3-4-5."""
    fall = 1.0 - T_S / 10.0
    found = values(delta1_x_m=0.6 * fall, delta1_y_m=-0.8 * fall)
    assert found["ise_m2_s"] == pytest.approx(10 / 3, rel=1e-4)
    assert found["iae_m_s"] == pytest.approx(5.0, rel=1e-9)
    assert found["itae_m_s2"] == pytest.approx(50 - 100 / 3, rel=1e-4)
    assert found["delta1_final_m"] == pytest.approx(0.0, abs=1e-12)
    assert found["delta1_worst_last_second_m"] == pytest.approx(0.1, rel=1e-9)


def test_settling_is_the_last_entry_into_the_band():
    """An error that leaves the band again settles only when it is back for good."""
    error = np.where(T_S < 2.0, 0.2, 0.01)
    assert values(delta1_x_m=error)["settling_50mm_s"] == pytest.approx(2.0)
    error = np.where((T_S > 5.0) & (T_S < 6.0), 0.03, error)
    found = values(delta1_x_m=error)
    assert found["settling_50mm_s"] == pytest.approx(2.0)
    assert found["settling_20mm_s"] == pytest.approx(6.0)
    assert math.isnan(values(delta1_x_m=np.full(T_S.size, 0.06))["settling_50mm_s"])
    assert values(delta1_x_m=np.zeros(T_S.size))["settling_20mm_s"] == 0.0


def test_truth_is_preferred_and_named():
    """With truth in the record the error and the path come from it, and the basis says so."""
    given = {"true_delta1_x_m": 0.3, "true_delta1_y_m": 0.4, "delta1_x_m": 9.0,
             "true_x_m": T_S, "true_y_m": 0.0, "true_theta_rad": 0.0}  # fmt: skip
    figures = metrics.compute(columns(**given))
    assert figures.basis == "truth"
    assert figures.values["delta1_final_m"] == pytest.approx(0.5)
    assert figures.values["path_length_m"] == pytest.approx(10.0)
    assert metrics.compute(columns()).basis == "estimate"


def test_path_and_turn():
    """A quarter circle of 2 m radius to the right is pi m long and turns by -pi/2."""
    angle = math.pi / 2 * (1 - T_S / 10)
    found = values(est_x_m=2 * np.cos(angle), est_y_m=2 * np.sin(angle), est_theta_rad=angle,
                   delta1_x_m=-0.4)  # fmt: skip
    assert found["path_length_m"] == pytest.approx(math.pi, rel=1e-5)
    assert found["turn_rad"] == pytest.approx(-math.pi / 2)
    assert found["start_offset_x_m"] == pytest.approx(-0.4)


def test_energies_hold_each_value_until_the_next_tick():
    """With u = (3, 4) for 5 s, then 0: 125; PWM 10 left, -20 right over 10 s: 5,000."""
    on = np.where(T_S < 5.0 - 1e-9, 1.0, 0.0)
    found = values(zeta_m_s2=3 * on, u2_m_s2=4 * on, pwm_left_counts=10.0, pwm_right_counts=-20.0)
    assert found["control_energy_m2_s3"] == pytest.approx(125.0)
    assert found["pwm_energy_counts2_s"] == pytest.approx(5000.0)
    assert math.isnan(values()["control_energy_m2_s3"])


def test_a_law_that_never_gives_its_u_has_no_control_energy():
    """The zeros of the control stop are not the law's: no energy, in place of one of 0."""
    rest = T_S > 6.0
    stopped = {name: np.where(rest, 0.0, np.nan) for name in ("v1_m_s3", "u2_m_s2", "zeta_m_s2")}
    stopped |= {name: np.where(rest, 0.0, 0.2) for name in ("eta1_cmd_m_s", "theta_dot_cmd_rad_s")}
    assert math.isnan(values(**stopped)["control_energy_m2_s3"])
    told = stopped | {"zeta_m_s2": np.where(rest, 0.0, 3.0), "u2_m_s2": np.where(rest, 0.0, 4.0)}
    assert values(**told)["control_energy_m2_s3"] == pytest.approx(25.0 * 6.01)
    held = {name: 0.0 for name in stopped}
    assert values(**held)["control_energy_m2_s3"] == 0.0, "a run that the stop held throughout"


def test_variation_sums_every_change():
    """A square wave of amplitude 2 with 10 edges varies by 40; a constant does not vary."""
    square = np.where(np.floor(T_S / 10 * 11 + 1e-9) % 2 == 0, 2.0, -2.0)[:-1]
    wave = np.append(square, square[-1])
    found = values(eta1_cmd_m_s=wave, theta_dot_cmd_rad_s=3.0, pwm_left_counts=wave,
                   pwm_right_counts=-wave)  # fmt: skip
    assert found["eta1_variation_m_s"] == pytest.approx(40.0)
    assert found["theta_dot_variation_rad_s"] == 0.0
    assert found["pwm_variation_counts"] == pytest.approx(80.0)


def test_sliding_figures():
    """A sine s_x crosses zero at 3.23, 6.56 and 9.89 s, s_y never: 0.3 per second."""
    found = values(
        s_x_m_s2=np.sin(2 * math.pi * 0.15 * T_S + 0.1),
        s_y_m_s2=1.0,
        eps_m_s2=0.5,
        in_layer=(T_S >= 2.5).astype(float),
        saturated=(T_S < 1.0 - 1e-9).astype(float),
    )
    assert found["s_sign_changes_hz"] == pytest.approx(0.3)
    assert found["in_layer_share"] == pytest.approx(751 / 1001)
    assert found["reaching_s"] == pytest.approx(2.5)
    assert found["saturated_share"] == pytest.approx(100 / 1001)


def test_sign_changes_pass_over_zero():
    """+1, 0, -1 is one change; +1, 0, +1 is none."""
    s = np.ones(T_S.size)
    s[500], s[501:] = 0.0, -1.0
    touch = np.ones(T_S.size)
    touch[500] = 0.0
    found = values(s_x_m_s2=s, s_y_m_s2=touch, in_layer=1.0)
    assert found["s_sign_changes_hz"] == pytest.approx(0.1)


def test_pid_has_no_sliding_figures():
    """Where a law has no sliding variable its figures do not exist, rather than being perfect."""
    found = values()
    for name in ("s_sign_changes_hz", "in_layer_share", "reaching_s"):
        assert math.isnan(found[name])


def test_link_and_latency():
    """2 of 200 frames lost is 1 %; percentiles over known values only; misses counted."""
    rtt = np.where(np.arange(T_S.size) % 2 == 0, 0.04, np.nan)
    delay = np.linspace(0.1, 0.2, T_S.size)
    miss = np.zeros(T_S.size)
    miss[[3, 5]] = 1.0
    given = columns(rtt_s=rtt, exposure_to_actuation_s=delay, deadline_miss=miss)
    found = metrics.compute(given, LinkStats(frames_received=198, frames_lost=2)).values
    assert found["link_loss_ratio"] == pytest.approx(0.01)
    assert found["rtt_median_s"] == pytest.approx(0.04)
    assert found["exposure_to_actuation_median_s"] == pytest.approx(0.15)
    assert found["exposure_to_actuation_p99_s"] == pytest.approx(0.199)
    assert found["deadline_misses"] == 2.0


def test_requirements_hold_and_fail():
    """The same run passes a limit above its value and fails one below; NaN never passes."""
    figures = metrics.compute(columns(delta1_x_m=0.015))
    name = "delta1_worst_last_second_m"
    for maximum, holds in ((0.020, True), (0.015, True), (0.0149, False)):
        (verdict,) = metrics.check(figures, {"requirements": [{"metric": name, "max": maximum}]})
        assert verdict.holds is holds
    (verdict,) = metrics.check(figures, {"requirements": [{"metric": "reaching_s", "max": 1e9}]})
    assert not verdict.holds
    (verdict,) = metrics.check(figures, {"requirements": [{"metric": name, "min": 0.016}]})
    assert not verdict.holds
    assert not metrics.all_hold([verdict])
    assert metrics.all_hold([])


def test_side_and_turn_are_checked_by_sign():
    """Start left and turn right: fails for the mirrored run, which a wrong sign would give."""
    limits = ("start_offset_x_m", "turn_rad")
    scenario = {"requirements": [{"metric": name, "max": 0.0} for name in limits]}
    turning_right = 0.5 - T_S / 10
    good = metrics.compute(columns(delta1_x_m=-0.5, est_theta_rad=turning_right))
    mirrored = metrics.compute(columns(delta1_x_m=0.5, est_theta_rad=-turning_right))
    assert [v.holds for v in metrics.check(good, scenario)] == [True, True]
    assert [v.holds for v in metrics.check(mirrored, scenario)] == [False, False]


def test_unknown_figure_and_short_record_are_bad_input():
    """A misspelt figure lists near names; a record of one tick has no figures."""
    with pytest.raises(BadInput, match=r"near: .*settling_20mm_s"):
        figure_table.require_known("settling_20_s")
    with pytest.raises(BadInput, match="1 rows of samples"):
        metrics.compute({name: np.zeros(1) for name in SAMPLE_NAMES})
