"""`hil replay`: a run record through the host's own loop again, exactly or as a shadow."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from hil.cli.options import INNER_LAWS, json_option, plain_console, print_json, set_option
from hil.core.text import visible

if TYPE_CHECKING:
    from hil.replays.exact import ReplayReport


@click.command("replay")
@click.argument("run", type=click.Path(path_type=Path))
@click.option("--outer", metavar="LAW", help="Shadow: what this outer law would have commanded.")
@click.option("--recorded-code", is_flag=True,
              help="Run the law's text that RUN holds (code from a record: look at it first).")  # fmt: skip
@click.option("--inner", type=INNER_LAWS, help="Shadow: PWM that this wheel law would have set.")
@click.option("--firmware", is_flag=True,
              help="Also replay set-points and encoder counts through the firmware core.")  # fmt: skip
@click.option("--elf", is_flag=True,
              help="As --firmware, through the board's own binary on a simulated processor.")  # fmt: skip
@click.option("--fit", is_flag=True,
              help="Also fit a twin to RUN and run another law on it, in closed loop: that of --outer, "
              "--inner and --set, else the other outer law.")  # fmt: skip
@set_option
@click.option("--out", type=click.Path(path_type=Path), metavar="DIR",
              help="Folder for replay.json and replayed.parquet; must not exist or be empty.")  # fmt: skip
@json_option
def command(
    run: Path,
    outer: str | None,
    recorded_code: bool,
    inner: str | None,
    firmware: bool,
    elf: bool,
    fit: bool,
    overrides: tuple[str, ...],
    out: Path | None,
    as_json: bool,
) -> int:
    """Send the recorded frames and bytes of RUN through localisation, estimator and law again.

    Without options the replay is exact: it must give the recorded commands bit for bit (exit
    status 0), or the first difference of each channel is reported (1). With --outer or --set it is
    a shadow: what that law would have commanded in each recorded state. The robot did not follow
    the shadow, so this is open loop and no verdict on the other law. A shadow that its own limits
    stop before the record's last tick ends with status 3.

    --firmware, --inner or a --set of a board parameter sends the recorded set-points and encoder
    counts through the firmware core and compares its PWM with the recorded one; with --elf through
    the ELF that is uploaded to the board, under simavr. --fit answers in
    closed loop, on a twin whose parameters are fitted to RUN, with the residual of that fit.
    """
    from hil.core.files import claim_folder
    from hil.replays.elf import elf as elf_firmware
    from hil.replays.firmware import core, replay_wheels
    from hil.replays.output import write_output
    from hil.replays.what_if import what_if
    from hil.study.log_fit.replay import is_imported

    if fit and is_imported(run):
        changed = [f"--{name}" for name, value in (
            ("outer", outer), ("inner", inner), ("firmware", firmware), ("elf", elf),
            ("set", overrides), ("recorded-code", recorded_code),
        ) if value]  # fmt: skip
        return _replay_imported(run, changed, out, as_json)
    through = elf_firmware() if elf else core()
    if out is not None:
        claim_folder(out)
    report = _host_loop(run, outer, overrides, recorded_code=recorded_code)
    board_changes = [text for text in overrides if text.startswith("board.")]
    asked = firmware or elf or inner or board_changes
    wheels = replay_wheels(run, inner, board_changes, through) if asked else None
    answer = what_if(run, outer, overrides, inner=inner) if fit else None
    document = report.to_json() | {
        "firmware": wheels.to_json() if wheels else None,
        "fitted_twin": answer.to_json() if answer else None,
    }
    if out is not None:
        write_output(out, report, document)
    if as_json:
        print_json(document)
    else:
        print_report(report)
        if wheels is not None:
            click.echo(wheels.text())
        if answer is not None:
            click.echo(answer.text())
    return _status(report)


def _host_loop(
    run: Path, outer: str | None, overrides: tuple[str, ...], *, recorded_code: bool
) -> ReplayReport:
    """Replay through the host's loop, with a bar."""
    from hil.cli.progress import run_progress
    from hil.record.manifest import read_manifest
    from hil.replays.exact import replay

    told = read_manifest(run).scenario.get("duration_s")
    duration_s = float(told) if isinstance(told, int | float) else 0.0  # for the bar; replay checks
    with run_progress({run.name: duration_s}) as update:
        return replay(
            run,
            outer,
            overrides,
            lambda t_s: update(run.name, t_s),
            recorded_code=recorded_code,
        )


