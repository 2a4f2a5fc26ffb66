"""Short runs of the whole loop for the tests of this folder."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from hil.config.load import load_scenario, merge
from hil.config.scenario import Scenario
from hil.record.reader import RunRecord
from hil.runs.execute import RunSpec, execute


def scenario_with(
    name: str, overrides: Sequence[str] = (), extra: Mapping[str, Any] | None = None
) -> Scenario:
    """Return a built-in scenario with --set overrides and further tables laid over it."""
    scenario = load_scenario(name, overrides)
    if extra is None:
        return scenario
    return Scenario.model_validate(merge(scenario.model_dump(mode="json"), dict(extra)))


def run(
    scenario: Scenario,
    out: Path,
    *,
    outer: str = "asg-ism",
    inner: str = "asg-ism",
    camera: str = "pose",
    seed: int = 1,
) -> RunRecord:
    """Run a scenario on the twin and return its record."""
    return execute(
        RunSpec(
            scenario=scenario,
            target="twin",
            camera=camera,
            outer=outer,
            inner=inner,
            seed=seed,
            out=out,
            rerun=False,
            command="test",
        )
    )
