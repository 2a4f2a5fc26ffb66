"""Replays of a run record through the host's own session: exact, and as a shadow.

Exact: nothing is changed, and every channel must come out as recorded, bit for bit.
Shadow: another law, other gains or other assumptions see each recorded state and say what they
would command there. The recorded command stays in force, so the robot's path does not follow from
the shadow: it is open loop, and no figure of merit of the other law.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from hil.config.fit import board_parameters
from hil.config.load import with_overrides
from hil.config.scenario import Scenario
from hil.control.laws.making import law_and_gains
from hil.core.errors import BadInput, RigFault
from hil.core.registries import OUTER_LAWS
from hil.core.types import Estimate, OuterCommand, OuterLaw, ReferenceState
from hil.record import layout
from hil.record.memory import MemoryRecorder
from hil.record.schema import ADDED_LATER, FRAME_NAMES, SAMPLE_COLUMNS, SAMPLE_NAMES, Column
from hil.record.source import Source, load_plugins, read_source, recorded_scenario
from hil.record.tlog import LoggedFrame
from hil.replays.divergence import Channel, compare_columns, compare_link
from hil.rigs.replay import HAPPENED, open_replay
from hil.runs.assembly import make_parts
from hil.runs.orders import OrderSource, ordered
from hil.runs.parts import Ending, closed
from hil.runs.provenance import trace_terms
from hil.runs.session import Session
from hil.runs.spec import RunSpec
from hil.wire.identity import board_hashes

if TYPE_CHECKING:
    from collections.abc import Callable

    from hil.record.journal import Columns

Kind = Literal["exact", "shadow"]
COMMANDS = ("eta1_cmd_m_s", "theta_dot_cmd_rad_s", "omega_cmd_left_rad_s", "omega_cmd_right_rad_s")
# Taken over from the record to complete the rows, not computed again.
_GIVEN = tuple(name for name in SAMPLE_NAMES if name.startswith("true_"))
_FRAME_CHECKS = tuple(name for name in FRAME_NAMES if name not in {"t_cam_s", "index"})


@dataclass(frozen=True, slots=True)
class ReplayReport:
    """What came out. `seen_by` names what the localiser's part was done with.

    `samples` are the replayed rows; of a shadow, with the commands it would have given.
    """

    path: Path
    kind: Kind
    law: str
    changes: tuple[str, ...]
    seen_by: str
    ticks_recorded: int
    ticks_replayed: int
    ending: Ending
    cut_off: bool
    channels: tuple[Channel, ...]
    problems: tuple[str, ...]
    samples: Columns
    columns: tuple[Column, ...] = SAMPLE_COLUMNS

    @property
    def identical(self) -> bool:
        """Say whether every channel agrees to the last bit and every recorded tick was reached."""
        reached = self.cut_off or self.ticks_replayed == self.ticks_recorded
        return reached and all(channel.same for channel in self.channels)

    @property
    def first(self) -> Channel | None:
        """Return the channel that differs first in time, a command before what follows from it."""
        different = [channel for channel in self.channels if not channel.same]
        rank = {name: place for place, name in enumerate(COMMANDS)}
        return min(different, key=lambda c: (c.first_s, rank.get(c.name, len(rank))), default=None)

    def to_json(self) -> dict[str, Any]:
        """Return the report as one JSON document."""
        first = self.first
        return {
            "record": str(self.path),
            "kind": self.kind,
            "law": self.law,
            "changes": list(self.changes),
            "identical": self.identical,
            "seen_by": self.seen_by,
            "ticks_recorded": self.ticks_recorded,
            "ticks_replayed": self.ticks_replayed,
            "ending": {"outcome": self.ending.outcome, "detail": self.ending.detail},
            "record_cut_off": self.cut_off,
            "first_divergence": first.to_json() if first else None,
            "channels": [channel.to_json() for channel in self.channels],
            "problems": list(self.problems),
        }


def replay(
    path: Path,
    outer: str | None = None,
    overrides: Sequence[str] = (),
    progress: Callable[[float], None] | None = None,
    *,
    recorded_code: bool = False,
) -> ReplayReport:
    """Replay a record; with another law or changed values, as a shadow of it.

    A law that came from a file is run as its file stands, which must be as it was; with
    `recorded_code` the text kept in the record is run. Raises BadInput when the folder is no record,
    has nothing to replay, a file has changed, or a change makes no sense.
    """
    source = read_source(path)
    load_plugins(source, recorded_code=recorded_code)
    law = OUTER_LAWS.get(outer).name if outer else source.manifest.outer
    recorded = recorded_scenario(source.manifest, path)
    scenario = _changed(recorded, overrides)
    kind: Kind = "shadow" if overrides or law != source.manifest.outer else "exact"
    spec = RunSpec(
        scenario, source.manifest.target, source.manifest.camera, law, source.manifest.inner,
        source.manifest.seed, path,
    )  # fmt: skip
    # A shadow's rows have the columns of its own law.
    terms = trace_terms(OUTER_LAWS.get(law))
    recorder = MemoryRecorder(source.manifest.model_copy(update={"trace": terms}), keep_link=True)
    rig = open_replay(source, recorded)
    # A shadow shows what the gains it was given would command: those ordered in the record are not its own.
    orders = OrderSource(rig.take_orders, rig.was_held)
    law_run, live = law_and_gains(law, scenario, live=kind == "exact")
    parts = make_parts(spec, rig, recorder, law_run)
    parts = ordered(parts, orders, scenario.safety, live)
    shadow = Shadow(parts.law, source.samples) if kind == "shadow" else None
    parts = replace(parts, law=shadow or parts.law)
    # The board's parameters are in the record whatever is changed here.
    parameters = board_parameters(recorded, source.manifest.inner)
    try:
        ending = Session(scenario, parts, parameters, board_hashes, progress).run()
    except RigFault as fault:  # the record ended after the session's own handling of faults
        ending = Ending("fault", str(fault))
    record = closed(recorder, ending, None)
    samples = record.samples
    if not samples["t_s"].size:
        _refuse_without_ticks(source)
    if shadow is not None:
        samples = {**samples, **shadow.columns(parts.vehicle.wheels, samples["t_s"].size)}
    stamps = _stamps(source, samples, recorder.link_frames)
    return ReplayReport(
        path=path,
        kind=kind,
        law=law,
        changes=tuple(overrides),
        seen_by=f"frames of {layout.CAMERA}" if source.has_video else "recorded poses",
        ticks_recorded=source.samples["t_s"].size if source.samples else 0,
        ticks_replayed=samples["t_s"].size,
        ending=ending,
        cut_off=source.manifest.is_cut_off or rig.ended,
        channels=tuple(_channels(source, samples, record.frames, stamps)),
        problems=source.problems,
        samples=samples,
        columns=recorder.manifest.sample_columns,
    )


def _refuse_without_ticks(source: Source) -> None:
    """Raise BadInput when the run ended before its first tick: there is nothing to reproduce."""
    if not source.samples or not source.samples["t_s"].size:
        why = source.manifest.outcome_detail or source.manifest.outcome
        raise BadInput(
            f"{source.path}: has no tick: the run ended before its first one ({why}); nothing to "
            "replay"
        )


def _stamps(
    source: Source, samples: Columns, frames: Sequence[tuple[float, bytes]]
) -> list[LoggedFrame]:
    """Return the replay's frames on the link, dated as those of the record.

    A replay that ends before the first tick (the camera's frames are lost) still counts from its
    opening, the record from its first tick, in whole microseconds: there the first frame on the link
    is the common instant, and one microsecond is rounding.
    """
    zero_us = source.manifest.start_unix_us
    before_first_tick = not samples["t_s"].size and frames and source.link
    if before_first_tick:
        zero_us = source.link[0].unix_us - round(frames[0][0] * 1e6)
    found = [LoggedFrame(zero_us + round(t_s * 1e6), frame) for t_s, frame in frames]
    if not before_first_tick:
        return found
    return [
        there._replace(frame=here.frame) if abs(here.unix_us - there.unix_us) <= 1 else here
        for here, there in zip(found, source.link, strict=False)
    ]


def _changed(recorded: Scenario, overrides: Sequence[str]) -> Scenario:
    """Return the scenario of a shadow; what the record alone decides cannot be changed."""
    changed = with_overrides(recorded, overrides)
    for key in HAPPENED:
        if getattr(changed, key) != getattr(recorded, key):
            raise BadInput(f"--set {key}: happened in the record and cannot be changed in a replay")
    if changed.control.rate_hz != recorded.control.rate_hz:
        raise BadInput("--set control.rate_hz: a replay has the ticks of the record")
    return changed


def _channels(
    source: Source, samples: Columns, frames: Columns, link: Sequence[LoggedFrame]
) -> list[Channel]:
    """Compare all that was computed again with what the record has of it."""
    found: list[Channel] = []
    if source.samples:
        there = [name for name in SAMPLE_NAMES if name in source.samples or name not in ADDED_LATER]
        names = [name for name in there if name not in _GIVEN]
        names += [term.name for term in source.manifest.trace if term.name in samples]
        found += compare_columns(source.samples, samples, names, source.samples["t_s"])
    if source.frames:
        dated = source.frames["t_arrival_s"]
        found += [
            replace(channel, name=f"frame {channel.name}")
            for channel in compare_columns(source.frames, frames, _FRAME_CHECKS, dated)
        ]
    return found + compare_link(source.link, link, source.manifest.start_unix_us)


class Shadow:
    """Steps a law on each recorded state, keeps what it would command, and gives what was."""

    def __init__(self, law: OuterLaw, samples: Columns) -> None:
        self._law = law
        given = [samples[name].tolist() for name in COMMANDS[:2]] if samples else [[], []]
        self._recorded: Iterator[tuple[float, float]] = zip(*given, strict=True)
        self._commands: list[OuterCommand] = []

    def reset(self, reference: ReferenceState, estimate: Estimate) -> None:
        """Start anew from this estimate."""
        self._law.reset(reference, estimate)

    def step(self, reference: ReferenceState, estimate: Estimate, dt_s: float) -> OuterCommand:
        """Return the recorded command, with the trace of the shadow."""
        wanted = self._law.step(reference, estimate, dt_s)
        self._commands.append(wanted)
        eta1, theta_dot = next(self._recorded, (wanted.eta1_m_s, wanted.theta_dot_rad_s))
        return OuterCommand(eta1, theta_dot, wanted.trace)

    def columns(self, wheels: Callable[[float, float], tuple[float, float]], rows: int) -> Columns:
        """Return the command columns as the shadow would have had them."""
        import numpy as np  # noqa: PLC0415 - the loop itself needs none

        table = [
            (c.eta1_m_s, c.theta_dot_rad_s, *wheels(c.eta1_m_s, c.theta_dot_rad_s))
            for c in self._commands[:rows]
        ]
        values = np.array(table, dtype=np.float64).reshape(len(table), len(COMMANDS))
        return {name: values[:, i].copy() for i, name in enumerate(COMMANDS)}
