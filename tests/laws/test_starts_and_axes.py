"""Equal starts for all laws, and the cost H = sigma ||delta4||: its lemma, and scenes turned at will."""

from __future__ import annotations

import math

import pytest

from hil.config.control import CircleReference, ControlConfig, OuterLimits
from hil.control.laws.asg_ism import AsgIsm
from hil.control.laws.making import make_outer_law
from hil.core.registries import OUTER_LAWS
from hil.core.registry import BUILT_IN
from hil.study.ideal_circle import (
    CIRCLE_GAINS,
    CIRCLE_LIMITS,
    CIRCLE_START,
    Disturbances,
    run_ideal,
)
from tests.laws.support import D0_M, drive_to, estimate, point

LAWS = [entry.name for entry in OUTER_LAWS.entries() if entry.origin == BUILT_IN]
BASE = ControlConfig().active_gains
START, GOAL = (-0.6, -0.35, math.pi / 2), (0.05, 0.35)


LIMITS = OuterLimits()


def law_of(name, limits=LIMITS, **gains):
    """Return a law with some of its gains replaced."""
    return make_outer_law(name, BASE.with_values(OUTER_LAWS.get(name), gains), limits, D0_M)


@pytest.mark.parametrize("name", LAWS)
def test_every_law_starts_with_the_zeta_it_is_given(name):
    """At standstill the first tick's zeta is the law's own start, along the way to the point."""
    for start, goal_x, sign in ((0.7, 1.0, 1.0), (0.2, -1.0, -1.0)):
        law, here = law_of(name, zeta_start_m_s2=start), estimate()
        law.reset(point(goal_x, 0.1), here)
        assert law.step(point(goal_x, 0.1), here, 1 / 30).trace["zeta_m_s2"] == sign * start


@pytest.mark.parametrize("name", LAWS)
def test_without_a_start_of_its_own_a_law_has_that_of_the_limits(name):
    """Scenario files that set control.limits.zeta_start_m_s2 mean every law, as before."""
    entry = OUTER_LAWS.get(name)
    law, here = law_of(name, OuterLimits(zeta_start_m_s2=0.33), zeta_start_m_s2=None), estimate()
    law.reset(point(1, 0), here)
    assert law.step(point(1, 0), here, 1 / 30).trace["zeta_m_s2"] == 0.33
    assert "zeta_start_m_s2" in entry.search


def turned(angle, start=START, goal=GOAL):
    """Return the start and the goal turned about the origin."""
    c, s = math.cos(angle), math.sin(angle)
    x, y, theta = start
    return (
        (c * x - s * y, s * x + c * y, theta + angle),
        (c * goal[0] - s * goal[1], s * goal[0] + c * goal[1]),
    )


def errors(name, angle, **gains):
    """Return the distance to the goal at every tick of 6 s, in the scene turned by `angle`."""
    start, goal = turned(angle)
    run = drive_to(law_of(name, **gains), start, goal, seconds=6.0, push=0.02)
    return [run.error(goal, index) for index in range(len(run.z1))]


def apart(name, **gains):
    """Return the largest difference of |delta1| to the scene as it stands, over 8 angles."""
    straight = errors(name, 0.0, **gains)
    return max(
        abs(a - b)
        for k in range(1, 8)
        for a, b in zip(straight, errors(name, k * 2 * math.pi / 16 + 0.1, **gains), strict=True)
    )


@pytest.mark.parametrize("name", LAWS)
def test_a_turned_scene_gives_the_same_run(name):
    """With the cost's norm no law knows the axes of the world: |delta1| is the same to 1e-9 m."""
    norm = {"cost": "norm"} if "cost" in OUTER_LAWS.get(name).settings.model_fields else {}
    assert apart(name, **norm) < 1e-9


@pytest.mark.parametrize("name", ["asg-ism", "asg-ism-implicit"])
def test_the_printed_cost_depends_on_the_axes(name):
    """Negative control: with sign(delta4) by component the turned scene is another run."""
    assert apart(name, cost="sum", sigma_m_s2=0.7, mu0_s=0.21) > 1e-3


def run_with_norm(sigma):
    """Return the law, its run on the disturbed circle, and H(delta4) at every step."""
    gains = CIRCLE_GAINS.asg_ism.model_copy(update={"sigma_m_s2": sigma, "cost": "norm"})
    law = AsgIsm(gains, CIRCLE_LIMITS, D0_M)
    step, costs = law.step, []

    def recording_step(reference, here, dt_s):
        out = step(reference, here, dt_s)
        costs.append(sigma * math.hypot(*law.delta4_m_s))
        return out

    law.step = recording_step
    run = run_ideal(
        law, CircleReference(), CIRCLE_START, disturbances=Disturbances(), duration_s=20.0
    )
    return law, gains, run, costs


def test_cost_of_the_norm_obeys_the_lemma():
    """(4.18) for H = sigma ||delta4||: (t + mu0) H <= |gamma|^2/2 + sigma int (t + mu0) ||s||.

    The derivation of appendix 10.1 needs of H only that it is convex and of degree one: with
    y = (t + mu0) delta4 and Z = gamma + int dH it is d H(y)/dt = <dH, (t + mu0) s> - d(|Z|^2/2)/dt,
    and |dH| <= sigma, where the printed cost has sigma sqrt(2).
    """
    law, gains, run, costs = run_with_norm(0.5)
    gamma2 = sum(g * g for g in law.gamma_m_s)
    drift = 0.0
    for t, s, cost in zip(run.t_s, run.s, costs, strict=True):
        drift += gains.sigma_m_s2 * (t + gains.mu0_s) * math.hypot(*s) * 2e-3
        assert (t + gains.mu0_s) * cost <= 0.5 * gamma2 + drift + 1e-3
    assert max(costs) > 10 * costs[-1]


def test_without_gamma_the_lemma_does_not_hold(monkeypatch):
    """Negative control: without s(0) = 0 the cost passes the bound that |gamma|^2/2 = 0 would give."""
    monkeypatch.setattr(AsgIsm, "reset", lambda *_: None)
    law, gains, run, costs = run_with_norm(0.5)
    assert law.gamma_m_s == (0.0, 0.0)
    assert max((t + gains.mu0_s) * cost for t, cost in zip(run.t_s, costs, strict=True)) > 1e-2
