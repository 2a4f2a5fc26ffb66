"""What an outer law must do, checked: on a small floor of its own, then in a scenario on the twin."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from hil.config.control import OuterLimits
from hil.config.load import load_scenario
from hil.config.scenario import Scenario
from hil.control.laws.guard import STEP_MAX_S
from hil.control.laws.making import make_law
from hil.core.errors import RigFault
from hil.core.registries import OUTER_LAWS
from hil.core.registry import Entry
from hil.core.time_limit import TooLongError, time_limit
from hil.core.types import OuterCommand, OuterLaw
from hil.record.reader import RunRecord
from hil.record.schema import LAW_COLUMNS
from hil.runs.execute import RunSpec, execute_in_memory
from hil.runs.provenance import trace_terms
from hil.tools.conformance import batches
from hil.tools.conformance.floor import Episode, episodes, mirrored
from hil.tools.conformance.report import Checks, Named, Report, Violation, entry_of
from hil.tools.conformance.watch import Heard, require_no_clock, require_no_random, watch

SCENARIO = "scenario-1"
# Part of the outer tick that a step may take: the rest is the camera's, the estimator's and the link's.
STEP_SHARE = 0.5
# What rounding may make of a mirrored command, share of its limit.
MIRROR_SHARE = 1e-6
# A limit counts as kept with the rounding of one multiplication.
EXCESS = 1.0 + 1e-9
# Limits far below a law's usual commands, so that it must keep to what it is given.
TIGHT = {"eta1_max_m_s": 0.1, "theta_dot_max_rad_s": 0.4}
REPEATED_S = 6.0
_FEW_TICKS = 8

# The checks, in their order, after the one of the step time.
ON_THE_FLOOR = (
    "finite", "keeps to limits", "trace declared", "deterministic", "reset equals new",
    "no state shared", "no clock", "no unseeded random number", "mirror symmetry",
)  # fmt: skip
ON_THE_TWIN = ("scenario holds", "against itself", "negative control")


@dataclass(frozen=True, slots=True)
class Bench:
    """A law, the scenario it is set up for, and the episodes it is stepped through."""

    entry: Entry
    scenario: Scenario
    episodes: tuple[Episode, ...]

    def make(self, limits: OuterLimits | None = None) -> OuterLaw:
        """Return a new instance of the law."""
        control = self.scenario.control
        gains = control.active_gains.of(self.entry)
        made: OuterLaw = self.entry.factory(
            gains, limits or control.limits, self.scenario.robot.d0_m
        )
        return made

    @property
    def dt_s(self) -> float:
        """Return the outer tick."""
        return 1.0 / self.scenario.control.rate_hz


def check_law(law: Named, *, scenario: str = SCENARIO, overrides: Sequence[str] = ()) -> Report:
    """Return the report on a law that keeps every rule of the kit.

    `law` is a name, a file or the registered class; `overrides` are KEY=VALUE texts as for --set.
    Raises AssertionError that names the checks that do not hold, BadInput when there is no such law.
    """
    return law_report(law, scenario=scenario, overrides=overrides).required()


def law_report(law: Named, *, scenario: str = SCENARIO, overrides: Sequence[str] = ()) -> Report:
    """Return what the kit finds of a law; raises BadInput when there is no such law."""
    with entry_of(OUTER_LAWS, law) as entry:
        trace_terms(entry)
        resolved = load_scenario(scenario, overrides)
        checks = Checks("law", entry.name, entry.origin)
        bench = Bench(entry, resolved, episodes(resolved, _FEW_TICKS))
        if not checks.run("step time", lambda: _step_time(bench)):
            checks.leave_out((*ON_THE_FLOOR, *ON_THE_TWIN), "it must take its steps in time first")
            return checks.report()
        bench = Bench(entry, resolved, episodes(resolved))
        _on_the_floor(checks, bench)
        _on_the_twin(checks, bench)
        return checks.report()


def _on_the_floor(checks: Checks, bench: Bench) -> None:
    heard = Heard()
    made = (
        _finite, _limits, _trace, _deterministic, _reset, _shared,
        lambda bench: _no_clock(bench, heard), lambda _: require_no_random(heard), _mirror,
    )  # fmt: skip
    for name, check in zip(ON_THE_FLOOR, made, strict=True):
        checks.run(name, partial(check, bench))
    if batches.makes_batches(bench.make()):
        checks.run(batches.CHECK, partial(_batch, bench))


def _on_the_twin(checks: Checks, bench: Bench) -> None:
    runs: list[RunRecord] = []
    holds, itself, control = ON_THE_TWIN
    held = checks.run(holds, lambda: _holds(bench, runs))
    if not runs:
        checks.leave_out((itself, control), "the law does not run")
        return
    checks.run(itself, lambda: _itself(bench, runs[0]))
    if held:
        checks.run(control, lambda: _turned(bench))
    else:
        checks.leave_out((control,), "it needs a law that holds the scenario")


# -- on the floor ------------------------------------------------------------------------------


def commands(law: OuterLaw, episode: Episode, dt_s: float) -> list[OuterCommand]:
    """Return what a law commands along an episode from its reset on; raises Violation."""
    out = list(_limited(_steps_of(law, episode, dt_s)))
    for command in out:
        if not isinstance(command, OuterCommand):
            raise Violation(f"step returned {type(command).__name__}, an OuterCommand is needed")
    return out


def _steps_of(law: OuterLaw, episode: Episode, dt_s: float) -> Iterator[Any]:
    """Yield what a law gives along an episode, from its reset on."""
    law.reset(episode.references[0], episode.estimates[0])
    for reference, estimate in zip(episode.references, episode.estimates, strict=True):
        yield law.step(reference, estimate, dt_s)


def _limited(steps: Iterator[Any]) -> Iterator[Any]:
    """Yield the same; raises Violation where one takes longer than a run would let it."""
    while True:
        try:
            with time_limit(STEP_MAX_S):
                given = next(steps)
        except StopIteration:
            return
        except TooLongError:
            raise Violation(
                f"a step took longer than {STEP_MAX_S:g} s; a run is stopped for that"
            ) from None
        yield given


def _bits(command: OuterCommand) -> tuple[Any, ...]:
    """Return a command so that equal means equal to the last bit, NaN included."""
    terms = sorted((name, repr(float(value))) for name, value in command.trace.items())
    return repr(float(command.eta1_m_s)), repr(float(command.theta_dot_rad_s)), tuple(terms)


def _require_same(
    one: Sequence[OuterCommand], two: Sequence[OuterCommand], episode: Episode, what: str
) -> None:
    for tick, (a, b) in enumerate(zip(one, two, strict=True)):
        if _bits(a) != _bits(b):
            raise Violation(
                f"{what}: {episode.name}, tick {tick}: {a.eta1_m_s!r} m/s, {a.theta_dot_rad_s!r} "
                f"rad/s against {b.eta1_m_s!r} m/s, {b.theta_dot_rad_s!r} rad/s"
            )


def _steps(bench: Bench) -> int:
    return sum(len(episode.estimates) for episode in bench.episodes)


def _step_time(bench: Bench) -> str:
    law, dt_s = bench.make(), bench.dt_s
    taken_s = []
    for episode in bench.episodes:
        began_s = time.perf_counter()
        for _ in _limited(_steps_of(law, episode, dt_s)):
            now_s = time.perf_counter()
            taken_s.append(now_s - began_s)
            began_s = now_s
    median_s = float(np.median(taken_s))
    said = f"{median_s * 1e3:.3f} ms (median), tick {dt_s * 1e3:.1f} ms"
    if median_s > STEP_SHARE * dt_s:
        raise Violation(f"{said}; at most {STEP_SHARE:.0%} of the tick")
    return said


def _finite(bench: Bench) -> str:
    law = bench.make()
    for episode in bench.episodes:
        for tick, command in enumerate(commands(law, episode, bench.dt_s)):
            for name in ("eta1_m_s", "theta_dot_rad_s"):
                value = getattr(command, name)
                if not isinstance(value, float | int | np.number) or not math.isfinite(value):
                    raise Violation(f"{episode.name}, tick {tick}: {name} = {value!r}")
    return f"{_steps(bench)} steps from {len(bench.episodes)} starts"


def _limits(bench: Bench) -> str:
    usual = bench.scenario.control.limits
    for limits in (usual, usual.model_copy(update=TIGHT)):
        law = bench.make(limits)
        for episode in bench.episodes:
            for tick, command in enumerate(commands(law, episode, bench.dt_s)):
                for name, limit, unit in (
                    ("eta1_m_s", limits.eta1_max_m_s, "m/s"),
                    ("theta_dot_rad_s", limits.theta_dot_max_rad_s, "rad/s"),
                ):
                    value = getattr(command, name)
                    if abs(value) > limit * EXCESS:
                        raise Violation(
                            f"{episode.name}, tick {tick}: {name} = {value:g} {unit}, the limit it "
                            f"was given is {limit:g} {unit}"
                        )
    return "at the scenario's limits and at 0.1 m/s, 0.4 rad/s"


def _trace(bench: Bench) -> str:
    own, usual = set(bench.entry.trace), {column.trace_key for column in LAW_COLUMNS}
    law, seen = bench.make(), set[str]()
    for episode in bench.episodes:
        for command in commands(law, episode, bench.dt_s):
            seen |= set(command.trace)
            for name, value in command.trace.items():
                if not isinstance(value, float | int | np.number | np.bool_):
                    raise Violation(f"trace[{name!r}] = {value!r}: not a number")
    if lost := sorted(seen - own - usual):
        raise Violation(
            f"{', '.join(lost)}: given by step and not declared with trace=, so not in the record"
        )
    if missing := sorted(own - seen):
        raise Violation(f"{', '.join(missing)}: declared with trace=, never given by step")
    return f"{len(seen)} terms, {len(own)} of them its own"


def _deterministic(bench: Bench) -> str:
    for episode in bench.episodes:
        one, two = (commands(bench.make(), episode, bench.dt_s) for _ in range(2))
        _require_same(one, two, episode, "two new ones, the same inputs")
    return "two new ones agree to the last bit"


def _reset(bench: Bench) -> str:
    used = bench.make()
    for before in bench.episodes:
        commands(used, before, bench.dt_s)
    for episode in bench.episodes:
        one, two = (commands(law, episode, bench.dt_s) for law in (bench.make(), used))
        _require_same(one, two, episode, "a new one, and a used one after reset")
    return "a used one after reset agrees with a new one to the last bit"


def _shared(bench: Bench) -> str:
    """Step two instances in turns, on different episodes; each must be as when alone."""
    first, second = bench.episodes[0], bench.episodes[1]
    alone = [commands(bench.make(), episode, bench.dt_s) for episode in (first, second)]
    steps = [_steps_of(bench.make(), episode, bench.dt_s) for episode in (first, second)]
    turns = [list(given) for given in zip(*zip(*steps, strict=False), strict=True)]
    for one, two, episode in zip(alone, turns, (first, second), strict=True):
        _require_same(one[: len(two)], two, episode, "alone, and in turns with another instance")
    return "two instances in turns are as each alone"


def _batch(bench: Bench) -> str:
    alone = [commands(bench.make(), episode, bench.dt_s) for episode in bench.episodes]
    limits = bench.scenario.control.limits
    return batches.agreement(bench.make, bench.episodes, alone, limits, bench.dt_s)


def _no_clock(bench: Bench, heard: Heard) -> str:
    with watch(heard):
        law = bench.make()
        for episode in bench.episodes:
            for _ in _steps_of(law, episode, bench.dt_s):
                pass
    return require_no_clock(heard, "time is the argument dt_s, and t_host_s")


def _mirror(bench: Bench) -> str:
    limits = bench.scenario.control.limits
    worst = 0.0
    for episode in bench.episodes:
        given = commands(bench.make(), episode, bench.dt_s)
        turned = commands(bench.make(), mirrored(episode), bench.dt_s)
        for tick, (a, b) in enumerate(zip(given, turned, strict=True)):
            off = max(
                abs(a.eta1_m_s - b.eta1_m_s) / limits.eta1_max_m_s,
                abs(a.theta_dot_rad_s + b.theta_dot_rad_s) / limits.theta_dot_max_rad_s,
            )
            worst = max(worst, off)
            if not off <= MIRROR_SHARE:
                raise Violation(
                    f"{episode.name}, tick {tick}: {a.eta1_m_s:.6g} m/s, {a.theta_dot_rad_s:.6g} "
                    f"rad/s; in the scene mirrored left to right {b.eta1_m_s:.6g} m/s, "
                    f"{b.theta_dot_rad_s:.6g} rad/s (the turn must change its sign alone)"
                )
    return f"mirrored to {worst:.1g} of the limits"


# -- on the twin -------------------------------------------------------------------------------


class Turned:
    """A law with its lateral sign wrong: what must not hold any scenario."""

    def __init__(self, law: OuterLaw) -> None:
        self._law = law

    def reset(self, reference: Any, estimate: Any) -> None:
        """Start anew."""
        self._law.reset(reference, estimate)

    def step(self, reference: Any, estimate: Any, dt_s: float) -> OuterCommand:
        """Return the law's command with the turn the other way."""
        command = self._law.step(reference, estimate, dt_s)
        return OuterCommand(command.eta1_m_s, -command.theta_dot_rad_s, command.trace)


