"""Reads a run record: a finished one, or one that was cut off in mid-run."""

from __future__ import annotations

import contextlib
import copy
import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from hil.analysis import metrics, own_figures
from hil.analysis.pieces import row_count
from hil.analysis.sliding import LawFacts
from hil.core.errors import BadInput
from hil.core.figures import Metric
from hil.core.files import RECORD_BYTES, read_bounded
from hil.record import layout
from hil.record.journal import Columns, read_journal, read_parquet
from hil.record.manifest import FigureTerm, Manifest, file_entry, read_manifest
from hil.record.schema import ADDED_LATER, FRAME_NAMES
from hil.record.tick_rows import COVARIANCE


@dataclass(frozen=True, slots=True)
class Event:
    """Something that happened at `t_s`: arming, a stop, a fault, a text of the board."""

    t_s: float
    kind: str
    text: str


@dataclass(frozen=True, slots=True)
class Picture:
    """One camera image that was kept: host time of its arrival, and its JPEG file."""

    t_s: float
    path: Path


@dataclass(frozen=True, slots=True)
class RunRecord:
    """A run in memory: float64 columns by name, NaN where a value does not exist.

    `problems` says in one line each what is missing, cut off or altered; empty when all is well.
    """

    path: Path
    manifest: Manifest
    samples: Columns
    frames: Columns
    events: tuple[Event, ...] = ()
    pictures: tuple[Picture, ...] = ()
    problems: tuple[str, ...] = ()
    own: Mapping[str, float] = field(default_factory=dict)  # figures that the manifest declares
    _figures: list[metrics.Figures] = field(
        default_factory=list, init=False, repr=False, compare=False
    )

    @property
    def label(self) -> str:
        """Return the name of the run for people: the outer law, then the folder."""
        return f"{self.manifest.outer} ({self.path.name})"

    def link_stats(self) -> metrics.LinkStats:
        """Return the link counters kept in the manifest."""
        names = metrics.LinkStats.__dataclass_fields__
        known = {
            name: int(self.manifest.link[name]) for name in names if name in self.manifest.link
        }
        return metrics.LinkStats(**known)

    def law_facts(self) -> LawFacts:
        """Return what the figures of the sliding term need to know of the law that ran."""
        return LawFacts.of(self.manifest.gains, self.manifest.scenario)

    def diagnoses(self) -> list[str]:
        """Return what the run found wrong with the robot and did not stop for."""
        return [event.text for event in self.events if event.kind == "diagnosis"]

    def figures(self) -> metrics.Figures:
        """Return the figures: built-in ones from the samples, all NaN below two ticks; then own ones."""
        own = [term.metric for term in self.manifest.figures]
        return self._built_in().with_own(own, self.own)

    def _built_in(self) -> metrics.Figures:
        if not self._figures:
            self._figures.append(
                metrics.no_figures(self.samples)
                if row_count(self.samples) < 2
                else metrics.compute(self.samples, self.link_stats(), self.law_facts())
            )
        return self._figures[0]

    def data(self) -> metrics.RunData:
        """Return what a figure of merit is given of the run."""
        built_in = self._built_in()
        return metrics.RunData(
            columns=own_figures.ReadOnly(self.samples),
            scenario=copy.deepcopy(self.manifest.scenario),
            figures=dict(built_in.values),
            basis=built_in.basis,
            link=self.link_stats(),
            law=self.law_facts(),
        )

    def with_own_figures(self, more: Sequence[Metric] = ()) -> RunRecord:
        """Return the run with the figures computed that its manifest declares, and `more`.

        Where one has no value, a note in the manifest says why.
        """
        terms = {term.name: term for term in self.manifest.figures}
        terms |= {metric.name: FigureTerm.of(metric) for metric in more}
        if not terms or row_count(self.samples) < 2:
            return self
        anew = {metric.name for metric in more}
        asked = [t.metric for t in terms.values() if t.name not in self.own or t.name in anew]
        found = own_figures.compute_own(asked, self.data())
        notes = [*self.manifest.notes, *found.notes]
        manifest = self.manifest.model_copy(
            update={"figures": list(terms.values()), "notes": list(dict.fromkeys(notes))}
        )
        return replace(self, manifest=manifest, own={**self.own, **found.values})

    def verdicts(self) -> tuple[metrics.Verdict, ...]:
        """Return the verdict on each requirement of the scenario."""
        return metrics.check(self.figures(), self.manifest.scenario)

    def pictures_from_start(self) -> tuple[Picture, ...]:
        """Return the pictures from the last one before the first tick on (the robot at rest)."""
        before = sum(picture.t_s <= 0.0 for picture in self.pictures)
        return self.pictures[max(before - 1, 0) :]

    def moments(self) -> dict[str, Picture]:
        """Return the picture at the start, at half of the way travelled, and at the end."""
        pictures = self.pictures_from_start()
        if not pictures:
            return {}
        chosen = {"start": pictures[0]}
        who = "true" if metrics.has_truth(self.samples) else "est"
        x_m, y_m = self.samples[f"{who}_x_m"], self.samples[f"{who}_y_m"]
        steps_m = np.hypot(np.diff(x_m), np.diff(y_m))
        way_m = np.cumsum(np.nan_to_num(steps_m))
        if way_m.size and len(pictures) > 2:
            half_s = float(self.samples["t_s"][1:][np.searchsorted(way_m, way_m[-1] / 2)])
            between = pictures[1:-1]
            chosen["middle"] = min(between, key=lambda picture: abs(picture.t_s - half_s))
        return chosen | {"end": pictures[-1]}


