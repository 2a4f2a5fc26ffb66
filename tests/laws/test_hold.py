"""The control stop at the goal."""

import math

import pytest

from hil.config.control import OuterLimits
from hil.control.laws.making import make_outer_law
from hil.core.types import ReferenceState
from hil.study.ideal_circle import CIRCLE_GAINS
from tests.laws.support import D0_M, estimate, point

DT = 1.0 / 30.0


@pytest.fixture(params=["asg-ism", "pid"])
def law(request):
    law = make_outer_law(request.param, CIRCLE_GAINS, OuterLimits(), D0_M)
    law.reset(point(1, 0), estimate(0.5))
    return law


def test_rest_begins_inside_and_ends_beyond_the_wider_circle(law):
    """Enter within 2 mm, stay through 5 mm, leave beyond 6 mm and drive back at once."""
    assert law.step(point(1, 0), estimate(0.9, eta1=0.01), DT).eta1_m_s != 0.0
    for x in (0.999, 0.995):
        held = law.step(point(1, 0), estimate(x, eta1=0.01), DT)
        assert held.eta1_m_s == held.theta_dot_rad_s == 0.0
        assert held.trace["v1_m_s3"] == held.trace["zeta_m_s2"] == 0.0
    assert law.step(point(1, 0), estimate(0.99), DT).eta1_m_s > 0.0


def test_passing_through_the_point_is_not_arriving(law):
    """At speed, or in a turn, the law goes on; and so it does along a moving reference."""
    assert law.step(point(1, 0), estimate(1.0, eta1=0.3), DT).trace["v1_m_s3"] != 0.0
    assert law.step(point(1, 0), estimate(1.0, eta1=0.01, w=1.0), DT).trace["v1_m_s3"] != 0.0
    moving = ReferenceState((1.0, 0.0), (0.1, 0.0), (0.0, 0.0), (0.0, 0.0))
    assert law.step(moving, estimate(1.0, eta1=0.01), DT).trace["v1_m_s3"] != 0.0


def test_after_a_push_the_law_starts_anew_on_its_surface():
    """Leaving the rest resets the law: s = 0 at that instant."""
    law = make_outer_law("asg-ism", CIRCLE_GAINS, OuterLimits(), D0_M)
    law.reset(point(1, 0), estimate(0.9))
    law.step(point(1, 0), estimate(0.999), DT)
    trace = law.step(point(1, 0), estimate(0.9, 0.05), DT).trace
    assert math.hypot(trace["s_x"], trace["s_y"]) < 1e-12


def test_zero_radius_never_holds():
    """hold_enter_m = 0 switches the stop off."""
    law = make_outer_law("pid", CIRCLE_GAINS, OuterLimits(hold_enter_m=0), D0_M)
    law.reset(point(1, 0), estimate(0.9999))
    assert law.step(point(1, 0), estimate(0.9999, eta1=0.01), DT).trace["v1_m_s3"] != 0.0
