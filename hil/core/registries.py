"""The registries there are: what a lab can bring along, and where the built-in ones live.

A registry finds its built-in things by importing the modules of a package by name, so this room stays
below all of them.
"""

from __future__ import annotations

from hil.core.registry import Registry

OUTER_LAWS = Registry("outer law", "skid_steer_hil.outer_laws", "hil.control.laws")
ESTIMATORS = Registry("estimator", "skid_steer_hil.estimators", "hil.control.estimators")
REFERENCES = Registry("reference", "skid_steer_hil.references", "hil.control.references")
LOCALISERS = Registry("localiser", "skid_steer_hil.localisers", "vision.localisers")
VEHICLES = Registry("vehicle", "skid_steer_hil.vehicles", "hil.control.vehicles")

# As `hil list` names them.
BY_PLURAL = {
    "laws": OUTER_LAWS,
    "estimators": ESTIMATORS,
    "references": REFERENCES,
    "localisers": LOCALISERS,
    "vehicles": VEHICLES,
}
BY_KIND = {registry.kind: registry for registry in BY_PLURAL.values()}