def spec_of(scenario: Scenario, outer: str) -> RunSpec:
    """Return the run of a scenario on the twin with poses, without a record."""
    return RunSpec(scenario, "twin", "pose", outer, "asg-ism", 1, Path(), rerun=False)


def require_held(record: RunRecord) -> str:
    """Return what a run that holds says; raises Violation for one that does not."""
    manifest = record.manifest
    if manifest.outcome != "complete":
        raise Violation(f"{manifest.scenario_name}: {manifest.outcome}: {manifest.outcome_detail}")
    verdicts = record.verdicts()
    for verdict in verdicts:
        if not verdict.holds:
            raise Violation(f"{manifest.scenario_name}: {verdict.text()} is {verdict.value:.4g}")
    return f"{manifest.scenario_name}: {len(verdicts)} requirements"


def _holds(bench: Bench, runs: list[RunRecord]) -> str:
    record = execute_in_memory(spec_of(bench.scenario, bench.entry.name))
    runs.append(record)
    return require_held(record)


def require_equal_run(record: RunRecord, scenario: Scenario, outer: str) -> str:
    """Run the beginning of a recorded run again; raises Violation unless it is the same bit for bit."""
    short = scenario.model_copy(
        update={"duration_s": min(REPEATED_S, scenario.duration_s), "requirements": ()}
    )
    again = execute_in_memory(spec_of(short, outer))
    rows = min(again.samples["t_s"].size, record.samples["t_s"].size)
    for name, values in again.samples.items():
        one, two = record.samples[name][:rows], values[:rows]
        if not np.array_equal(one, two, equal_nan=True):
            first = int(np.flatnonzero(~((one == two) | (np.isnan(one) & np.isnan(two))))[0])
            raise Violation(
                f"{name} differs from {again.samples['t_s'][first]:.3f} s on, by "
                f"{abs(one[first] - two[first]):.3g}"
            )
    return f"difference exactly 0 in {len(again.samples)} columns of {rows} ticks"


def _itself(bench: Bench, record: RunRecord) -> str:
    return require_equal_run(record, bench.scenario, bench.entry.name)


def require_turned_fails(scenario: Scenario, outer: str) -> str:
    """Run a law with its turn the other way; raises Violation when that holds the scenario too."""
    spec = spec_of(scenario, outer)
    try:
        record = execute_in_memory(spec, law=Turned(make_law(outer, scenario)))
    except RigFault as fault:
        return f"its turn the other way: {fault}"
    try:
        require_held(record)
    except Violation as seen:
        return f"its turn the other way: {seen}"
    raise Violation(
        f"with its turn the other way it holds {scenario.name} too: the scenario says nothing of it"
    )


def _turned(bench: Bench) -> str:
    return require_turned_fails(bench.scenario, bench.entry.name)
