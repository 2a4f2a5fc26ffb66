"""What a replay needs of a record, read as far as it is intact."""

from __future__ import annotations

import copy
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hil.config.gains import gains_model
from hil.config.load import build
from hil.config.scenario import Scenario
from hil.core.errors import BadInput
from hil.core.registries import BY_KIND, FIGURES
from hil.core.registry import SourceText
from hil.record import layout
from hil.record.manifest import Manifest, read_manifest
from hil.record.reader import altered_files, completed_frames, read_table
from hil.record.tape import Tape, read_tape
from hil.record.tlog import LoggedFrame, read_tlog

if TYPE_CHECKING:
    from hil.record.journal import Columns


@dataclass(frozen=True, slots=True)
class Source:
    """What a replay needs of a record, as far as it is intact; `problems` says what is not."""

    path: Path
    manifest: Manifest
    tape: Tape
    samples: Columns
    frames: Columns
    link: tuple[LoggedFrame, ...]
    problems: tuple[str, ...]

    @property
    def has_video(self) -> bool:
        """Say whether every frame was kept, so that the localiser can be replayed too."""
        return (self.path / layout.CAMERA).is_file()


def read_source(path: Path) -> Source:
    """Return what is intact of a record; raises BadInput when nothing can be replayed."""
    manifest = read_manifest(path)
    if not (path / layout.TAPE).is_file():
        raise BadInput(f"{path}: has no {layout.TAPE}: recorded without one, nothing to replay")
    problems = altered_files(path, manifest)
    if manifest.is_cut_off:
        problems.append("cut off in mid-run: the record was never closed")
    tape = read_tape(path / layout.TAPE)
    if not tape.entries:
        raise BadInput(f"{path}: {layout.TAPE} is empty: nothing to replay (an imported log?)")
    if tape.problem:
        problems.append(tape.problem)
    tables = []
    for finished, journal in (
        (layout.SAMPLES, layout.SAMPLES_JOURNAL),
        (layout.FRAMES, layout.FRAMES_JOURNAL),
    ):
        try:
            tables.append(read_table(path, finished, journal, required=True))
        except BadInput as error:
            problems.append(str(error))
            tables.append({})
    samples, frames = tables
    link = tuple(read_tlog(path / layout.LINK)) if (path / layout.LINK).is_file() else ()
    frames = completed_frames(frames)
    return Source(path, manifest, tape, samples, frames, link, tuple(problems))


def recorded_scenario(manifest: Manifest, where: Path) -> Scenario:
    """Return the scenario of a record; raises BadInput.

    Gains of laws that are not known here (they were files) are left out: only a replay needs them,
    and it has them loaded first. So are figures that are not known here, with what they require.
    """
    tree = copy.deepcopy(manifest.scenario)
    _leave_out_figures(tree)
    known = gains_model().model_fields
    for table in tree.get("control", {}).get("gains", {}).values():
        for key in [key for key in table if key not in known]:
            del table[key]
    return build(Scenario, tree, str(where / layout.MANIFEST))


def _leave_out_figures(tree: dict[str, Any]) -> None:
    """Take out of a scenario's tree what names a figure that is not known here, in place."""
    known = FIGURES.names()
    tree["figures"] = [name for name in tree.get("figures", []) if name in known]
    tree["requirements"] = [
        item for item in tree.get("requirements", []) if item["metric"] in known
    ]


def load_plugins(source: Source, *, recorded_code: bool = False) -> None:
    """Make the laws and other things from files known again, as they were when the record was made.

    The file must still stand where it was with the same text; with `recorded_code` the text in the
    record is run instead. A figure's file that is another by now is left aside: it judges a run and does
    not make it. Raises BadInput.
    """
    for plugin in source.manifest.plugins:
        registry = BY_KIND.get(plugin.kind)
        if registry is None or not plugin.file:
            continue
        kept = source.path / plugin.file
        if recorded_code:
            text = kept.read_text(encoding="utf-8")
            if SourceText(kept, text).sha256 != plugin.sha256:
                raise BadInput(f"{kept}: is not the text that ran (SHA-256 differs); not run")
            registry.load_text(SourceText(Path(plugin.origin), text), plugin.name)
            continue
        path = Path(plugin.origin)
        now = path.read_text(encoding="utf-8") if path.is_file() else None
        if now is None or SourceText(path, now).sha256 != plugin.sha256:
            if registry is FIGURES:
                continue
            what = "is gone" if now is None else "has changed since"
            raise BadInput(
                f"{plugin.kind} {plugin.name}: {path} {what}; the text that ran is {kept}: to run "
                "that one, --recorded-code"
            )
        registry.load_text(SourceText(path, now), plugin.name)
