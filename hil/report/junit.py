"""Verdicts of runs in JUnit's XML, the form in which CI systems read test results.

One suite a run, one case a requirement. A requirement that was not met is a failure; all of a run
that did not come to its end are errors, whatever the part that was driven says.
"""

from __future__ import annotations

import math
import re
import xml.etree.ElementTree as ET
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from hil.core.files import replace_file, unwritable
from hil.core.text import visible

if TYPE_CHECKING:
    from hil.analysis.metrics import Verdict
    from hil.record.manifest import Manifest
    from hil.record.reader import RunRecord

# Characters that XML 1.0 section 2.2 has no way to write.
_NOT_XML = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
ENDS = "the run comes to its end"


@dataclass(frozen=True, slots=True)
class Case:
    """One requirement of one run, judged; `kind` is "", "failure" or "error"."""

    name: str
    kind: str = ""
    message: str = ""
    text: str = ""


def cases_of(record: RunRecord, report: Path | None = None) -> list[Case]:
    """Return a case for each requirement of a run; for a scenario without any, that it ended."""
    manifest = record.manifest
    places = f"record: {record.path}" + (f"\nreport: {report}" if report is not None else "")
    verdicts = record.verdicts()
    if manifest.outcome != "complete":
        ended = ": ".join(filter(None, (manifest.outcome, manifest.outcome_detail)))
        names = [item.text() for item in verdicts] or [ENDS]
        return [Case(name, "error", f"run not complete: {ended}", places) for name in names]
    if not verdicts:
        return [Case(ENDS)]
    return [_judged(item, places) for item in verdicts]


def _judged(item: Verdict, places: str) -> Case:
    if item.holds:
        return Case(item.text())
    return Case(item.text(), "failure", measured(item), f"{measured(item)}\n{places}")


def measured(item: Verdict) -> str:
    """Return what was measured and the limit: "delta1_final_m is 0.031 m, limit <= 0.02 m"."""
    unit = f" {item.unit}" if item.unit else ""
    limits = [
        f"{sign} {limit:g}{unit}"
        for sign, limit in ((">=", item.minimum), ("<=", item.maximum))
        if limit is not None
    ]
    value = f"{item.value:.4g}{unit}" if math.isfinite(item.value) else "not known in this run"
    return f"{item.name} is {value}, limit {' and '.join(limits)}"


def run_title(manifest: Manifest) -> str:
    """Return the name of a run for a list of results; a dot parts what JUnit readers nest."""
    names = (manifest.scenario_name, manifest.outer, manifest.inner, f"seed {manifest.seed}")
    return ".".join(name.replace(".", "_") for name in names)


def write_junit(path: Path, records: Sequence[RunRecord], report: Path | None = None) -> None:
    """Write one suite a run to `path`, atomically; raises BadInput when that is not possible."""
    suites = ET.Element("testsuites", name="hil")
    for record in records:
        samples_t_s = record.samples["t_s"]
        duration_s = float(samples_t_s[-1]) if samples_t_s.size else 0.0
        suite = _suite(
            suites, run_title(record.manifest), cases_of(record, report), max(duration_s, 0.0)
        )
        suite.set("timestamp", record.manifest.start_time_utc.split("+")[0])
        _properties(suite, record)
    _write(path, suites)


def write_fault(path: Path, name: str, message: str) -> None:
    """Write that a rig fault came before there was a record; raises BadInput."""
    suites = ET.Element("testsuites", name="hil")
    _suite(suites, name, [Case(ENDS, "error", message, message)], 0.0)
    _write(path, suites)


def _suite(parent: ET.Element, name: str, cases: Sequence[Case], time_s: float) -> ET.Element:
    counts = {kind: sum(case.kind == kind for case in cases) for kind in ("failure", "error")}
    suite = ET.SubElement(
        parent,
        "testsuite",
        name=_xml(name),
        tests=str(len(cases)),
        failures=str(counts["failure"]),
        errors=str(counts["error"]),
        skipped="0",
        time=f"{time_s:.3f}",
    )
    for case in cases:
        element = ET.SubElement(
            suite, "testcase", classname=_xml(name), name=_xml(case.name), time=f"{time_s:.3f}"
        )
        if case.kind:
            told = ET.SubElement(element, case.kind, message=_xml(case.message), type="hil")
            told.text = "\n".join(_xml(line) for line in case.text.split("\n"))
    return suite


def _properties(suite: ET.Element, record: RunRecord) -> None:
    """Put who the run was before the cases, where JUnit's schema has it."""
    manifest = record.manifest
    element = ET.Element("properties")
    about = {
        "record": str(record.path),
        "target": manifest.target,
        "camera": manifest.camera,
        "git_revision": manifest.git_revision,
        "command": manifest.command,
    }
    for name, value in about.items():
        ET.SubElement(element, "property", name=name, value=_xml(value))
    suite.insert(0, element)


def _xml(text: str) -> str:
    return _NOT_XML.sub("?", visible(text))


def _write(path: Path, suites: ET.Element) -> None:
    for name in ("tests", "failures", "errors"):
        suites.set(name, str(sum(int(suite.get(name, "0")) for suite in suites)))
    ET.indent(suites)
    try:
        replace_file(path, ET.tostring(suites, encoding="utf-8", xml_declaration=True) + b"\n")
    except OSError as error:
        raise unwritable(f"--junit {path}", error) from None