def read_run(path: Path) -> RunRecord:
    """Return the run recorded in folder `path`; what is intact is used, the rest is in `problems`.

    Raises BadInput when the folder is not a run record, is of a newer schema, or has no readable
    samples.
    """
    manifest = read_manifest(path)
    problems: list[str] = []
    if manifest.is_cut_off:
        problems.append("cut off in mid-run: the record was never closed")
    problems += altered_files(path, manifest)
    samples = read_table(path, layout.SAMPLES, layout.SAMPLES_JOURNAL, required=True)
    rows = samples["t_s"].size if "t_s" in samples else 0
    if not set(ADDED_LATER) <= set(samples):
        samples = {name: np.full(rows, math.nan) for name in ADDED_LATER} | dict(samples)
    missing = [name for name in manifest.sample_names if name not in samples]
    if missing:
        raise BadInput(f"{path / layout.SAMPLES}: damaged: column {missing[0]} is missing")
    frames: Columns = {}
    try:
        frames = completed_frames(
            read_table(path, layout.FRAMES, layout.FRAMES_JOURNAL, required=False)
        )
    except BadInput as error:  # the samples are whole: what was seen is lost, the run is not
        problems.append(str(error))
    return RunRecord(
        path=path,
        manifest=manifest,
        samples=samples,
        frames=frames if set(FRAME_NAMES) <= set(frames) else {},
        events=read_events(path / layout.EVENTS),
        pictures=read_pictures(path / layout.PICTURES),
        problems=tuple(problems),
        own=_read_own(path / layout.FIGURES, manifest),
    )


def _read_own(path: Path, manifest: Manifest) -> dict[str, float]:
    """Return the values of the figures that the manifest declares, as they were when it was closed."""
    if not manifest.figures or not path.is_file():
        return {}
    try:
        kept = json.loads(read_bounded(path, RECORD_BYTES))["figures"]
        values = {term.name: kept[term.name]["value"] for term in manifest.figures}
        return {name: math.nan if value is None else float(value) for name, value in values.items()}
    except (OSError, ValueError, KeyError, TypeError):
        return {}  # its SHA-256 says so


def completed_frames(frames: Columns) -> Columns:
    """Return the frames with the covariance that records made before it was kept do not have."""
    rows = len(frames["t_cam_s"]) if "t_cam_s" in frames else 0
    missing = [name for name in COVARIANCE if name not in frames] if rows else []
    return {**frames, **{name: np.full(rows, np.nan) for name in missing}}


def altered_files(path: Path, manifest: Manifest) -> list[str]:
    """Return a line for each finished file that is missing or differs from its SHA-256."""
    found = []
    for name, entry in manifest.files.items():
        file = path / name
        if not file.is_file():
            found.append(f"{name} is missing")
        elif file.stat().st_size != entry.bytes:
            found.append(f"{name} has {file.stat().st_size} bytes, the manifest says {entry.bytes}")
        elif file_entry(file).sha256 != entry.sha256:
            found.append(f"{name} was altered after the run: SHA-256 differs from the manifest")
    return found


def read_table(path: Path, parquet: str, journal: str, *, required: bool) -> Columns:
    """Return a table from its Parquet file, or from the journal that a crash left.

    Raises BadInput where it is required and neither has a row.
    """
    if (path / parquet).is_file():
        return read_parquet(path / parquet)
    if (path / journal).is_file():
        columns = read_journal(path / journal)
        if columns or not required:
            return columns
        raise BadInput(f"{path / journal}: cut off before the first row")
    if required:
        raise BadInput(f"{path}: not a whole run record: neither {parquet} nor {journal} is there")
    return {}


def read_events(path: Path) -> tuple[Event, ...]:
    """Return the events of whole lines; a torn last line is left."""
    if not path.is_file():
        return ()
    events = []
    for line in path.read_text(encoding="utf-8", errors="replace").splitlines():
        try:
            tree = json.loads(line)
            events.append(Event(float(tree["t_s"]), str(tree["kind"]), str(tree["text"])))
        except (ValueError, KeyError, TypeError, OverflowError):
            break
    return tuple(events)


def picture_name(t_s: float) -> str:
    """Return the file name of the picture that arrived at `t_s`; no name begins with a dash."""
    return f"t{t_s:08.3f}s.jpg"


def read_pictures(folder: Path) -> tuple[Picture, ...]:
    """Return the pictures of a record in time order; older records name them without the t."""
    pictures = []
    for file in folder.glob("*s.jpg"):
        with contextlib.suppress(ValueError):  # somebody else's file
            pictures.append(Picture(float(file.stem.removeprefix("t").removesuffix("s")), file))
    return tuple(sorted(pictures, key=lambda picture: picture.t_s))
