"""`hil new`: a commented starting point in the current folder that runs at once."""

from __future__ import annotations

from pathlib import Path

import click

from hil.core.text import visible

KINDS = ("law", "scenario", "robot", "localiser", "estimator", "plant", "figure", "cost")


@click.command("new")
@click.argument("kind", type=click.Choice(KINDS))
@click.argument("name")
@click.option("--robot", metavar="FILE.toml", help="Of a scenario: the robot that drives it.")
def command(kind: str, name: str, robot: str | None) -> int:
    """Write NAME.py (a law, localiser, estimator, plant, figure or cost) or NAME.toml (a scenario or robot).

    What is written runs as it stands; its first lines say with which command. A file that is there
    already is left alone, and a name that is taken is refused.
    """
    from hil.config.load import load_robot
    from hil.tools.templates import write_template

    if robot is not None:
        if kind != "scenario":
            raise click.UsageError("--robot: only a scenario has a robot")
        load_robot(robot)
    path, command_text = write_template(kind, name, Path(), robot)
    click.echo(f"{visible(str(path))}: try it with\n    {visible(command_text)}")
    return 0