def _status(report: ReplayReport) -> int:
    """Return 0; 1 for an exact replay that differs, 3 for a shadow that was stopped on its way."""
    if report.kind == "exact":
        return 0 if report.identical else 1
    stopped = report.ending.outcome == "fault" and report.ticks_replayed < report.ticks_recorded
    return 3 if stopped and not report.cut_off else 0


def _replay_imported(run: Path, changed: list[str], out: Path | None, as_json: bool) -> int:
    """Send an imported record's commands through a twin fitted to its first part."""
    import json

    from hil.core.errors import BadInput
    from hil.core.files import claim_folder, replace_file
    from hil.study.log_fit.page import write_page
    from hil.study.log_fit.replay import replay_imported

    if changed:
        raise BadInput(
            f"{', '.join(changed)}: {run} is an imported log, which has neither frames nor bytes of the "
            "board: --fit alone fits a twin to its commands and replays them"
        )
    if out is not None:
        claim_folder(out)
    answer, fitted = replay_imported(run)
    document = {"kind": "imported", "fitted_twin": fitted, "held_out": answer.to_json()}
    if out is not None:
        text = json.dumps(document, indent=1, ensure_ascii=False, allow_nan=False)
        replace_file(out / "replay.json", text.encode() + b"\n")
        write_page(out / "replay.html", answer.page())
    if as_json:
        print_json(document)
    else:
        click.echo(answer.text())
    return 0


def print_report(report: ReplayReport) -> None:
    """Write the verdict and every channel that differs to stdout."""
    console = plain_console()
    for problem in report.problems:
        console.print(f"note: {visible(problem)}")
    console.print(visible(headline(report)))
    if report.kind == "shadow":
        for line in shadow_lines(report):
            console.print(visible(line))
        return
    different = [channel for channel in report.channels if not channel.same]
    if not different:
        return
    first = report.first
    assert first is not None
    console.print(f"first difference: {first.text()}")
    for channel in different:
        if channel is not first:
            console.print(f"  {channel.text()}")
    same = ", ".join(channel.name for channel in report.channels if channel.same)
    console.print(f"identical: {same or 'no channel'}")


def shadow_lines(report: ReplayReport) -> list[str]:
    """Return how far apart the commands of the two laws are, in their units; the rest is counted."""
    from hil.record.schema import SAMPLE_COLUMNS
    from hil.replays.exact import COMMANDS

    columns = {column.name: column for column in SAMPLE_COLUMNS}
    by_name = {channel.name: channel for channel in report.channels}
    lines = []
    for name in COMMANDS:
        channel, unit = by_name[name], columns[name].unit
        apart = (
            "the same in every row"
            if channel.same
            else f"{channel.rms:.3g} {unit} apart (RMS), {channel.largest:.3g} {unit} at most, first "
            f"at t = {channel.first_s:.3f} s"
        )
        lines.append(f"  {columns[name].meaning}: {apart}")
    others = [c for c in report.channels if c.name not in COMMANDS and not c.same]
    if others:
        lines.append(f"  {len(others)} further channels differ; --json or --out DIR has them all")
    return lines


def headline(report: ReplayReport) -> str:
    """Return the answer in one sentence."""
    covered = f"{report.ticks_replayed} of {report.ticks_recorded} ticks, from {report.seen_by}"
    if report.kind == "shadow":
        ending = report.ending
        short = ending.outcome == "fault" and report.ticks_replayed < report.ticks_recorded
        covered += f"; stopped there: {ending.detail}" if short else ""
        changed = "".join(f", {change}" for change in report.changes)
        return (
            f"shadow of {report.law}{changed} (open loop: the robot followed the recorded "
            f"commands): {covered}"
        )
    verdict = "reproduces the record bit for bit" if report.identical else "DIFFERS from the record"
    cut = "; the record ends in mid-run, the intact part was replayed" if report.cut_off else ""
    return f"exact replay {verdict}: {covered}{cut}"
