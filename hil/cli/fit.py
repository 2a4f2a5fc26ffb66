"""`hil fit`: a twin of one's own robot from its log."""

from __future__ import annotations

from pathlib import Path

import click

from hil.cli.options import OutFile, json_option, print_json


@click.command("fit")
@click.argument("log", type=click.Path(path_type=Path))
@click.option("--map", "mapping", type=click.Path(path_type=Path), metavar="FILE.toml",
              help="Where each signal comes from, and its scale (docs/own-robot-fit.md).")  # fmt: skip
@click.option("--robot", "robot", required=True, type=click.Path(path_type=Path),
              metavar="FILE.toml", help="The robot file to write; one that stands there is where the "
              "fit begins, and is kept beside it.")  # fmt: skip
@click.option("--start", metavar="ROBOT",
              help="The robot as believed: a built-in name or a TOML file. [default: what stands in "
              "--robot, else thesis-4wd]")  # fmt: skip
@click.option("--report", type=OutFile(), metavar="FILE.html",
              help="Where the page goes. [default: beside the robot file]")  # fmt: skip
@click.option("--replay", "replay", is_flag=True,
              help="Fit nothing and write nothing: send LOG's commands through the twin that --robot "
              "holds, and say how well it foretells.")  # fmt: skip
@json_option
def command(
    log: Path,
    mapping: Path | None,
    robot: Path,
    start: str | None,
    report: Path | None,
    replay: bool,
    as_json: bool,
) -> None:
    """Find what LOG (CSV, .tlog or a run record) tells of the robot, and write its robot file.

    Commands, wheel speeds, motor voltages and poses are used as far as the log has them. Every value
    comes with its 95 % interval; what the log does not tell is said, with the manoeuvre that would;
    the last third of the log is not fitted and judges the twin, beside plain odometry.
    """
    from hil.config.load import load_robot
    from hil.core.errors import BadInput
    from hil.study.log_fit.fit import fit_log
    from hil.study.log_fit.page import write_page
    from hil.study.log_fit.replay import replay_log
    from hil.study.log_fit.robot_file import believed_robot, check_not, write_robot_file

    if replay:
        if start is not None:
            raise BadInput(f"--start {start}: goes with a fit, not with --replay")
        answer = replay_log(log, mapping, load_robot(str(robot)))
        if report is not None:
            check_not([report])
            write_page(report, answer.page())
        print_json(answer.to_json()) if as_json else click.echo(answer.text())
        return
    name, believed = believed_robot(robot, start)
    page = report or robot.with_suffix(".html")
    check_not([page])
    fit = fit_log(log, mapping, believed)
    kept = write_robot_file(robot, name, fit)
    write_page(page, fit.page())
    if kept is not None:
        click.echo(f"{robot} stood there: kept as {kept}", err=True)
    click.echo(f"written: {robot}, {page}", err=True)
    if as_json:
        print_json(fit.to_json() | {"robot_file": str(robot), "report": str(page)})
    else:
        click.echo(fit.text())
