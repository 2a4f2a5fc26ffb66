"""The measured robot file: a robot that lies on the believed one, with measured values only."""

from __future__ import annotations

import os
from pathlib import Path

from hil.core.errors import BadInput
from hil.core.files import replace_file
from hil.tools.bringup.result import Measured, Pair
from hil.tools.bringup.verdicts import COUNTS_ERROR_MAX


def check_out(out: Path, believed: str) -> None:
    """Raise BadInput, before any wheel turns, when the file cannot be written afterwards."""
    if not out.parent.is_dir():
        raise BadInput(f"--out {out}: no such folder {out.parent}")
    if out.is_dir():
        raise BadInput(f"--out {out}: is a folder; name a file")
    if out.exists() and Path(believed).exists() and out.samefile(believed):
        raise BadInput(f"--out {out}: is the file that --robot names; name another")


def write_robot_file(
    out: Path, believed: str, believed_counts: int, measured: Measured, when: str
) -> bool:
    """Write the file in one step; values that were not measured stay those of `believed`.

    Returns False, and writes nothing, when there is nothing to write.
    """
    found = _counts(believed_counts, measured) + _bring_up(measured)
    if not found:
        return False
    head = f"# Measured by hil bringup, {when}; the rest is as in the file below.\n"
    lines = [head, f'base = "{_beside(out, believed)}"', *found]
    replace_file(out, ("\n".join(lines) + "\n").encode())
    return True


def _beside(out: Path, believed: str) -> str:
    """Return a built-in name as it is, a file as seen from the folder of `out`."""
    if not Path(believed).is_file():
        return believed
    return Path(os.path.relpath(Path(believed).resolve(), out.resolve().parent)).as_posix()


def _counts(believed: int, measured: Measured) -> list[str]:
    found = [value for value in measured.counts_per_turn or () if value is not None]
    if not found:
        return []
    mean = sum(found) / len(found)
    agrees = abs(mean / believed - 1.0) <= COUNTS_ERROR_MAX
    value = believed if agrees else round(mean)
    said = " and ".join(f"{one:.0f}" for one in found)
    how = f"{said} by about {measured.turns:g} turns seen"
    if agrees:
        how += f", which confirm it within {COUNTS_ERROR_MAX:.0%}"
    return [f"encoder_counts_per_turn = {value}  # counts; {how}"]


def _bring_up(measured: Measured) -> list[str]:
    """Return the table of raw figures; it is whole or not there."""
    rows = [
        ("dead_duty_forward", measured.dead_duty_forward, 3, "duty; ramp of 0.05 1/s, first"
         " 0.1 s at 0.3 rad/s or more"),
        ("dead_duty_backward", measured.dead_duty_backward, 3, "duty; the same backward"),
        ("top_speed_forward_rad_s", measured.top_speed_forward_rad_s, 2, "rad/s; mean of 1 s at"
         " full duty, from counts and board time"),
        ("top_speed_backward_rad_s", measured.top_speed_backward_rad_s, 2, "rad/s; the same"
         " backward"),
    ]  # fmt: skip
    if measured.top_speed_battery_v is None or not all(_whole(pair) for _, pair, _, _ in rows):
        return []
    lines = ["", "[bring_up]  # wheels off the ground, (left, right)"]
    for name, pair, digits, how in rows:
        left, right = (round(value or 0.0, digits) for value in pair or ())
        lines.append(f"{name} = [{left}, {right}]  # {how}")
    volts = round(measured.top_speed_battery_v, 2)
    return [*lines, f"battery_v = {volts}  # V; as the board reads it at full speed"]


def _whole(pair: Pair | None) -> bool:
    return pair is not None and None not in pair
