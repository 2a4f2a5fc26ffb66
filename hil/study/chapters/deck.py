"""Studies as data: parameters with unit, source and origin, laws, rows, figures and claims in TOML."""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from hil.config.base import Section
from hil.config.load import build, read_tree
from hil.core.errors import BadInput
from hil.study.chapters.quantities import COLUMNS, FIGURES, PARAMETERS

STUDIES = ("quadrotor", "underwater-5dof", "underwater-6dof")
Positive = Annotated[float, Field(gt=0)]
Values = Annotated[tuple[float, ...], Field(min_length=1, max_length=6)]


class Parameter(Section):
    """One number of a study, with where it comes from."""

    value: float
    unit: str
    origin: Literal["printed", "repaired", "assumed"]
    source: str
    sweep: tuple[float, ...] = ()


class LawSpec(Section):
    """One law of hil.control with its gains; a list of one counts for every axis."""

    kind: Literal["state-feedback", "asg-ism", "sliding-mode", "utkin-ism"]
    kp: Values | None = None
    kd: Values | None = None
    ki: Values | None = None
    c: Values | None = None
    k: Values | None = None
    eps: tuple[Positive, ...] | None = None
    eps_min: tuple[Positive, ...] | None = None
    eps0: float | None = Field(None, ge=0)
    beta: float | None = Field(None, gt=0, lt=1)
    mu0_s: float | None = Field(None, gt=0)
    mu_min: float | None = Field(None, ge=0)
    sigma: float | None = Field(None, ge=0)
    componentwise: bool | None = None
    implicit: bool | None = None
    dominating: bool | None = None


class LawSet(Section):
    """The laws of all stages of one vehicle, under one name."""

    label: str
    position: LawSpec
    attitude: LawSpec | None = None
    sideways: LawSpec | None = None
    drive: LawSpec | None = None


class Row(Section):
    """One run (or the mean of one a seed): a law, what it changes, and what it must hold."""

    row: str
    kind: Literal["as printed", "repaired", "baseline", "extension", "negative control", "own law"]
    label: str
    law: str
    set: dict[str, float] = Field(default_factory=dict)
    gains: dict[str, float | bool] = Field(default_factory=dict)
    stage: str | None = None
    sign: float = 1.0
    choices: tuple[str, ...] = ()
    nearby_starts: int = Field(1, ge=1, le=64, description="starts 1e-12 m apart, for chaotic rows")
    limit_m: float | None = Field(None, gt=0)
    limit_integral_m_s: float | None = Field(None, gt=0)
    control_of: str | None = None


class FigureSpec(Section):
    """One figure of the chapter, redrawn: columns of the samples over time or over each other."""

    number: str
    rows: tuple[str, ...]
    title: str
    panels: tuple[str, ...] = Field(min_length=1, max_length=3)
    reference: bool = False
    log: bool = False
    until_s: float | None = Field(None, gt=0)


class Measure(Section):
    """A figure of one row, divided by that of another where `over` names one."""

    figure: str
    row: str
    over: str | None = None


class Claim(Section):
    """One sentence of the source, and the range in which our value counts as reproducing it.

    With `undecidable` a value outside the range decides nothing: the text says what is missing.
    """

    chapter: str
    claim: str
    where: str
    printed: str
    measure: Measure | None = None
    reproduced: tuple[float, float] = (0.0, 0.0)
    note: str = ""
    undecidable: str = Field("", description="what is not printed, where the claim hangs on it")


class Belief(Section):
    """What a reader should believe of a chapter; <<row figure>> stands for our value."""

    chapter: str
    text: str


class StudyDeck(Section):
    """One plant with all rows of the chapters it belongs to."""

    title: str
    plant: Literal["quadrotor", "vehicle5", "vehicle6"]
    chapters: tuple[str, ...]
    seeds: tuple[int, ...] = (1,)
    default_law: str
    sensitivity_rows: tuple[str, ...] = ()
    parameters: dict[str, Parameter]
    choices: dict[str, dict[str, float]] = Field(default_factory=dict)
    laws: dict[str, LawSet]
    rows: tuple[Row, ...]
    figures: tuple[FigureSpec, ...] = ()
    claims: tuple[Claim, ...] = ()
    beliefs: tuple[Belief, ...] = ()

    @model_validator(mode="after")
    def _names_exist(self) -> StudyDeck:
        missing = sorted(set(PARAMETERS[self.plant]) - set(self.parameters))
        if missing:
            raise ValueError(f"parameter {missing[0]} of the plant is missing; give a value")
        for name in self.parameters:
            _known(name, PARAMETERS[self.plant], "parameter")
        for figure in self.figures:
            for name in " over ".join(figure.panels).split(" over "):
                _known(name, COLUMNS[self.plant], f"figure {figure.number}: column")
        for claim in self.claims:
            _known(
                claim.measure.figure if claim.measure else "ise_m2_s", FIGURES, "figure of a row"
            )
        for row in self.rows:
            _known(row.law, self.laws, f"row {row.row}: law")
            for key in row.set:
                _known(key, self.parameters, f"row {row.row}: parameter")
            for choice in row.choices:
                _known(choice, self.choices, f"row {row.row}: choice")
        for choice, values in self.choices.items():
            for key in values:
                _known(key, self.parameters, f"choice {choice}: parameter")
        _known(self.default_law, self.laws, "default_law")
        names = self.row_names
        if len(set(names)) != len(names):
            twice = sorted({name for name in names if names.count(name) > 1})
            raise ValueError(f"row {twice[0]!r} is there twice")
        for place, wanted in self._references():
            _known(wanted, names, place)
        return self

    def _references(self) -> list[tuple[str, str]]:
        found = [("sensitivity_rows", name) for name in self.sensitivity_rows]
        found += [
            (f"row {row.row}: control_of", row.control_of) for row in self.rows if row.control_of
        ]
        for figure in self.figures:
            found += [(f"figure {figure.number}", name) for name in figure.rows]
        for claim in self.claims:
            if claim.measure:
                names = (claim.measure.row, claim.measure.over)
                found += [(f"claim {claim.claim!r}", name) for name in names if name]
        return found

    @property
    def row_names(self) -> list[str]:
        """Return the names of all rows, one for each choice."""
        return [name for row in self.rows for name, _ in spread(row)]


def spread(row: Row) -> list[tuple[str, str | None]]:
    """Return (name, choice) of each run of a row: `Q4 circle`, or `Q1` without a choice."""
    return [(f"{row.row} {choice}", choice) for choice in row.choices] or [(row.row, None)]


def _known(name: str, known: Any, what: str) -> None:
    if name not in known:
        raise ValueError(f"{what} {name!r} is unknown; there are {', '.join(sorted(known))}")


def load_deck(name_or_path: str) -> StudyDeck:
    """Return a study that ships with the package, or one from a TOML file; raises BadInput."""
    return build(StudyDeck, read_tree(name_or_path, "chapters"), name_or_path)


def with_parameter(deck: StudyDeck, assignment: str) -> StudyDeck:
    """Return the study with KEY=VALUE laid over its parameters; raises BadInput."""
    key, equals, text = assignment.partition("=")
    if not equals or key not in deck.parameters:
        near = ", ".join(sorted(deck.parameters))
        raise BadInput(f"--set {assignment}: give PARAMETER=VALUE with one of {near}")
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise BadInput(f"--set {assignment}: {text!r} is no finite number")
    old = deck.parameters[key]
    new = old.model_copy(update={"value": value, "source": f"command line; was {old.value:g}"})
    return deck.model_copy(update={"parameters": deck.parameters | {key: new}})
