"""What an estimator must do, checked: fed a drive whose truth is known, then in a scenario on the twin."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hil.config.load import load_scenario
from hil.config.scenario import Scenario
from hil.control.estimators.geometry import BelievedGeometry
from hil.control.estimators.making import make_estimator
from hil.core.registries import ESTIMATORS
from hil.core.types import Estimate, Estimator, Pose, wrap_pi
from hil.record.reader import RunRecord
from hil.runs.execute import execute_in_memory
from hil.tools.conformance.floor import mirrored_estimate
from hil.tools.conformance.laws import (
    MIRROR_SHARE,
    SCENARIO,
    STEP_SHARE,
    require_equal_run,
    require_held,
    spec_of,
)
from hil.tools.conformance.report import Checks, Named, Report, Violation, entry_of
from hil.tools.conformance.sensed_drive import Asked, Drive, Given, mirrored_drive, sensed_drive
from hil.tools.conformance.watch import Heard, require_no_clock, require_no_random, watch

# From here on the estimate must be near the truth: filters need a while.
SETTLED_S = 2.0
# Median and worst error that pass as following the robot; an estimate that ignores a sensor's sign
# is off by tens of centimetres.
MEDIAN_M, WORST_M = 0.02, 0.08
MEDIAN_RAD, WORST_RAD = 0.06, 0.4

Answers = list[Estimate | None]


@dataclass(frozen=True, slots=True)
class Bench:
    """An estimator set up for a scenario, and the drives it is fed."""

    name: str
    scenario: Scenario
    drive: Drive
    other: Drive

    def make(self) -> Estimator:
        """Return a new instance."""
        return make_estimator(self.name, self.scenario.control, geometry_of(self.scenario))


def geometry_of(scenario: Scenario) -> BelievedGeometry:
    """Return the robot of a scenario as the host believes it."""
    robot = scenario.robot
    return BelievedGeometry(
        robot.wheel_radius_m, robot.track_m, robot.d0_m, robot.encoder_counts_per_turn
    )


def check_estimator(
    estimator: Named, *, scenario: str = SCENARIO, overrides: Sequence[str] = ()
) -> Report:
    """Return the report on an estimator that keeps every rule of the kit.

    Raises AssertionError that names the checks that do not hold, BadInput when there is none such.
    """
    return estimator_report(estimator, scenario=scenario, overrides=overrides).required()


def estimator_report(
    estimator: Named, *, scenario: str = SCENARIO, overrides: Sequence[str] = ()
) -> Report:
    """Return what the kit finds of an estimator; raises BadInput when there is none such."""
    with entry_of(ESTIMATORS, estimator) as entry:
        texts = (f"control.estimator={entry.name}", *overrides)
        resolved = load_scenario(scenario, texts)
        geometry = geometry_of(resolved)
        lag_s = resolved.control.fusion.wheel_lag_s
        drives = (sensed_drive(geometry, lag_s, seed) for seed in (1, 2))
        bench = Bench(entry.name, resolved, *drives)
        checks = Checks("estimator", entry.name, entry.origin)
        checks.run("none before the first pose", lambda: _none_first(bench))
        checks.run("finite", lambda: _finite(bench))
        checks.run(
            "follows the robot", lambda: _follows(bench.drive, feed(bench.make(), bench.drive))
        )
        checks.run("negative control", lambda: _turned(bench))
        checks.run("deterministic", lambda: _deterministic(bench))
        checks.run("asking changes nothing", lambda: _asking(bench))
        checks.run("no state shared", lambda: _shared(bench))
        heard = Heard()
        checks.run("no clock", lambda: _no_clock(bench, heard))
        checks.run("no unseeded random number", lambda: require_no_random(heard))
        checks.run("mirror symmetry", lambda: _mirror(bench))
        checks.run("step time", lambda: _step_time(bench))
        runs: list[RunRecord] = []
        checks.run("in the loop", lambda: _runs(bench, runs))
        if runs:
            checks.run("against itself", lambda: _itself(bench, runs[0]))
        else:
            checks.leave_out(("against itself",), "the estimator does not run")
        return checks.report()


def feed(estimator: Estimator, drive: Drive) -> Answers:
    """Return what an estimator answers along a drive."""
    answers: Answers = []
    for event in drive.events:
        _take(estimator, event, answers)
    return answers


def _take(estimator: Estimator, event: Given | Asked, answers: Answers) -> None:
    if isinstance(event, Asked):
        answers.append(estimator.estimate_at(event.t_s))
    elif event.wheels is not None:
        estimator.on_wheels(event.wheels)
    elif event.measurement is not None:
        estimator.on_pose(event.t_s, event.measurement)
    else:
        estimator.on_command(event.t_s, *event.command)


def _numbers(estimate: Estimate | None) -> tuple[float, ...]:
    if estimate is None:
        return ()
    pose = estimate.pose
    return (
        pose.x_m, pose.y_m, pose.theta_rad, estimate.eta1_m_s, estimate.theta_dot_rad_s,
        *estimate.z1_m, *estimate.z2_m_s, *(estimate.z3_m_s2 or ()),
    )  # fmt: skip


def _none_first(bench: Bench) -> str:
    answer = bench.make().estimate_at(0.0)
    if answer is not None:
        raise Violation(f"estimate_at before any pose returned {answer!r}, None is needed")
    return "None"


def _finite(bench: Bench) -> str:
    answers = feed(bench.make(), bench.drive)
    for event, answer in zip(bench.drive.asked, answers, strict=True):
        if answer is None:
            if event.t_s > SETTLED_S:
                raise Violation(f"None at {event.t_s:.2f} s, {SETTLED_S:g} s after the first pose")
            continue
        if not isinstance(answer, Estimate):
            raise Violation(f"estimate_at returned {type(answer).__name__}, an Estimate is needed")
        if not all(math.isfinite(value) for value in _numbers(answer)):
            raise Violation(f"not finite at {event.t_s:.2f} s: {answer!r}")
    return f"{len(answers)} estimates; lost, late and repeated pictures and reports among its input"


def _errors(drive: Drive, answers: Answers) -> tuple[list[float], list[float]]:
    off_m, off_rad = [], []
    for event, answer in zip(drive.asked, answers, strict=True):
        if event.t_s < SETTLED_S or answer is None:
            continue
        truth: Pose = event.truth
        pose = answer.pose
        off_m.append(math.hypot(pose.x_m - truth.x_m, pose.y_m - truth.y_m))
        off_rad.append(abs(wrap_pi(pose.theta_rad - truth.theta_rad)))
    if not off_m:
        raise Violation("no estimate to compare with the truth")
    return off_m, off_rad


def _follows(drive: Drive, answers: Answers) -> str:
    off_m, off_rad = _errors(drive, answers)
    said = (
        f"median {1e3 * float(np.median(off_m)):.1f} mm, {float(np.median(off_rad)):.4f} rad; worst "
        f"{1e3 * max(off_m):.1f} mm, {max(off_rad):.4f} rad"
    )
    if (
        not float(np.median(off_m)) <= MEDIAN_M
        or not max(off_m) <= WORST_M
        or not float(np.median(off_rad)) <= MEDIAN_RAD
        or not max(off_rad) <= WORST_RAD
    ):
        raise Violation(
            f"{said}; at most {1e3 * MEDIAN_M:g} mm and {MEDIAN_RAD:g} rad, worst "
            f"{1e3 * WORST_M:g} mm and {WORST_RAD:g} rad"
        )
    return said


def _turned(bench: Bench) -> str:
    answers = feed(bench.make(), mirrored_drive(bench.drive))
    try:
        _follows(bench.drive, answers)
    except Violation as seen:
        return f"fed the scene with its lateral sign turned: {seen}"
    raise Violation("fed the scene with its lateral sign turned it follows the robot all the same")


def _require_same(one: Answers, two: Answers, drive: Drive, what: str) -> None:
    for event, a, b in zip(drive.asked, one, two, strict=False):
        if repr(_numbers(a)) != repr(_numbers(b)):
            raise Violation(f"{what}: at {event.t_s:.2f} s {_numbers(a)} against {_numbers(b)}")


def _deterministic(bench: Bench) -> str:
    one, two = (feed(bench.make(), bench.drive) for _ in range(2))
    _require_same(one, two, bench.drive, "two new ones, the same input")
    return "two new ones agree to the last bit"


def _asking(bench: Bench) -> str:
    """Ask twice: the host asks for several instants a tick."""
    estimator, answers = bench.make(), list[Estimate | None]()
    for event in bench.drive.events:
        if isinstance(event, Asked):
            estimator.estimate_at(event.t_s + 0.01)
        _take(estimator, event, answers)
    alone = feed(bench.make(), bench.drive)
    _require_same(alone, answers, bench.drive, "asked once, and asked for a later instant before")
    return "an estimate for another instant leaves it as it was"


def _shared(bench: Bench) -> str:
    drives = (bench.drive, bench.other)
    alone = [feed(bench.make(), drive) for drive in drives]
    pair: list[tuple[Estimator, Answers]] = [(bench.make(), []), (bench.make(), [])]
    for events in zip(drives[0].events, drives[1].events, strict=False):
        for (estimator, answers), event in zip(pair, events, strict=True):
            _take(estimator, event, answers)
    for one, (_, two), drive in zip(alone, pair, drives, strict=True):
        _require_same(one, two, drive, "alone, and in turns with another instance")
    return "two instances in turns are as each alone"


def _no_clock(bench: Bench, heard: Heard) -> str:
    with watch(heard):
        feed(bench.make(), bench.drive)
    return require_no_clock(heard, "times are arguments")


def _mirror(bench: Bench) -> str:
    given = feed(bench.make(), bench.drive)
    turned = feed(bench.make(), mirrored_drive(bench.drive))
    worst = 0.0
    for event, a, b in zip(bench.drive.asked, given, turned, strict=True):
        if a is None or b is None:
            if a is not b:
                raise Violation(f"at {event.t_s:.2f} s there is an estimate in one of both scenes")
            continue
        pairs = zip(_numbers(mirrored_estimate(a)), _numbers(b), strict=True)
        off = max(abs(one - two) for one, two in pairs)
        worst = max(worst, off)
        if not off <= MIRROR_SHARE:
            raise Violation(
                f"at {event.t_s:.2f} s: {a!r}; in the scene mirrored left to right {b!r}"
            )
    return f"mirrored to {worst:.1g} (m, rad, m/s, rad/s)"


def _step_time(bench: Bench) -> str:
    estimator, answers, taken_s = bench.make(), list[Estimate | None](), []
    began_s = time.thread_time()
    for event in bench.drive.events:
        _take(estimator, event, answers)
        if isinstance(event, Asked):
            now_s = time.thread_time()
            taken_s.append(now_s - began_s)
            began_s = now_s
    # Processor time, and the least of all: what else runs on the machine only adds to it.
    dt_s, least_s = 1.0 / bench.scenario.control.rate_hz, min(taken_s)
    said = f"{least_s * 1e3:.3f} ms a tick of processor time (least), tick {dt_s * 1e3:.1f} ms"
    if least_s > STEP_SHARE * dt_s:
        raise Violation(f"{said}; at most {STEP_SHARE:.0%} of the tick")
    return said


def _runs(bench: Bench, runs: list[RunRecord]) -> str:
    """Run the scenario; whether it holds is a matter of law and gains too, and is said only."""
    runs.append(execute_in_memory(spec_of(bench.scenario, bench.scenario.control.outer)))
    if not runs[0].samples["t_s"].size:
        raise Violation(f"no tick was made: {runs[0].manifest.outcome_detail}")
    try:
        return f"{require_held(runs[0])} hold with {bench.scenario.control.outer}"
    except Violation as seen:
        return f"runs; with {bench.scenario.control.outer} it does not hold: {seen}"


def _itself(bench: Bench, record: RunRecord) -> str:
    return require_equal_run(record, bench.scenario, bench.scenario.control.outer)
