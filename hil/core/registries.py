"""The registries there are: what a lab can bring along, and where the built-in ones live.

A registry finds its built-in things by importing the modules of a package by name, so this room stays
below all of them.
"""

from __future__ import annotations

from collections.abc import Sequence

from hil.core.registry import Registry, SourceText

OUTER_LAWS = Registry(
    "outer law", "skid_steer_hil.outer_laws", "hil.control.laws", ("reset", "step")
)
ESTIMATORS = Registry(
    "estimator",
    "skid_steer_hil.estimators",
    "hil.control.estimators",
    ("on_wheels", "on_pose", "on_command", "estimate_at"),
)
REFERENCES = Registry("reference", "skid_steer_hil.references", "hil.control.references", ("at",))
LOCALISERS = Registry("localiser", "skid_steer_hil.localisers", "vision.localisers", ("locate",))
VEHICLES = Registry("vehicle", "skid_steer_hil.vehicles", "hil.control.vehicles")
TARGETS = Registry("target", "skid_steer_hil.targets", "hil.rigs.targets")
FIGURES = Registry("figure of merit", "skid_steer_hil.figures", "hil.analysis.metrics")
TUNING_COSTS = Registry("tuning cost", "skid_steer_hil.tuning_costs", "hil.analysis.costs")

# As `hil list` names them.
BY_PLURAL = {
    "laws": OUTER_LAWS,
    "estimators": ESTIMATORS,
    "references": REFERENCES,
    "localisers": LOCALISERS,
    "vehicles": VEHICLES,
    "targets": TARGETS,
    "figures": FIGURES,
    "costs": TUNING_COSTS,
}
BY_KIND = {registry.kind: registry for registry in BY_PLURAL.values()}

# The texts of all things from files, by kind: what another process needs to know the same things.
Sources = tuple[tuple[str, SourceText], ...]


def file_sources() -> Sources:
    """Return the text of every file that a thing known in this process came from."""
    found = {
        (kind, entry.source.path): (kind, entry.source)
        for kind, registry in BY_KIND.items()
        for entry in registry.entries()
        if entry.source is not None
    }
    return tuple(found.values())


def adopt_sources(sources: Sequence[tuple[str, SourceText]]) -> None:
    """Make known what the texts define; raises BadInput."""
    for kind, source in sources:
        BY_KIND[kind].adopt(source)


def source_digests(names: Sequence[str], registry: Registry = OUTER_LAWS) -> dict[str, str]:
    """Return the digest of the text of each thing (an outer law) among `names` that came from a file."""
    entries = [registry.get(name) for name in names]
    return {entry.name: entry.source.sha256 for entry in entries if entry.source is not None}


def law_colour(name: str) -> str:
    """Return the colour of an outer law as #rrggbb, "" for one that has none or is not known."""
    return next((entry.colour for entry in OUTER_LAWS.entries() if entry.name == name), "")
