"""What the conformance kit found: one line a check, and how checks are run."""

from __future__ import annotations

import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hil.core.errors import BadInput, HilError
from hil.core.registry import Entry, Registry, in_one_line

# What is checked: a registered name, a file (`path.py`, `path.py:Name`), or the class itself.
Named = str | Path | Callable[..., Any]


class Violation(Exception):
    """A check does not hold; the message says what was seen."""


@dataclass(frozen=True, slots=True)
class Finding:
    """One check: `said` is what was measured, or what is wrong."""

    name: str
    holds: bool
    said: str

    def text(self) -> str:
        """Return one line for a person."""
        return f"{'holds' if self.holds else 'FAILS'}  {self.name}: {self.said}"


@dataclass(frozen=True, slots=True)
class Report:
    """All checks of one thing, in the order in which they were made."""

    kind: str
    name: str
    origin: str
    findings: tuple[Finding, ...]

    @property
    def passed(self) -> bool:
        """Say whether every check holds."""
        return all(finding.holds for finding in self.findings)

    @property
    def failures(self) -> tuple[str, ...]:
        """Return the names of the checks that do not hold."""
        return tuple(finding.name for finding in self.findings if not finding.holds)

    def text(self) -> str:
        """Return the report for a person, a line a check."""
        return "\n".join(
            [f"{self.kind} {self.name} ({self.origin})", *(f"  {f.text()}" for f in self.findings)]
        )

    def to_json(self) -> dict[str, Any]:
        """Return the report as one JSON document."""
        return {
            "kind": self.kind,
            "name": self.name,
            "origin": self.origin,
            "passed": self.passed,
            "checks": [{"name": f.name, "holds": f.holds, "said": f.said} for f in self.findings],
        }

    def required(self) -> Report:
        """Return the report; raises AssertionError that names every check that does not hold."""
        if not self.passed:
            wrong = "\n".join(f"  {f.text()}" for f in self.findings if not f.holds)
            raise AssertionError(f"{self.kind} {self.name} ({self.origin}):\n{wrong}")
        return self


class Checks:
    """Runs checks one after the other; one that fails or raises does not end the others."""

    def __init__(self, kind: str, name: str, origin: str) -> None:
        self._about = (kind, name, origin)
        self._findings: list[Finding] = []

    def run(self, name: str, check: Callable[[], str]) -> bool:
        """Make a check, which returns what it measured or raises; say whether it holds."""
        try:
            self._findings.append(Finding(name, True, check()))
        except (Violation, HilError) as error:
            self._findings.append(Finding(name, False, str(error)))
        except Exception as error:
            self._findings.append(Finding(name, False, f"raised {_where(error)}"))
        return self._findings[-1].holds

    def leave_out(self, names: tuple[str, ...], why: str) -> None:
        """Count checks that cannot be made as not held."""
        self._findings += [Finding(name, False, f"not tried: {why}") for name in names]

    def report(self) -> Report:
        """Return what was found."""
        return Report(*self._about, tuple(self._findings))


def _where(error: Exception) -> str:
    frames = traceback.extract_tb(error.__traceback__)
    place = f" ({Path(frames[-1].filename).name}, line {frames[-1].lineno})" if frames else ""
    return f"{in_one_line(error)}{place}"


@contextmanager
def entry_of(registry: Registry, thing: Named) -> Iterator[Entry]:
    """Give the entry of what is to be checked; raises BadInput when there is none."""
    if isinstance(thing, str | Path):
        yield registry.get(str(thing))
        return
    for entry in registry.entries():
        if entry.factory is thing:
            yield entry
            return
    name = getattr(thing, "__name__", repr(thing))
    raise BadInput(f"{registry.kind} {name}: not registered; put the decorator over it")
