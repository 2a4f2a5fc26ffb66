"""What a figure of merit and a tuning cost must do, checked on runs of the twin."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from hil.analysis.costs import Cost
from hil.analysis.own_figures import value_of
from hil.config.load import load_scenario
from hil.control.laws.making import make_law
from hil.core.figures import BY_NAME, declared
from hil.core.registries import FIGURES, TUNING_COSTS
from hil.core.registry import Entry, in_one_line, place_of
from hil.runs.execute import execute_in_memory
from hil.tools.conformance.laws import SCENARIO, Turned, spec_of
from hil.tools.conformance.report import Checks, Named, Report, Violation, entry_of
from hil.tools.conformance.watch import Heard, require_no_clock, require_no_random, watch

if TYPE_CHECKING:
    from hil.analysis.metrics import RunData
    from hil.record.reader import RunRecord

# The laws whose runs are judged: one without a sliding variable, whose columns are NaN, and one with.
_LAWS = ("pid", "asg-ism")
_TICKS_OF_A_SHORT_RUN = 2

Call = Callable[[Any], Any]


@dataclass(frozen=True, slots=True)
class _Runs:
    """What is judged: a run of each law, the second with its turn the other way, and its beginning."""

    good: tuple[RunRecord, ...]
    turned: RunRecord

    @property
    def every(self) -> tuple[RunRecord, ...]:
        """Return them all."""
        return (*self.good, self.turned)


def check_figure(
    figure: Named, *, scenario: str = SCENARIO, overrides: Sequence[str] = ()
) -> Report:
    """Return the report on a figure of merit that keeps every rule of the kit.

    `figure` is a name, a file or the decorated function; `overrides` are KEY=VALUE texts as for --set.
    Raises AssertionError that names the checks that do not hold, BadInput when there is no such figure.
    """
    return figure_report(figure, scenario=scenario, overrides=overrides).required()


def check_cost(cost: Named, *, scenario: str = SCENARIO, overrides: Sequence[str] = ()) -> Report:
    """Return the report on a tuning cost that keeps every rule of the kit.

    `cost` is a name, a file or the decorated function; `overrides` are KEY=VALUE texts as for --set.
    Raises AssertionError that names the checks that do not hold, BadInput when there is no such cost.
    """
    return cost_report(cost, scenario=scenario, overrides=overrides).required()


def figure_report(
    figure: Named, *, scenario: str = SCENARIO, overrides: Sequence[str] = ()
) -> Report:
    """Return what the kit finds of a figure of merit; raises BadInput when there is no such figure."""
    with entry_of(FIGURES, figure) as entry:
        checks = Checks(FIGURES.kind, entry.name, entry.origin)
        runs = _runs(scenario, overrides)
        data = [run.data() for run in runs.every]
        unit = declared(entry).unit
        checks.run("finite", lambda: _told([value_of(entry, one) for one in data[:2]], unit))
        checks.run("deterministic", lambda: _same_twice(entry.factory, data))
        checks.run("leaves the run as it is", lambda: _unchanged(entry, runs.good[0]))
        heard = Heard()
        checks.run("no clock", lambda: _no_clock(entry.factory, data[0], heard))
        checks.run("no unseeded random number", lambda: require_no_random(heard))
        checks.run("short run", lambda: _short(entry, runs.good[0]))
        checks.run("negative control", lambda: _apart(entry.factory, data))
        return checks.report()


def cost_report(cost: Named, *, scenario: str = SCENARIO, overrides: Sequence[str] = ()) -> Report:
    """Return what the kit finds of a tuning cost; raises BadInput when there is no such cost."""
    with entry_of(TUNING_COSTS, cost) as entry:
        checks = Checks(TUNING_COSTS.kind, entry.name, entry.origin)
        made = Cost(entry)
        runs = _runs(scenario, overrides)
        figures = [run.figures().values for run in runs.every]
        checks.run("finite", lambda: _told([_unbounded(made, one) for one in figures[:2]], ""))
        checks.run("deterministic", lambda: _same_twice(made.of, figures))
        heard = Heard()
        checks.run("no clock", lambda: _no_clock(entry.factory, figures[0], heard))
        checks.run("no unseeded random number", lambda: require_no_random(heard))
        checks.run("without figures", lambda: _without_figures(made, figures[0]))
        checks.run("below the cost of a failed run", lambda: _below_failed(made, figures[:2]))
        checks.run("negative control", lambda: _dearer(made, figures))
        return checks.report()


def _runs(scenario: str, overrides: Sequence[str]) -> _Runs:
    resolved = load_scenario(scenario, overrides)
    specs = [spec_of(resolved, law) for law in _LAWS]
    good = tuple(execute_in_memory(spec) for spec in specs)
    turned = execute_in_memory(specs[0], law=Turned(make_law(specs[0].outer, specs[0].scenario)))
    return _Runs(good, turned)


def _told(values: Sequence[float], unit: str) -> str:
    said = " and ".join(f"{value:.6g} {unit}".rstrip() for value in values)
    return f"{said} in runs of {' and '.join(_LAWS)}"


def _same_twice(function: Call, given: Sequence[Any]) -> str:
    for place, one in enumerate(given):
        first, second = (repr(_value(function, one)) for _ in range(2))
        if first != second:
            raise Violation(f"run {place + 1}: {first}, and {second} when it is asked again")
    return f"the same twice for each of {len(given)} runs, to the last bit"


def _value(function: Call, given: Any) -> Any:
    """Return what it gives, or that it raises: a run that ends early may have no value."""
    try:
        return function(given)
    except Exception as error:
        return in_one_line(error)


def _unchanged(entry: Entry, run: RunRecord) -> str:
    before = {name: values.copy() for name, values in run.samples.items()}
    figures = dict(run.figures().values)
    data = run.data()
    value_of(entry, data)
    for name, values in before.items():
        if not np.array_equal(values, run.samples[name], equal_nan=True):
            raise Violation(f"{name} is another after it")
    if repr(figures) != repr(dict(data.figures)):
        raise Violation("run.figures are others after it")
    return f"{len(before)} columns are as before"


def _no_clock(function: Call, given: Any, heard: Heard) -> str:
    with watch(heard):
        function(given)
    return require_no_clock(heard, "the run's own times are in it")


def _short(entry: Entry, run: RunRecord) -> str:
    """Require a number, or NaN, of a run that ends at its second tick."""
    rows = _TICKS_OF_A_SHORT_RUN
    short = replace(run, samples={name: values[:rows] for name, values in run.samples.items()})
    try:
        value = float(entry.factory(short.data()))
    except Exception as error:
        raise Violation(
            f"a run of {rows} ticks: {place_of(entry, error)}: raised {in_one_line(error)}; give NaN where "
            "there is no value"
        ) from None
    return f"a run of {rows} ticks has {value:.3g}"


def _apart(function: Call, data: Sequence[RunData]) -> str:
    values = [_value(function, one) for one in data]
    if len({repr(value) for value in values}) == 1:
        raise Violation(
            f"{values[0]!r} for {', '.join(_LAWS)} and for a run with its turn the other way: it tells "
            "nothing apart"
        )
    shown = ", ".join(
        f"{value:.4g}" if isinstance(value, float) else str(value) for value in values
    )
    return f"tells {', '.join(_LAWS)} and a run with its turn the other way apart: {shown}"


def _unbounded(cost: Cost, figures: Any) -> float:
    value = Cost(replace(cost.entry, extra={"failed": math.inf})).of(figures)
    if not math.isfinite(value):
        raise Violation("has no finite value for a run that came to its end")
    return value


def _without_figures(cost: Cost, figures: Any) -> str:
    unknown = cost.of(dict.fromkeys(figures, math.nan))
    if unknown != cost.failed:
        raise Violation(
            f"figures that are all NaN cost {unknown:g}, a failed run costs {cost.failed:g}: let NaN through"
        )
    assert set(BY_NAME) <= set(figures)
    return f"{cost.failed:g}, as a failed run"


def _below_failed(cost: Cost, figures: Sequence[Any]) -> str:
    most = max(_unbounded(cost, one) for one in figures)
    if not most < cost.failed:
        raise Violation(
            f"a run that came to its end costs {most:g}, a failed one {cost.failed:g}: the search could not "
            "tell them apart; declare failed= larger"
        )
    return f"{most:.4g} at most, {cost.failed:g} for a failed run"


def _dearer(cost: Cost, figures: Sequence[Any]) -> str:
    good, turned = cost.of(figures[0]), cost.of(figures[2])
    if not turned > good:
        raise Violation(
            f"{_LAWS[0]} costs {good:g}, and {turned:g} with its turn the other way: it does not say which "
            "is better"
        )
    return f"{_LAWS[0]} costs {good:.4g}, and {turned:.4g} with its turn the other way"
