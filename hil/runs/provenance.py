"""What made a run, for its record: every value, every text from outside, versions and revision."""

from __future__ import annotations

import pickle
import time
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING

from hil.config.robot import BUILT_IN_PLANT
from hil.control.references import notes
from hil.core.errors import BadInput
from hil.core.figures import metric_of
from hil.core.newest import of_newest
from hil.core.registries import ESTIMATORS, FIGURES, LOCALISERS, OUTER_LAWS, REFERENCES, VEHICLES
from hil.core.registry import BUILT_IN, Entry, SourceText
from hil.record.manifest import (
    FigureTerm,
    Manifest,
    Plugin,
    TraceTerm,
    collect_versions,
    git_revision,
)
from hil.record.schema import SAMPLE_NAMES, TRACE_KEYS
from hil.rigs.key_file import key_of_environment
from hil.rigs.opening import REPLAY

if TYPE_CHECKING:
    from hil.config.scenario import Scenario
    from hil.runs.spec import RunSpec

# Things in use, each with its kind.
Used = Sequence[tuple[str, Entry]]


def used_things(spec: RunSpec) -> list[tuple[str, Entry]]:
    """Return what the registries gave for a run, each with its kind; raises BadInput."""
    scenario = spec.scenario
    used = (
        (OUTER_LAWS, spec.outer),
        (ESTIMATORS, scenario.control.estimator),
        (LOCALISERS, scenario.camera.localiser),
        (REFERENCES, scenario.reference.kind),
        (VEHICLES, scenario.robot.vehicle.kind),
        *((FIGURES, name) for name in scenario.own_figures),
    )
    return [(registry.kind, registry.get(name)) for registry, name in used]


def make_manifest(spec: RunSpec, parameters: Mapping[str, float], used: Used) -> Manifest:
    """Return the manifest a record opens with; raises BadInput.

    `parameters` are the board's, `used` is what the registries gave (`used_things`).
    """
    law = OUTER_LAWS.get(spec.outer)
    gains = spec.scenario.control.active_gains.of(law)
    now_us = time.time_ns() // 1000
    # Of values that were validated each by itself: campaigns open some hundred a second.
    return Manifest.model_construct(
        command=spec.command,
        scenario=pickle.loads(_tree(spec.scenario)),
        seed=spec.seed,
        target=spec.target,
        camera=spec.camera,
        outer=law.name,
        inner=spec.inner,
        gains={
            "outer": gains.model_dump(mode="json") if gains is not None else {},
            "set": spec.scenario.control.gain_set,
            "board": dict(parameters),
        },
        plugins=_from_outside(spec, used),
        trace=trace_terms(law),
        figures=[FigureTerm.of(metric_of(name)) for name in spec.scenario.own_figures],
        signed=_is_signed(spec),
        open_loop_of=spec.target.removeprefix(REPLAY) if spec.target.startswith(REPLAY) else "",
        notes=list(_notes(spec.scenario)),
        versions=dict(collect_versions()),
        git_revision=git_revision(),
        start_time_utc=datetime.fromtimestamp(now_us * 1e-6, UTC).isoformat(timespec="seconds"),
        start_unix_us=now_us,
    )


_notes = of_newest(notes, by=lambda scenario: REFERENCES.get(scenario.reference.kind).factory)


@of_newest
def _tree(scenario: Scenario) -> bytes:
    """Return the scenario as a tree, packed: each record gets one of its own."""
    return pickle.dumps(scenario.model_dump(mode="json"))


def _is_signed(spec: RunSpec) -> bool:
    """Say whether the run's link is signed: by its own key, or on a port by that of the environment."""
    on_a_port = spec.target.startswith("serial:")
    return spec.key is not None or (on_a_port and key_of_environment() is not None)


def trace_terms(law: Entry) -> list[TraceTerm]:
    """Return the columns that a law adds with `trace=`, for a manifest; raises BadInput for a name taken."""
    taken = {*SAMPLE_NAMES, *TRACE_KEYS}
    for name in law.trace:
        if name in taken:
            raise BadInput(
                f"law {law.name} ({law.origin}): trace name {name!r} is that of a column that every "
                "record has; name it otherwise"
            )
    return [
        TraceTerm(name=name, unit=unit, meaning=meaning)
        for name, (unit, meaning) in law.trace.items()
    ]


def _from_outside(spec: RunSpec, used: Used) -> list[Plugin]:
    """Return what takes part that is not of the harness, the robot's motion included."""
    found = [Plugin.of(kind, entry) for kind, entry in used if entry.origin != BUILT_IN]
    where = spec.scenario.robot.plant
    if where != BUILT_IN_PLANT and spec.is_simulated:
        path = Path(where)
        text = None if where.startswith("tcp:") or not path.is_file() else path.read_text("utf-8")
        source = None if text is None else SourceText(path, text)
        found.append(Plugin.of("plant", Entry(where, type(None), "", origin=where, source=source)))
    return found
