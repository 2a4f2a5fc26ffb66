"""Reproduces chapters: rows, claims, sweeps, gathered for the report and the documents."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hil.core.errors import BadInput
from hil.study.chapters import chapter8
from hil.study.chapters.claims import ClaimResult, filled, judge
from hil.study.chapters.deck import Belief, Claim, Row, StudyDeck, load_deck, with_parameter
from hil.study.chapters.laws import OwnLaw
from hil.study.chapters.runs import Progress, RowResult, jobs_of, run_jobs
from hil.study.chapters.sweeps import Sensitivity, StartMap, sensitivity, start_map

CHAPTERS: Mapping[str, str] = {
    "4": "quadrotor",
    "5": "underwater-5dof",
    "6": "underwater-6dof",
    "7": "underwater-5dof",
}
"""Study of each chapter; 5 and 7 share theirs. Chapter 8 is the robot's own."""
Bars = Callable[[str], Progress]
"""Begins a progress bar of that name; the result is called with (done, total)."""


@dataclass(frozen=True, slots=True)
class Section:
    """One study with all that came out of it; `deck` is None for chapter 8."""

    title: str
    chapters: tuple[str, ...]
    deck: StudyDeck | None
    rows: tuple[RowResult, ...]
    claims: tuple[ClaimResult, ...]
    beliefs: tuple[tuple[str, str], ...]
    sensitivities: tuple[Sensitivity, ...] = ()
    start_map: StartMap | None = None

    @property
    def unexpected(self) -> list[str]:
        """Return one line for each row that misses its limit, or should and does not."""
        return [
            f"{row.name}: negative control holds"
            if row.kind == "negative control"
            else f"{row.name}: {row.end}, misses its limit"
            for row in self.rows
            if not row.as_wanted
        ]


def check_request(chapter: str | None, own: object | None) -> None:
    """Raise BadInput for a chapter that cannot be reproduced, or not with a law of one's own."""
    known = [*CHAPTERS, "8"]
    if chapter is not None and chapter not in known and not chapter.endswith(".toml"):
        raise BadInput(
            f"chapter {chapter!r} has no numerical study; choose {', '.join(known)} or give a "
            "study as a TOML file"
        )
    if own is not None and chapter == "8":
        raise BadInput("--law is for chapters 4 to 7; chapter 8 takes a law by `hil run --outer`")


def decks_of(chapter: str | None, overrides: Sequence[str]) -> list[StudyDeck]:
    """Return the studies asked for with PARAMETER=VALUE laid over them; raises BadInput."""
    if chapter == "8":
        names: list[str] = []
    elif chapter is None:
        names = list(dict.fromkeys(CHAPTERS.values()))
    else:
        names = [CHAPTERS.get(chapter, chapter)]
    if overrides and len(names) != 1:
        raise BadInput(f"--set {overrides[0]}: name one of the chapters {', '.join(CHAPTERS)}")
    decks = [load_deck(name) for name in names]
    for text in overrides:
        decks[0] = with_parameter(decks[0], text)
    return decks


def with_own_law(deck: StudyDeck, own: OwnLaw) -> StudyDeck:
    """Return the study with rows `L ...` for a law of the user's own, in all stages."""
    row = Row(
        row="L",
        kind="own law",
        label=f"own law, {own.path.name}",
        law=deck.default_law,
        choices=tuple(deck.choices),
    )
    return deck.model_copy(update={"rows": (*deck.rows, row)})


def reproduce_deck(
    deck: StudyDeck, bars: Bars, *, own: OwnLaw | None = None, sweeps: bool = True
) -> Section:
    """Run one study; `sweeps` adds the sensitivity to assumed values and the map of starts."""
    if own is not None:
        own.make(deck.plant)  # refuses before anything runs
        deck = with_own_law(deck, own)
    rows = run_jobs(jobs_of(deck), own, bars(deck.title))
    swept: list[Sensitivity] = []
    found: StartMap | None = None
    if sweeps:
        swept = sensitivity(deck, bars(f"{deck.title}: assumed values"))
        if deck.plant == "quadrotor":
            found = start_map(deck, bars(f"{deck.title}: starts"))
    return _section(
        deck.title, deck.chapters, deck, rows, deck.claims, deck.beliefs, tuple(swept), found
    )


def reproduce_chapter8(bars: Bars) -> Section:
    """Run section 8.9 and the three experiments."""
    title = "Wheeled robot: section 8.9 and the three experiments"
    rows = chapter8.rows(bars(title))
    return _section(title, ("8",), None, rows, chapter8.CLAIMS, (chapter8.BELIEF,), (), None)


def _section(
    title: str,
    chapters: tuple[str, ...],
    deck: StudyDeck | None,
    rows: Sequence[RowResult],
    claims: Sequence[Claim],
    beliefs: Sequence[Belief],
    sensitivities: tuple[Sensitivity, ...],
    found: StartMap | None,
) -> Section:
    told = tuple((belief.chapter, filled(belief.text, rows)) for belief in beliefs)
    judged = tuple(judge(claims, rows))
    return Section(title, chapters, deck, tuple(rows), judged, told, sensitivities, found)


def reproduce(
    chapter: str | None,
    bars: Bars,
    *,
    own: OwnLaw | None = None,
    overrides: Sequence[str] = (),
    sweeps: bool = True,
) -> list[Section]:
    """Return a section for each study of `chapter`, or of all chapters; raises BadInput."""
    check_request(chapter, own)
    decks = decks_of(chapter, overrides)
    sections = [reproduce_deck(deck, bars, own=own, sweeps=sweeps) for deck in decks]
    if chapter in {None, "8"}:
        sections.append(reproduce_chapter8(bars))
    return sections


def to_json(sections: Sequence[Section], command: str, report: Path) -> dict[str, Any]:
    """Return one JSON document for all sections."""
    return {
        "command": command,
        "report": str(report),
        "chapters": [chapter for section in sections for chapter in section.chapters],
        "rows": [
            {"chapters": list(section.chapters), **row.to_json()}
            for section in sections
            for row in section.rows
        ],
        "claims": [claim.to_json() for section in sections for claim in section.claims],
        "sensitivity": [item.to_json() for section in sections for item in section.sensitivities],
        "start_map": next((s.start_map.to_json() for s in sections if s.start_map), None),
        "unexpected": [line for section in sections for line in section.unexpected],
    }
