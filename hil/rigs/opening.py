"""Targets: what stands below the byte stream and the camera frame, chosen by name."""

from __future__ import annotations

from typing import TYPE_CHECKING

from hil.core.errors import BadInput
from hil.core.registries import TARGETS
from hil.rigs.asked import Asked

if TYPE_CHECKING:
    from hil.config.scenario import Scenario
    from hil.core.registry import Entry
    from hil.core.rig import Rig
    from hil.wire.signing import Key

REPLAY = "replay:"


def open_rig(
    target: str,
    scenario: Scenario,
    camera: str,
    seed: int,
    key: Key | None = None,
    *,
    usb: bool = False,
) -> Rig:
    """Return the rig that `target` names, ready to be talked to; raises BadInput or RigFault.

    With a `key` what is said to its board is signed and what it says is checked. A simulated board is met on
    its USB port with `usb`, else on the Bluetooth one.
    """
    entry = target_entry(target)
    rig: Rig = entry.factory(Asked(target.partition(":")[2], scenario, camera, seed, key, usb))
    return rig


def target_entry(target: str) -> Entry:
    """Return the entry of a target such as `twin` or `serial:DEV`; raises BadInput."""
    name, colon, _ = target.partition(":")
    for entry in TARGETS.entries():
        if entry.name == name and bool(colon) == (":" in _form(entry)):
            return entry
    *others, last = (_form(entry) for entry in sorted(TARGETS.entries(), key=_in_order))
    raise BadInput(f"target {target!r}: unknown; choose {', '.join(others)} or {last}")


def is_simulated(target: str) -> bool:
    """Say whether a target is simulated: it waits for the host and repeats itself by its seed."""
    entry = next((e for e in TARGETS.entries() if e.name == target.partition(":")[0]), None)
    return entry is not None and bool(entry.extra.get("simulated"))


def simulated_targets() -> list[str]:
    """Return the names of the targets that are simulated."""
    found = [entry for entry in TARGETS.entries() if entry.extra.get("simulated")]
    return [entry.name for entry in sorted(found, key=_in_order)]


def _form(entry: Entry) -> str:
    return str(entry.extra.get("form", entry.name))


def _in_order(entry: Entry) -> tuple[bool, int]:
    """Return the order in which targets are named: simulated ones, then as they say themselves."""
    return not entry.extra.get("simulated"), entry.extra.get("order", 0)
