"""`manifest.json`: what made a run, so that the record is evidence by itself."""

from __future__ import annotations

import functools
import hashlib
import json
import platform
import subprocess
import sys
from collections.abc import Mapping, Sequence
from contextlib import suppress
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any, Literal

from pydantic import (
    BaseModel,
    ConfigDict,
    Field,
    FiniteFloat,
    PrivateAttr,
    ValidationError,
    field_validator,
)

from hil.core.errors import BadInput
from hil.core.figures import Better, Metric
from hil.core.files import RECORD_BYTES, alone_in, is_left, read_bounded, replace_file
from hil.core.registry import Entry
from hil.record import layout
from hil.record.schema import SAMPLE_COLUMNS, SCHEMA_VERSION, Column

# How a record ends whose process was killed: said by the first command that opens it.
WRITER_GONE = "the process that wrote it is gone"
Outcome = Literal["running", "complete", "interrupted", "fault"]
_PACKAGES = ("skid-steer-hil", "numpy", "opencv-python-headless", "pymavlink", "pyarrow", "scipy")


class FileEntry(BaseModel):
    """One finished file of the record."""

    model_config = ConfigDict(frozen=True)

    bytes: int
    sha256: str


class Plugin(BaseModel):
    """A thing from outside the harness that took part in a run: a file's text is kept in the record."""

    model_config = ConfigDict(frozen=True)

    kind: str
    name: str
    origin: str = Field(description="the package, or the file's path when it ran")
    sha256: str = Field("", description="of the file's text; empty for a package")
    file: str = Field("", description="the text, inside the record's folder")
    label: str = Field("", description="of a law, in reports")
    colour: str = Field("", description="of a law, in reports")
    _text: str = PrivateAttr("")

    @classmethod
    def of(cls, kind: str, entry: Entry) -> Plugin:
        """Return what the record says of a registry's entry."""
        look = {"label": entry.label, "colour": entry.colour}
        if entry.source is None:
            return cls(kind=kind, name=entry.name, origin=entry.origin, **look)
        file = f"{layout.PLUGINS}/{kind.replace(' ', '_')}-{entry.source.path.name}"
        plugin = cls(
            kind=kind, name=entry.name, origin=entry.origin, sha256=entry.source.sha256, file=file,
            **look,
        )  # fmt: skip
        plugin._text = entry.source.text
        return plugin

    @property
    def text(self) -> str:
        """Return the text that ran; empty for a package, and for a plug-in read from a manifest."""
        return self._text


class TraceTerm(BaseModel):
    """A column of samples.parquet that the law itself brought along."""

    model_config = ConfigDict(frozen=True)

    name: str
    unit: str
    meaning: str


class FigureTerm(BaseModel):
    """A figure of merit beside the built-in ones: what metrics.json has of it is declared here."""

    model_config = ConfigDict(frozen=True)

    name: str
    unit: str
    label: str
    meaning: str
    better: Better

    @classmethod
    def of(cls, metric: Metric) -> FigureTerm:
        """Return what the record says of a figure."""
        return cls(
            name=metric.name, unit=metric.unit, label=metric.label,
            meaning=metric.definition, better=metric.better,
        )  # fmt: skip

    @property
    def metric(self) -> Metric:
        """Return the figure's declaration."""
        return Metric(self.name, self.unit, self.label, self.meaning, self.better)


class Manifest(BaseModel):
    """Everything that decides a run's result, and how the run ended.

    Unknown keys are kept: a later version may add some without a new schema version.
    """

    model_config = ConfigDict(frozen=True, extra="allow")

    schema_version: int = SCHEMA_VERSION
    outcome: Outcome = "running"
    outcome_detail: str = ""
    command: str = Field("", description="the command line that made the run")
    scenario: dict[str, Any] = Field(description="the scenario with every resolved value")
    seed: int
    target: str
    camera: str = Field(description="rendered, pose, a camera index or a file")
    outer: str
    inner: str
    gains: dict[str, Any] = Field(default_factory=dict, description="gains of the laws in use")
    plugins: list[Plugin] = Field(default_factory=list, description="what ran from outside")
    trace: list[TraceTerm] = Field(
        default_factory=list, description="the law's own columns, after those of every record"
    )
    figures: list[FigureTerm] = Field(
        default_factory=list, description="figures of merit beside the built-in ones"
    )
    versions: dict[str, str] = Field(default_factory=dict)
    git_revision: str = ""
    dialect_hash: str = ""
    parameter_hash: str = ""
    firmware_build_id: str = ""
    signed: bool = Field(
        False, description="frames were checked with a signing key before they were recorded"
    )
    open_loop_of: str = Field(
        "", description="the record that answered in place of a robot: the path is not this law's"
    )
    notes: list[str] = Field(
        default_factory=list, description="what a reader must know before trusting the figures"
    )
    start_time_utc: str = ""
    start_unix_us: int = Field(
        0, description="wall time of t_s = 0, in link.tlog too; until control begins, of opening"
    )
    tick_count: int = 0
    link: dict[str, FiniteFloat] = Field(
        default_factory=dict, description="counters of the host link"
    )
    files: dict[str, FileEntry] = Field(default_factory=dict)

    @field_validator("scenario")
    @classmethod
    def _can_be_judged(cls, tree: dict[str, Any]) -> dict[str, Any]:
        """Refuse what no scenario has, as a file edited by hand may: the rest is read as it is."""
        if not isinstance(tree.get("duration_s", 0.0), int | float):
            raise ValueError(f"duration_s = {tree['duration_s']!r} is no number of seconds")
        listed = tree.get("requirements", [])
        if not isinstance(listed, list | tuple) or not all(
            _is_requirement(item) for item in listed
        ):
            raise ValueError(
                "requirements is no list of tables with metric, and min or max in numbers"
            )
        return tree

    @property
    def is_cut_off(self) -> bool:
        """True of a record that is not closed: it is being written, or who wrote it was killed."""
        return self.outcome == "running" or self.outcome_detail == WRITER_GONE

    @property
    def scenario_name(self) -> str:
        """Return the scenario's own name."""
        return str(self.scenario.get("name", ""))

    @property
    def sample_columns(self) -> tuple[Column, ...]:
        """Return the columns of samples.parquet: those of every record, then the law's own."""
        own = (Column(t.name, t.unit, "law", t.meaning, trace_key=t.name) for t in self.trace)
        return (*SAMPLE_COLUMNS, *own)

    @property
    def sample_names(self) -> tuple[str, ...]:
        """Return the names of `sample_columns`."""
        return tuple(column.name for column in self.sample_columns)


