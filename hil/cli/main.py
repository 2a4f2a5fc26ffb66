"""The `hil` command: a group whose sub-commands are imported only when they are called."""

from __future__ import annotations

import importlib
import os
import sys
from typing import NoReturn

import click

from hil import __version__
from hil.core.errors import HilError
from hil.core.text import visible
from hil.runs.interruption import end_as_by_ctrl_c

# name -> (module, one-line help). The text stands here so that `hil --help` imports no command.
COMMANDS = {
    "run": ("hil.cli.run", "Run one scenario on a target and record it."),
    "experiment": (
        "hil.cli.experiment",
        "Run every scenario of a deck with both laws; one report.",
    ),
    "compare": ("hil.cli.compare", "Compare recorded runs: table, JSON and HTML report."),
    "replay": ("hil.cli.replay", "Replay a record exactly, or with another law as its shadow."),
    "import": ("hil.cli.importing", "Make a record of a MAVLink .tlog or a CSV file."),
    "view": ("hil.cli.view", "Open recorded runs in the viewer."),
    "sweep": ("hil.cli.sweep", "Run a campaign over grids, lists and distributions; draw maps."),
    "tune": ("hil.cli.tune", "Tune the gains of both laws by one procedure and budget."),
    "twin": ("hil.cli.twin", "Serve the digital twin to other programs."),
    "firmware": ("hil.cli.firmware", "Generate, build, upload and configure the firmware."),
    "calibrate": ("hil.cli.calibrate", "Calibrate lens, camera pose over the floor, and colours."),
    "bringup": ("hil.cli.bringup", "Check a rig with its wheels off the ground; measure it."),
    "localise": ("hil.cli.localise", "Find the robot in a video or in images, without a rig."),
    "doctor": ("hil.cli.doctor", "Say what is installed and connected, and what is missing."),
    "bench": ("hil.cli.bench", "Measure the speed of the harness on this machine."),
}


class LazyGroup(click.Group):
    """A click group that imports a command's module when that command is used."""

    def list_commands(self, ctx: click.Context) -> list[str]:  # noqa: ARG002 - click's signature
        """Return the command names in the order in which a newcomer needs them."""
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:  # noqa: ARG002
        """Import and return the command, None when there is no such command."""
        if cmd_name not in COMMANDS:
            return None
        command = importlib.import_module(COMMANDS[cmd_name][0]).command
        assert isinstance(command, click.Command)
        return command

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:  # noqa: ARG002
        """Write the command list from the table above, without importing anything."""
        with formatter.section("Commands"):
            formatter.write_dl([(name, text) for name, (_, text) in COMMANDS.items()])


@click.group(cls=LazyGroup, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(__version__, prog_name="hil")
def cli() -> None:
    """Hardware-in-the-loop test harness for a four-wheel skid-steer robot.

    Start with `hil experiment` (all three scenarios on the digital twin, both laws, one report) or
    `hil run scenario-1 --view`. Results go to stdout, progress and log to stderr.

    \b
    Exit status: 0 all requirements held, 1 a requirement failed, 2 bad usage or input,
    3 rig fault (port, camera, board), 130 stopped by Ctrl-C (or SIGTERM, SIGHUP).
    """  # noqa: D301 - \b is click's mark for a verbatim paragraph


def main() -> NoReturn:
    """Run the command line; every expected error is one line on stderr and its exit status."""
    end_as_by_ctrl_c()
    try:
        status = cli.main(prog_name="hil", standalone_mode=False)
        sys.exit(status if isinstance(status, int) else 0)
    except click.exceptions.NoArgsIsHelpError as error:
        click.echo(error.format_message(), err=True)
        sys.exit(2)
    except click.ClickException as error:
        click.echo(f"hil: {visible(' '.join(error.format_message().split()))}", err=True)
        sys.exit(error.exit_code if isinstance(error, click.UsageError) else 2)
    except HilError as error:
        click.echo(f"hil: {visible(str(error))}", err=True)
        sys.exit(error.exit_status)
    except (click.Abort, KeyboardInterrupt):
        click.echo("hil: stopped by Ctrl-C", err=True)
        sys.exit(130)
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        sys.exit(1)


if __name__ == "__main__":
    main()
