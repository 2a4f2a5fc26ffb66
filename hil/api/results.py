"""What the functions of the API return: a run, a comparison, an experiment, each with its report."""

from __future__ import annotations

import html
import importlib
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hil.analysis.own_figures import ReadOnly
from hil.core.errors import BadInput
from hil.record.journal import arrow_table
from hil.record.reader import RunRecord
from hil.record.schema import FRAME_COLUMNS, SAMPLE_COLUMNS

if TYPE_CHECKING:
    import numpy as np
    import pyarrow as pa
    from numpy.typing import NDArray

    from hil.analysis.metrics import Verdict
    from hil.record.manifest import Manifest
    from hil.record.reader import Event
    from hil.study.experiment import Study

AnyPath = str | os.PathLike[str]

__all__ = ["AnyPath", "Comparison", "Experiment", "Run", "study_of"]


@dataclass(frozen=True, slots=True)
class Run:
    """One recorded run. A notebook shows its report.

    Columns and their units are those of docs/run-record.md: SI units and radians, world frame.
    """

    record: RunRecord

    @property
    def path(self) -> Path | None:
        """Return the record's folder, None for a run that was kept in memory."""
        return None if self.record.path == Path() else self.record.path

    @property
    def manifest(self) -> Manifest:
        """Return what made the run: scenario, law, gains, seed, versions, outcome."""
        return self.record.manifest

    @property
    def outcome(self) -> str:
        """Return "complete", "fault", "interrupted", or "running" for a record that was cut off."""
        return self.record.manifest.outcome

    @property
    def detail(self) -> str:
        """Return the cause of an end before time, "" without one."""
        return self.record.manifest.outcome_detail

    @property
    def samples(self) -> Mapping[str, NDArray[np.float64]]:
        """Return the columns of the outer ticks by name, NaN where a value does not exist.

        A record stays as it was: work on a copy (`run.samples["est_x_m"] * 1e3` is one).
        """
        return _read_only(self.record.samples)

    @property
    def frames(self) -> Mapping[str, NDArray[np.float64]]:
        """Return the columns of the camera frames by name, as `samples` does the ticks."""
        return _read_only(self.record.frames)

    @property
    def events(self) -> tuple[Event, ...]:
        """Return what happened, with time (s), kind and text."""
        return self.record.events

    @property
    def figures(self) -> dict[str, float]:
        """Return every figure by name (docs/run-record.md), NaN where there is none."""
        return self.record.figures().values

    @property
    def requirements(self) -> tuple[Verdict, ...]:
        """Return the verdict on each requirement of the scenario."""
        return self.record.verdicts()

    @property
    def holds(self) -> bool:
        """Say whether the run came to its end and met every requirement."""
        return self.outcome == "complete" and all(item.holds for item in self.requirements)

    @property
    def problems(self) -> tuple[str, ...]:
        """Return a line for everything that is missing, cut off or altered in the record."""
        return self.record.problems

    def table(self) -> pa.Table:
        """Return the ticks as an Arrow table, null where a value does not exist.

        Each field's metadata has `unit`, `group` and `meaning`.
        """
        return _table(self.record.samples, SAMPLE_COLUMNS)

    def frames_table(self) -> pa.Table:
        """Return the camera frames as an Arrow table, as `table` does the ticks."""
        return _table(self.record.frames, FRAME_COLUMNS)

    def to_pandas(self) -> Any:
        """Return the ticks as a pandas DataFrame; raises BadInput where pandas is not installed."""
        return _to_pandas(self.table())

    def report(self, file: AnyPath) -> Path:
        """Write the HTML report of this run; return its path. Raises BadInput."""
        return _write(file, [self])

    def _repr_html_(self) -> str:
        return _inline([study_of([self])])

    def __repr__(self) -> str:
        manifest = self.manifest
        verdict = "holds" if self.holds else "does not hold"
        return (
            f"<Run {manifest.scenario_name} on {manifest.target}, {manifest.outer} over "
            f"{manifest.inner}, seed {manifest.seed}: {self.outcome}, {verdict}>"
        )


@dataclass(frozen=True, slots=True)
class Comparison:
    """Runs of one scenario side by side. A notebook shows the report."""

    runs: tuple[Run, ...]
    study: Study

    @property
    def holds(self) -> bool:
        """Say whether every run came to its end and met every requirement."""
        return all(run.holds for run in self.runs)

    def to_json(self) -> dict[str, Any]:
        """Return what `hil compare --json` prints."""
        return self.study.to_json()

    def report(self, file: AnyPath) -> Path:
        """Write the HTML report; return its path. Raises BadInput."""
        return _write(file, self.runs)

    def _repr_html_(self) -> str:
        return _inline([self.study])


@dataclass(frozen=True, slots=True)
class Experiment:
    """Every run of a deck, in the order of scenarios and laws, and the report of all."""

    path: Path
    runs: tuple[Run, ...]
    studies: tuple[Study, ...]

    @property
    def report_path(self) -> Path:
        """Return the HTML report that was written."""
        return self.path / "report.html"

    @property
    def holds(self) -> bool:
        """Say whether every run came to its end and met every requirement."""
        return all(run.holds for run in self.runs)

    def _repr_html_(self) -> str:
        return _frame(self.report_path.read_text(encoding="utf-8"))


def study_of(runs: Sequence[Run], least: int = 1) -> Study:
    """Return the study of `least` or more runs of one scenario; BadInput when their tasks differ."""
    from hil.study.experiment import study  # noqa: PLC0415 - loads the rigs

    return study([run.record for run in runs], least)


def _write(file: AnyPath, runs: Sequence[Run]) -> Path:
    from hil.report.html import write_report  # noqa: PLC0415 - loads the figures

    found = study_of(runs)
    repeats = [found.repeats] if found.repeats else []
    write_report(Path(file), [found.comparison], command="hil", repeats=repeats)
    return Path(file)


def _inline(studies: Sequence[Study]) -> str:
    from hil.report.html import render  # noqa: PLC0415 - loads the figures

    repeats = [item.repeats for item in studies if item.repeats]
    page = render([item.comparison for item in studies], command="hil", repeats=repeats)
    return _frame(page)


def _frame(page: str) -> str:
    """Return a page as a frame of its own, so that its styles and the notebook's stay apart."""
    return (
        f'<iframe srcdoc="{html.escape(page)}" title="report" loading="lazy" '
        'style="width:100%;height:40em;border:1px solid #ccc"></iframe>'
    )


def _read_only(columns: Mapping[str, NDArray[np.float64]]) -> Mapping[str, NDArray[np.float64]]:
    """Return columns that cannot be written to; those of a long run are read when asked for."""
    kept = ReadOnly(columns)
    return dict(kept) if isinstance(columns, dict) else kept


def _table(columns: Mapping[str, NDArray[np.float64]], schema: Sequence[Any]) -> pa.Table:
    return arrow_table(dict(columns), [column for column in schema if column.name in columns])


def _to_pandas(table: pa.Table) -> Any:
    try:
        importlib.import_module("pandas")
    except ModuleNotFoundError:
        raise BadInput("to_pandas: pandas is not installed; pip install pandas") from None
    return table.to_pandas()