def _is_requirement(item: object) -> bool:
    if not isinstance(item, Mapping) or not isinstance(item.get("metric"), str):
        return False
    return all(isinstance(item.get(key), int | float | None) for key in ("min", "max"))


def write_manifest(folder: Path, manifest: Manifest, *, durable: bool = False) -> None:
    """Write the manifest atomically: a reader sees the old one or the new one, whole."""
    text = manifest.model_dump_json(indent=1)
    replace_file(folder / layout.MANIFEST, text.encode() + b"\n", durable=durable)


def keep_texts(folder: Path, plugins: Sequence[Plugin]) -> None:
    """Write the text of every file that takes part into the record's folder; raises OSError."""
    for plugin in plugins:
        if plugin.file:
            path = folder / plugin.file
            path.parent.mkdir(exist_ok=True)
            path.write_text(plugin.text, encoding="utf-8")


def read_manifest(folder: Path) -> Manifest:
    """Return a record's manifest; raises BadInput when the folder is not a readable run record."""
    path = folder / layout.MANIFEST
    if not folder.is_dir():
        raise BadInput(f"{folder}: no such folder; give the folder of a run record")
    if not path.is_file():
        raise BadInput(f"{folder}: not a run record ({layout.MANIFEST} is missing)")
    try:
        tree = json.loads(read_bounded(path, RECORD_BYTES))
    except (OSError, ValueError, RecursionError) as error:
        raise BadInput(f"{path}: damaged, not readable as JSON: {error}") from None
    found = tree.get("schema_version") if isinstance(tree, Mapping) else None
    if not isinstance(found, int):
        raise BadInput(f"{path}: not the manifest of a run record (schema_version is missing)")
    if found > SCHEMA_VERSION:
        raise BadInput(
            f"{path}: schema_version = {found}, this program reads up to {SCHEMA_VERSION}; "
            "update skid-steer-hil"
        )
    try:
        manifest = Manifest.model_validate(tree)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        key = ".".join(str(part) for part in first["loc"])
        raise BadInput(f"{path}: damaged: {key}: {first['msg'].lower()}") from None
    return _ended(folder, manifest) if manifest.outcome == "running" else manifest


def _ended(folder: Path, manifest: Manifest) -> Manifest:
    """Say in a record that the process which wrote it has gone, unless it is at work, or has said its end.

    Of several who find it out at once one writes it, and all read the same. A folder that cannot be written
    to stays as it is.
    """
    reserve = folder / layout.RESERVE
    if not is_left(reserve) and reserve.exists():  # it is held: in this order
        return manifest
    ended = manifest.model_copy(update={"outcome": "fault", "outcome_detail": WRITER_GONE})
    with suppress(OSError, ValueError), alone_in(folder):
        now = Manifest.model_validate_json(read_bounded(folder / layout.MANIFEST, RECORD_BYTES))
        if now.outcome != "running" or not is_left(reserve):
            return now
        write_manifest(folder, ended, durable=True)
        reserve.unlink(missing_ok=True)
    return ended


def file_entry(path: Path) -> FileEntry:
    """Return size and SHA-256 of a file."""
    with path.open("rb") as file:
        digest = hashlib.file_digest(file, "sha256").hexdigest()
    return FileEntry(bytes=path.stat().st_size, sha256=digest)


@functools.cache
def collect_versions() -> dict[str, str]:
    """Return the versions of the interpreter and of the packages that decide a run's numbers."""
    found = {"python": platform.python_version(), "platform": platform.platform(terse=True)}
    for package in _PACKAGES:
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            found[package] = "not installed as a package"
    return found


@functools.cache
def git_revision() -> str:
    """Return the commit of the source tree, "+changes" when edited; "" outside a checkout."""
    root = Path(__file__).resolve().parents[2]
    if not (root / ".git").exists():
        return ""
    command = ["git", "-C", str(root), "describe", "--always", "--abbrev=40", "--dirty=+changes"]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=5, check=True)
    except (OSError, subprocess.SubprocessError):
        return ""
    return done.stdout.strip()


def command_line() -> str:
    """Return the command that started this process, as a person would type it."""
    program = Path(sys.argv[0]).name
    words = ["hil" if program == "__main__.py" else program, *sys.argv[1:]]
    return " ".join(f"'{word}'" if " " in word else word for word in words)
