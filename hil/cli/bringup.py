"""`hil bringup`: wheels off the ground, everything checked piece by piece, the robot measured."""

from __future__ import annotations

import sys
from contextlib import suppress
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING

import click

from hil.cli.options import json_option, print_json
from hil.core.errors import BadInput, RigFault
from hil.core.text import visible

if TYPE_CHECKING:
    from hil.config.robot import RobotConfig
    from hil.tools.bringup.result import Check, Report, Side
    from hil.tools.bringup.wiring import Seen

_KEYS = "lf, lb, rf, rb, n, ?"
_SEEN = "[lf] left forward, [lb] left backward, [rf] right forward, [rb] right backward, [n] none"


@click.command("bringup")
@click.option("--on", "target", required=True, metavar="serial:DEV[@BAUD]",
              help="Port of the board.")  # fmt: skip
@click.option("--robot", default="thesis-4wd", show_default=True, metavar="ROBOT",
              help="The robot as believed: a built-in name or a TOML file.")  # fmt: skip
@click.option("--out", type=click.Path(path_type=Path), metavar="FILE",
              help="Write the measured robot file, laid over the believed one.")  # fmt: skip
@click.option("--turns", type=click.FloatRange(0.0, 100.0), default=10.0, show_default=True,
              help="Wheel turns for the count of the encoders; 0 leaves it out.")  # fmt: skip
@click.option("--floor", is_flag=True, help="The robot stands on its floor with half a metre free "
              "around it: measure whether it turns there, and nothing else.")  # fmt: skip
@click.option("--yes", is_flag=True, help="The wheels are off the ground and nobody looks at "
              "them: no questions, directions stay unseen.")  # fmt: skip
@json_option
def command(
    target: str, robot: str, out: Path | None, turns: float, floor: bool, yes: bool, as_json: bool
) -> int:
    """Check a rig whose wheels are OFF THE GROUND, and measure the robot.

    Link, identity, battery; each side alone, slowly: motor, encoder, left and right; then dead zone
    and top speed, forward and backward; then counts a turn. Status 1 when a check fails. The wheels
    stand whenever a question is asked, and at the end.

    With --floor the robot stands where it will drive, and turns on the spot to either side instead: how
    much duty a turn takes there, and how fast it is at full duty.
    """
    from hil.config.load import load_robot
    from hil.rigs.opening import is_simulated
    from hil.rigs.serial import parse_target
    from hil.tools.bringup.robot_file import check_out, write_robot_file

    if is_simulated(target):
        raise BadInput(
            f"--on {target}: bringup needs a port; to try it on the twin, `hil twin serve --set "
            "robot.variant=lifted`, then --on serial:PORT with the port that it names"
        )
    believed = load_robot(robot)
    device, baud = parse_target(target)
    if out is not None:
        if floor:
            raise BadInput(
                "--out: --floor measures nothing of the robot's file; leave one of them out"
            )
        check_out(out, robot)
    _require_port(device)
    if not yes:
        _confirm(floor)
    report = _run(device, baud, believed, 0.0 if yes else turns, yes, floor)
    if as_json:
        print_json({"target": target, **report.to_json()})
    else:
        click.echo(_summary(report))
    if out is not None:
        when = f"{datetime.now().astimezone():%Y-%m-%d %H:%M} on {target}"
        counts = believed.encoder_counts_per_turn
        written = write_robot_file(out, robot, counts, report.measured, when)
        click.echo(
            f"{'written' if written else 'nothing measured, not written'}: {visible(str(out))}",
            err=True,
        )
    return 0 if report.passed else 1


def _require_port(device: str) -> None:
    """Raise RigFault for a port that is not there, before anybody is asked anything."""
    if device.startswith("/") and not Path(device).exists():
        raise RigFault(f"port {device}: no such port; `hil doctor` lists the ports")


def _run(
    device: str, baud: int, believed: RobotConfig, turns: float, yes: bool, floor: bool
) -> Report:
    from hil.rigs.serial import SerialRig
    from hil.tools.bringup.procedure import BringUp, plan_for

    plan = plan_for(believed, turns, floor=floor)
    rig = SerialRig(device, baud, None)
    try:
        return BringUp(rig, Nobody() if yes else Person(), plan, _tell).run()
    finally:
        rig.close()


def _tell(check: Check) -> None:
    """Print one check, on stderr: stdout is for the result."""
    marks = {"ok": ("pass", "green"), "fail": ("FAIL", "red"), "note": ("note", "yellow"),
             "skipped": ("skip", "yellow")}  # fmt: skip
    word, colour = marks[check.state]
    click.echo(f"{click.style(word, fg=colour)}  {check.name}: {visible(check.text)}", err=True)
    if check.remedy:
        click.echo(f"      -> {visible(check.remedy)}", err=True)


def _summary(report: Report) -> str:
    if report.passed:
        return "bring-up: all checks passed"
    found = ", ".join(f"{name}: {fault}" for name, fault in report.faults)
    return f"bring-up: {len(report.faults)} failed ({found})"


def _ask(question: str) -> str:
    """Return the answer; raises BadInput where nobody can give one."""
    click.echo(f"{question} ", nl=False, err=True)
    with suppress(EOFError):
        return input().strip().lower()
    click.echo(err=True)
    raise BadInput("bringup asks what the wheels do: run it in a terminal, or with --yes")


def _told(answer: str) -> str:
    return repr(answer) if answer else "an empty line"


def _confirm(floor: bool) -> None:
    answer = _ask(
        "The robot will turn on the spot, up to full duty. Is half a metre around it free? [y/N]"
        if floor
        else "The wheels will turn, up to full speed. Are ALL of them off the ground? [y/N]"
    )
    if answer not in {"y", "yes"}:
        click.echo("nothing was moved", err=True)
        sys.exit(2)


class Person:
    """Somebody at the terminal who looks at the wheels."""

    def watch(self, text: str) -> None:
        """Say what is about to be driven, and wait until they look."""
        _ask(f"\nNext, {text}. Enter when you look at them:")

    def seen(self, driven: Side) -> Seen | None:
        """Ask which wheels turned and which way."""
        from hil.tools.bringup.wiring import Seen

        sides: dict[str, Seen | None] = {
            "lf": Seen("left"), "lb": Seen("left", forward=False), "rf": Seen("right"),
            "rb": Seen("right", forward=False), "n": Seen(None), "?": None,
        }  # fmt: skip
        while True:
            answer = _ask(f"{driven} was driven. Which wheels turned? {_SEEN}, [?] not seen:")
            if answer in sides:
                return sides[answer]
            click.echo(f"{_told(answer)} is none of them; type one of {_KEYS}", err=True)

    def turns(self, side: Side, believed: float) -> float | None:
        """Ask for the number of turns counted."""
        while True:
            answer = _ask(
                f"How many turns did the {side} wheels make, to a twentieth? "
                f"(the counts say {believed:.2f}; [?] not counted):"
            )
            if answer == "?":
                return None
            with suppress(ValueError):
                if float(answer) > 0.0:
                    return float(answer)
            click.echo(f"{_told(answer)} is no number of turns; type it, or ?", err=True)


class Nobody:
    """Nobody looks: directions stay unseen, turns uncounted."""

    def watch(self, text: str) -> None:
        """Say what is driven."""
        click.echo(f"      {text}", err=True)

    def seen(self, driven: Side) -> Seen | None:  # noqa: ARG002 - nobody looks at either side
        """Return None."""
        return None

    def turns(self, side: Side, believed: float) -> float | None:  # noqa: ARG002
        """Return None."""
        return None
