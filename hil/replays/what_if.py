"""What if the other law had run: closed loop on a twin fitted to the record.

The answer comes with two checks and is worth as much as they are: the fit's residual on parts of
the record held out, and the recorded law run on the fitted twin beside what it did in the record.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hil.analysis.metrics import compute
from hil.analysis.stats import Paired, paired
from hil.config.load import with_overrides
from hil.config.scenario import Scenario, StartPose
from hil.core.errors import BadInput
from hil.core.figures import BY_NAME
from hil.core.registries import OUTER_LAWS
from hil.record.source import Source, load_plugins, read_source, recorded_scenario
from hil.replays.fit import UNITS, Fit, Rehearsal, fit_twin
from hil.report.compare import HEADLINES
from hil.report.repeats import verdict
from hil.runs.execute import RunSpec, execute_in_memory

if TYPE_CHECKING:
    from hil.record.manifest import Manifest
    from hil.record.reader import RunRecord

SEEDS = 8
# What a recorded law is set against when nobody says: the first of these that it is not.
_USUAL = ("pid", "asg-ism")


@dataclass(frozen=True, slots=True)
class WhatIf:
    """Figures in the record, of the recorded law on the fitted twin, and paired with the other."""

    fit: Fit
    recorded_law: str
    other_law: str
    changes: tuple[str, ...]
    in_record: dict[str, float]
    answers: dict[str, Paired]
    ended_early: tuple[int, int]

    def to_json(self) -> dict[str, Any]:
        """Return the answer for a JSON document."""
        figures = {
            name: {"in_record": value if math.isfinite(value) else None}
            | {"recorded_law_on_fitted_twin": _finite(self.answers[name].baseline_mean)}
            | {"paired_on_fitted_twin": self.answers[name].to_json()}
            for name, value in self.in_record.items()
        }
        return {
            "recorded_law": self.recorded_law,
            "other_law": self.other_law,
            "changes": list(self.changes),
            "seeds": SEEDS,
            "ended_early": {"recorded_law": self.ended_early[0], "other_law": self.ended_early[1]},
            "fit": self.fit.to_json(),
            "figures": figures,
        }

    def text(self) -> str:
        """Return the answer for a person: the residual first."""
        fit = self.fit
        lines = [
            "fitted twin, true over believed with 95 % intervals:",
            *(
                f"  {group}: {value:.3f} ({low:.3f} to {high:.3f})"
                f"{'' if fit.identifiable(group) else ', not identifiable from this record'}"
                for group, (value, low, high) in fit.ratios.items()
            ),
            f"residual, RMS over {fit.windows_held_out} windows held out "
            f"(unfitted twin in brackets):",
            *(
                f"  {name}: {fit.residual_held_out[name]:.3g} {unit} "
                f"({fit.residual_unfitted[name]:.3g})"
                for name, unit in UNITS.items()
            ),
            *(f"  note: {line}" for line in fit.notes),
            f"closed loop on the fitted twin, {SEEDS} seeds, {self.other_law} - "
            f"{self.recorded_law}{''.join(f', {change}' for change in self.changes)}:",
        ]
        for name, result in self.answers.items():
            metric = BY_NAME[name]
            check = (
                f"(recorded law: {metric.text(self.in_record[name])} in the record, "
                f"{metric.text(result.baseline_mean)} here)"
            )
            lines.append(f"  {verdict(metric, result, 'difference')} {check}")
        if any(self.ended_early):
            lines.append(f"  note: {sum(self.ended_early)} of {2 * SEEDS} runs ended early")
        return "\n".join(lines)


def what_if(
    path: Path,
    outer: str | None,
    overrides: Sequence[str] = (),
    fit: Fit | None = None,
    inner: str | None = None,
) -> WhatIf:
    """Fit a twin to a record and run the recorded and another law on it; raises BadInput.

    The other is what `outer`, `inner` and `overrides` make of the recorded one; without any it is
    the other outer law. `fit` is one made of this record before.
    """
    source = read_source(path)
    manifest = source.manifest
    load_plugins(source)
    _refuse_tuned(source)
    law, wheels = _other_law(manifest, outer, inner, overrides)
    recorded = recorded_scenario(manifest, path)
    rehearsal = Rehearsal(source, recorded)
    fit = fit or fit_twin(rehearsal)
    x_m, y_m, theta_rad = rehearsal.start_pose()
    fitted = recorded.model_copy(
        update={
            "mismatch": fit.mismatch,
            "start": StartPose(x_m=x_m, y_m=y_m, theta_rad=theta_rad),
        }
    )
    own = _runs(fitted, manifest.outer, manifest.inner)
    other = _runs(with_overrides(fitted, overrides), law, wheels)
    names = list(HEADLINES)
    values = [[_figures(run) for run in runs] for runs in (own, other)]
    return WhatIf(
        fit=fit,
        recorded_law=_named(manifest.outer, manifest.inner, wheels),
        other_law=_named(law, wheels, manifest.inner),
        changes=tuple(overrides),
        in_record=_of_record(source.samples, names),
        answers={
            name: paired([v[name] for v in values[0]], [v[name] for v in values[1]])
            for name in names
        },
        ended_early=(_early(own), _early(other)),
    )


def _refuse_tuned(source: Source) -> None:
    """Raise BadInput for a run whose values were changed while it was on: it has no one law to set beside."""
    changes = sum("set" in order for order in source.tape.orders())
    if changes:
        raise BadInput(
            f"{source.path}: {changes} values were changed while it ran, so that no one law stands against "
            "another; run the values as they were left (the record's events of kind tuning), and use that"
        )


def _other_law(
    manifest: Manifest, outer: str | None, inner: str | None, overrides: Sequence[str]
) -> tuple[str, str]:
    """Return the outer and the wheel law to run beside the recorded ones."""
    if outer is None and inner is None and not overrides:
        others = [law for law in _USUAL if law != manifest.outer]
        return others[0], manifest.inner
    found = (OUTER_LAWS.get(outer or manifest.outer).name, inner or manifest.inner)
    if found == (manifest.outer, manifest.inner) and not overrides:
        raise BadInput(
            f"--fit: {_options(manifest)} is the recorded law itself, a comparison with itself says "
            "nothing; give another --outer or --inner, or a --set"
        )
    return found


def _options(manifest: Manifest) -> str:
    return f"--outer {manifest.outer} --inner {manifest.inner}"


def _named(outer: str, inner: str, other_inner: str) -> str:
    return outer if inner == other_inner else f"{outer} over {inner}"


def _runs(scenario: Scenario, outer: str, inner: str) -> list[RunRecord]:
    return [
        execute_in_memory(
            RunSpec(scenario, "twin", "pose", outer, inner, seed, Path(), rerun=False)
        )
        for seed in range(1, SEEDS + 1)
    ]


def _figures(run: RunRecord) -> dict[str, float]:
    if run.manifest.outcome != "complete":
        return dict.fromkeys(HEADLINES, math.nan)
    return run.figures().values


def _of_record(samples: Any, names: Sequence[str]) -> dict[str, float]:
    if not samples or samples["t_s"].size < 2:
        return dict.fromkeys(names, math.nan)
    values = compute(samples).values
    return {name: values[name] for name in names}


def _early(runs: Sequence[RunRecord]) -> int:
    return sum(run.manifest.outcome != "complete" for run in runs)


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None
