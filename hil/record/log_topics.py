"""Logs of messages on topics - DataFlash, ULog, MCAP - made into signals on one time.

A row is made for each message that gives est_x_m; other signals hold their latest value. Where a
mapping says nothing else, what stands behind the time already read is left out and counted.
"""

from __future__ import annotations

import difflib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from hil.core.errors import BadInput
from hil.record.log_mapping import LogMapping, Source
from hil.record.log_signals import POSE, Signals, fall_text, held, in_order, scaled, whole_poses

if TYPE_CHECKING:
    from hil.record.log_signals import Array


_LATEST_S = 4e9  # the year 2096, as a wall time


@dataclass(frozen=True, slots=True)
class Topic:
    """The messages of one topic in the order of the log: their times and their number fields."""

    t_s: Array
    fields: dict[str, Array]


@dataclass(frozen=True, slots=True)
class TopicLog:
    """A log that was read: its topics by name, `standard` sources of columns, and what was left out."""

    path: Path
    topics: dict[str, Topic]
    standard: Mapping[str, Source]
    notes: tuple[str, ...]


def signals_of(log: TopicLog, settings: LogMapping) -> Signals:
    """Return a row for each pose of a log; raises BadInput."""
    own = {name: source for name, source in settings.columns.items() if source.message}
    known = {name: source for name, source in log.standard.items() if source.message in log.topics}
    sources = known | own
    if "est_x_m" not in sources:
        wanted = log.standard["est_x_m"].message if log.standard else ""
        standard = (
            f"neither the standard's {wanted} nor a mapping gives" if wanted else "no mapping gives"
        )
        raise BadInput(f"{log.path}: {standard} est_x_m; topics of the log: {_listed(log.topics)}")
    notes = list(log.notes)
    series: dict[str, tuple[Array, Array]] = {}
    for name, source in sources.items():
        t_s, values, said = _series(log, name, source, settings)
        series[name] = (t_s, values)
        notes += said
    rows = series["est_x_m"][0].tolist()
    columns = {
        name: held(t_s.tolist(), values.tolist(), rows) for name, (t_s, values) in series.items()
    }
    filled = {n: v for n, v in columns.items() if n in POSE or np.isfinite(v).any()}
    signals = whole_poses(np.array(rows), filled, str(log.path))
    return Signals(
        signals.t_s, signals.columns, notes=tuple(dict.fromkeys((*notes, *signals.notes)))
    )


def _series(
    log: TopicLog, name: str, source: Source, settings: LogMapping
) -> tuple[Array, Array, list[str]]:
    """Return times and values of a column in order of time; raises BadInput."""
    topic = log.topics.get(source.message)
    if topic is None:
        raise BadInput(
            f"{log.path}: has no topic {source.message!r} for {name}; "
            f"{_near(source.message, log.topics)}"
        )
    values = _field(log, source, topic, name)
    own_time = "t" in settings.model_fields_set and settings.t.field
    t_s = scaled(_field(log, settings.t, topic, "t"), settings.t) if own_time else topic.t_s
    disorder = settings.disorder if "disorder" in settings.model_fields_set else "skip"

    def refusal(k: int) -> str:
        return f"{log.path}: {source.message} no. {k + 1}: {fall_text(t_s[k - 1], t_s[k])}"

    damaged = ~(np.abs(t_s) < _LATEST_S)
    t_s = np.where(damaged, np.nan, t_s)
    places, notes = in_order(t_s, disorder, refusal, f"messages of {source.message}")
    if damaged.any():
        count = np.count_nonzero(damaged)
        notes.append(f"{count} of {t_s.size} messages of {source.message} have no time: left out")
    return t_s[places], scaled(values, source)[places], notes


def _field(log: TopicLog, source: Source, topic: Topic, name: str) -> Array:
    if source.field in topic.fields:
        return topic.fields[source.field]
    raise BadInput(
        f"{log.path}: {source.message or 'a topic'} has no number field {source.field!r} for {name}; "
        f"{_near(source.field, topic.fields)}"
    )


def _near(name: str, known: Mapping[str, object]) -> str:
    near = difflib.get_close_matches(name, known, n=3, cutoff=0.6)
    return f"near: {', '.join(near)}" if near else f"it has {_listed(known)}"


def _listed(names: Mapping[str, object]) -> str:
    shown = sorted(names)[:20]
    return ", ".join(shown) + (", ..." if len(names) > 20 else "") if shown else "none"
